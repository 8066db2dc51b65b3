"""Study ``legs``: the same clearances in legs of other lengths and masses."""

from importlib.util import find_spec

import attrs

from leg_wear_monitor.configuration.quantity import quantity
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.studies.plan.keys import Names, clearance_field, count_field, speed_field
from leg_wear_monitor.studies.plan.responses import place, response
from leg_wear_monitor.studies.plan.study import Study
from leg_wear_monitor.studies.point import Point

HIP, KNEE, FOOT = ("A", "B"), ("G",), ("I", "J")
PLACES: tuple[Names, ...] = (HIP, KNEE, FOOT)
ALL, RIGID_KNEE = HIP + KNEE + FOOT, HIP + FOOT
SETS: tuple[Names, ...] = (*PLACES, ALL, RIGID_KNEE)  # of every leg: each place alone, all, all but the knee


@attrs.frozen(kw_only=True)
class Legs(Study):
    """The claims of the paper in legs of other lengths and masses."""

    title = "Other lengths and masses"
    question = (
        "The paper's lengths and masses are not known: which of its claims hold in any leg of this kind, and "
        "which depend on lengths and masses?"
    )

    legs: int = count_field("drawn legs, those that do not walk included", 1, 260)
    length_tolerance: float = quantity(
        "", "lengths of ground and bodies are drawn within 1 ± this", at_least=0.0, at_most=0.5, default=0.1
    )
    mass_tolerance: float = quantity(
        "", "masses of bodies are drawn within 1 ± this", at_least=0.0, at_most=0.9, default=0.3
    )
    draw_seed: int = count_field("seed of the lengths and masses", 0, 1)
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()

    def check(self) -> None:
        """Make sure that the claims can be evaluated.

        Raises
        ------
        ConfigError
            If scipy is not installed.
        """
        if find_spec("scipy") is None:
            raise ConfigError("study", "", "legs needs scipy, the extra 'studies'")

    def points(self) -> list[Point]:
        """The leg of the file, and the drawn legs."""
        return [self._leg(number) for number in range(self.legs + 1)]

    def _leg(self, number: int) -> Point:
        where = place(
            ALL, self.clearance_m, self.speed_rpm,
            sets=[list(joints) for joints in SETS], leg=number, draw_seed=self.draw_seed,
            length_tolerance=self.length_tolerance, mass_tolerance=self.mass_tolerance,
        )  # fmt: skip
        each = (response("", place(s, self.clearance_m, self.speed_rpm), self.ensemble) for s in SETS)
        settings = where | attrs.asdict(self.ensemble)
        label = f"leg {number}" if number else "leg of the file"
        return Point(label=label, task="leg", settings=settings, cost=sum(point.cost for point in each))
