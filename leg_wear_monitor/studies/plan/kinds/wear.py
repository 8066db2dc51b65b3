"""Study ``wear``: where bushings and journals wear, and how that goes on over a life."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.studies.plan.keys import Names, count_field
from leg_wear_monitor.studies.plan.kinds.location import Location
from leg_wear_monitor.studies.plan.responses import cycle_cost, place, set_name
from leg_wear_monitor.studies.plan.study import Ensemble
from leg_wear_monitor.studies.point import Point, Settings

_LIKELY_JUMPS = 2.7  # of a life, for each time that the longest one is in the mean opening


@attrs.frozen(kw_only=True)
class Life:
    """How far wear is followed, and by what jumps, as in `leg_wear_monitor.life`."""

    opens_m: float = quantity(
        "m",
        "opening of the mean clearance of the joint that wears fastest",
        at_least=1.0e-7,
        at_most=0.1,
        default=1.0e-4,
    )
    jump_m: float = quantity(
        "m",
        "deepest change of a surface that a jump may make",
        at_least=1.0e-9,
        at_most=0.1,
        default=1.0e-5,
    )
    cycles: int = count_field("gait cycles simulated and averaged before each jump", 2, 6)
    runs: int = count_field("lives with different initial conditions", 2, 4)


def life_point(label: str, where: Settings, ensemble: Ensemble, life: Life) -> Point:
    """Point of a life for given run settings."""
    settings = where | attrs.asdict(life)
    settings |= {"perturb_fraction": ensemble.perturb_fraction, "seed": ensemble.seed}
    cycles = _LIKELY_JUMPS * life.opens_m / life.jump_m * (life.cycles + 1)
    return Point(label=label, task="life", settings=settings, cost=life.runs * cycles * cycle_cost(where))


@attrs.frozen(kw_only=True)
class Wear(Location):
    """Where bushings and journals wear, fresh and after wear has fed back over a life."""

    title = "Wear zones"
    question = "Where do bushing and journal of each joint wear, and how does the wear develop over a life?"

    life: Life = described("how far wear is followed", factory=Life)

    def points(self) -> list[Point]:
        """The response of every set, and its life."""
        return super().points() + [self._life(clearance_joints) for clearance_joints in self.sets]

    def _life(self, clearance_joints: Names) -> Point:
        where = place(clearance_joints, self.clearance_m, self.speed_rpm)
        return life_point(set_name(clearance_joints), where, self.ensemble, self.life)
