"""Study ``lubrication``: joints dry, and with oil or grease of several viscosities."""

import attrs

from leg_wear_monitor.configuration.quantity import quantity
from leg_wear_monitor.studies.plan.keys import check_rising
from leg_wear_monitor.studies.plan.responses import OnePlace
from leg_wear_monitor.studies.point import Point


@attrs.frozen(kw_only=True)
class Lubrication(OnePlace):
    """The same joints dry and greased, with the same wear coefficient where surfaces touch."""

    title = "Oil and grease"
    question = (
        "What does a film of oil or grease change in the forces, in the motion, in which joint wears first, "
        "and in how long it lasts?"
    )

    viscosities_pa_s: tuple[float, ...] = quantity(
        "Pa s", "viscosities, one per point beside the dry one", above=0.0, check=check_rising
    )
    roughness_m: float = quantity(
        "m", "thickness below which a film resists no more than there", above=0.0, default=1.6e-6
    )

    def points(self) -> list[Point]:
        """The dry joints, then each viscosity."""
        films = [
            {"viscosity_pa_s": viscosity, "roughness_m": self.roughness_m}
            for viscosity in self.viscosities_pa_s
        ]
        return [
            self.response("dry"),
            *(self.response(f"{film['viscosity_pa_s']:g} Pa s", film=film) for film in films),
        ]
