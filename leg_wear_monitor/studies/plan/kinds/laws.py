"""Study ``laws``: the laws of normal force and friction against each other."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.mechanism.law_names import FRICTION_LAWS, NORMAL_LAWS
from leg_wear_monitor.studies.plan.keys import Names, some_of
from leg_wear_monitor.studies.plan.responses import OnePlace
from leg_wear_monitor.studies.point import Point

# the laws of Hertz's elastic force, which differ in damping only; winkler has another elastic force and is
# compared if it is named
_OF_HERTZ = tuple(law for law in NORMAL_LAWS if law != "winkler")


@attrs.frozen(kw_only=True)
class Laws(OnePlace):
    """The normal force and friction laws against each other."""

    title = "Contact and friction laws"
    question = "How much do results depend on the laws of normal force and friction?"

    normal_laws: Names = described("laws of the normal force", default=_OF_HERTZ, check=some_of(NORMAL_LAWS))
    friction_laws: Names = described(
        "ramps of friction, each with the mechanism's own normal law",
        default=FRICTION_LAWS,
        check=some_of(FRICTION_LAWS),
    )
    friction_coefficients: tuple[float, ...] = quantity(
        "",
        "friction coefficients, each with the mechanism's own laws",
        at_least=0.0,
        at_most=2.0,
        default=(0.02, 0.05, 0.1),
    )

    def points(self) -> list[Point]:
        """Responses by the normal laws, the friction ramps and the friction coefficients."""
        points = [self.response(law, normal_law=law) for law in self.normal_laws]
        points += [self.response(f"friction {law}", friction={"law": law}) for law in self.friction_laws]
        return points + [
            self.response(f"friction coefficient {value:g}", friction={"coefficient": value})
            for value in self.friction_coefficients
        ]
