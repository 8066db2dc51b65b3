"""Study ``chaos``: how far the motion can be foretold."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.studies.plan.keys import (
    Names,
    clearance_field,
    clearance_joints_field,
    clearances_field,
    count_field,
    speed_field,
    speeds_field,
)
from leg_wear_monitor.studies.plan.responses import cycle_cost, millimetres, place, response, set_name
from leg_wear_monitor.studies.plan.study import Ensemble, Study
from leg_wear_monitor.studies.point import Point, Settings
from leg_wear_monitor.studies.tasks.grid import SAMPLES

PORTRAIT_CYCLES = 6


@attrs.frozen(kw_only=True)
class Exponent:
    """How the largest Lyapunov exponent is measured."""

    runs: int = count_field("pairs of neighbours with different initial conditions", 2, 4)
    cycles: int = count_field("gait cycles over which neighbours are followed", 10, 100)
    renewals: int = quantity(
        "",
        "renormalisations of the distance per cycle, a power of 2",
        at_least=1,
        at_most=SAMPLES,
        default=64,
        check=lambda times: None if SAMPLES % times == 0 else f"{times} does not divide {SAMPLES}",
    )
    distance: float = quantity(
        "", "distance after renormalisation, in clearances", at_least=1.0e-12, at_most=1.0e-3, default=1.0e-8
    )
    tolerance_m: float = quantity(
        "m",
        "local error allowed in a step; larger errors, as of simulate, add to the growth",
        at_least=1.0e-15,
        at_most=1.0e-6,
        default=1.0e-10,
    )


def exponent_point(label: str, where: Settings, ensemble: Ensemble, exponent: Exponent) -> Point:
    """Point of a Lyapunov exponent for given run settings."""
    settings = where | {"perturb_fraction": ensemble.perturb_fraction, "seed": ensemble.seed}
    settings |= attrs.asdict(exponent) | {"skip_cycles": ensemble.skip_cycles}
    cost = 6.0 * exponent.runs * exponent.cycles * cycle_cost(where)
    return Point(label=label, task="exponent", settings=settings, cost=cost)


@attrs.frozen(kw_only=True)
class Bifurcation:
    """Poincaré sections over a parameter."""

    clearances_m: tuple[float, ...] = clearances_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    cycles: int = count_field("gait cycles drawn at each value", 1, 60)
    skip_cycles: int = count_field("gait cycles before them", 0, 20)


@attrs.frozen(kw_only=True)
class Chaos(Study):
    """Predictability of the motion."""

    title = "Predictability of the motion"
    question = "How chaotic is the motion with clearance, and how fast do small errors grow?"

    joints: Names = clearance_joints_field()
    others: tuple[Names, ...] = described("other sets whose exponents are compared", default=())
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()
    section_cycles: int = count_field("points of a Poincaré map, one a cycle", 2, 1000)
    section_crank_angle_deg: float = quantity(
        "deg", "crank angle of the map", at_least=0.0, at_most=360.0, default=0.0
    )
    exponent: Exponent = described("how the Lyapunov exponent is measured", factory=Exponent)
    bifurcation: Bifurcation = described("parameters of the diagrams")

    def points(self) -> list[Point]:
        """The response, its Poincaré section, exponents of all sets, sections over clearance and speed."""
        whole = place(self.joints, self.clearance_m, self.speed_rpm)
        return [
            response(set_name(self.joints), whole, self.ensemble),
            self._section("section", whole, self.section_cycles, PORTRAIT_CYCLES),
            *(self._exponent(clearance_joints) for clearance_joints in (self.joints, *self.others)),
            *self._bifurcation(),
        ]

    @property
    def _start(self) -> Settings:
        return {"perturb_fraction": self.ensemble.perturb_fraction, "seed": self.ensemble.seed}

    def _exponent(self, clearance_joints: Names) -> Point:
        where = place(clearance_joints, self.clearance_m, self.speed_rpm)
        return exponent_point(set_name(clearance_joints), where, self.ensemble, self.exponent)

    def _section(self, label: str, where: Settings, cycles: int, portrait_cycles: int = 0) -> Point:
        skipped = self.bifurcation.skip_cycles
        settings = where | self._start
        settings |= {"cycles": cycles, "portrait_cycles": portrait_cycles, "skip_cycles": skipped}
        settings |= {"crank_angle_deg": self.section_crank_angle_deg, "runs": 1}
        cost = (cycles + skipped) * cycle_cost(where)
        return Point(label=label, task="section", settings=settings, cost=cost)

    def _bifurcation(self) -> list[Point]:
        over = self.bifurcation
        places = [(millimetres(size), place(self.joints, size, self.speed_rpm)) for size in over.clearances_m]
        places += [
            (f"{speed:g} rpm", place(self.joints, self.clearance_m, speed)) for speed in over.speeds_rpm
        ]
        return [self._section(label, where, over.cycles) for label, where in places]
