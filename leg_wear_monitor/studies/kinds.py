"""The studies: one class a question."""

from importlib.util import find_spec

import attrs

from leg_wear_monitor.configuration import described, quantity
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism import FRICTION_LAWS, NORMAL_LAWS
from leg_wear_monitor.studies.life_tasks import SAMPLES
from leg_wear_monitor.studies.plan import (
    Ensemble,
    Names,
    OneClearance,
    OneSet,
    Point,
    Settings,
    Study,
    Sweep,
    check_rising,
    check_sets,
    clearance_field,
    clearance_joints_field,
    clearances_field,
    count_field,
    cycle_cost,
    millimetres,
    response,
    run_settings,
    set_name,
    some_of,
    speed_field,
    speeds_field,
)

# Study ``chaos``: how far the motion can be foretold.


PORTRAIT_CYCLES = 6


@attrs.frozen(kw_only=True)
class Exponent:
    """How the largest Lyapunov exponent is measured."""

    runs: int = count_field("pairs of neighbours with different initial conditions", 2, 4)
    cycles: int = count_field("gait cycles over which neighbours are followed", 10, 100)
    renewals: int = quantity(
        "",
        "renormalisations of the distance per cycle, a power of 2",
        within=(1, SAMPLES),
        default=64,
        check=lambda times: None if SAMPLES % times == 0 else f"{times} does not divide {SAMPLES}",
    )
    distance: float = quantity(
        "", "distance after renormalisation, in clearances", within=(1.0e-12, 1.0e-3), default=1.0e-8
    )
    tolerance_m: float = quantity(
        "m",
        "local error allowed in a step; larger errors, as of simulate, add to the growth",
        within=(1.0e-15, 1.0e-6),
        default=1.0e-10,
    )


def exponent_point(label: str, run: Settings, ensemble: Ensemble, exponent: Exponent) -> Point:
    """Point of a Lyapunov exponent for given run settings."""
    settings = run | {"perturb_fraction": ensemble.perturb_fraction, "seed": ensemble.seed}
    settings |= attrs.asdict(exponent) | {"skip_cycles": ensemble.skip_cycles}
    cost = 6.0 * exponent.runs * exponent.cycles * cycle_cost(run)
    return Point(label=label, task="exponent", settings=settings, cost=cost)


@attrs.frozen(kw_only=True)
class Bifurcation:
    """Poincaré sections over a parameter."""

    clearances_m: tuple[float, ...] = clearances_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    cycles: int = count_field("gait cycles drawn at each value", 1, 60)
    skip_cycles: int = count_field("gait cycles before them", 0, 20)


@attrs.frozen(kw_only=True)
class Chaos(OneSet):
    """Predictability of the motion."""

    title = "Predictability of the motion"
    question = "How chaotic is the motion with clearance, and how fast do small errors grow?"

    others: tuple[Names, ...] = described("other sets whose exponents are compared", default=())
    section_cycles: int = count_field("points of a Poincaré map, one a cycle", 2, 1000)
    section_crank_angle_deg: float = quantity(
        "deg", "crank angle of the map", within=(0.0, 360.0), default=0.0
    )
    exponent: Exponent = described("how the Lyapunov exponent is measured", factory=Exponent)
    bifurcation: Bifurcation = described("parameters of the diagrams")

    def points(self) -> list[Point]:
        """The response, its Poincaré section, exponents of all sets, sections over clearance and speed."""
        over = self.bifurcation
        sections = [self._section("section", self.run_of(self.joints), self.section_cycles, PORTRAIT_CYCLES)]
        for size in over.clearances_m:
            run = run_settings(self.joints, size, self.speed_rpm)
            sections.append(self._section(millimetres(size), run, over.cycles))
        for speed in over.speeds_rpm:
            run = run_settings(self.joints, self.clearance_m, speed)
            sections.append(self._section(f"{speed:g} rpm", run, over.cycles))
        exponents = [
            exponent_point(set_name(joints), self.run_of(joints), self.ensemble, self.exponent)
            for joints in (self.joints, *self.others)
        ]
        return [self.response(set_name(self.joints)), sections[0], *exponents, *sections[1:]]

    def _section(self, label: str, run: Settings, cycles: int, portrait_cycles: int = 0) -> Point:
        skipped = self.bifurcation.skip_cycles
        settings = run | {"perturb_fraction": self.ensemble.perturb_fraction, "seed": self.ensemble.seed}
        settings |= {"cycles": cycles, "portrait_cycles": portrait_cycles, "skip_cycles": skipped}
        settings |= {"crank_angle_deg": self.section_crank_angle_deg, "runs": 1}
        cost = (cycles + skipped) * cycle_cost(run)
        return Point(label=label, task="section", settings=settings, cost=cost)


# Study ``laws``: the laws of normal force and friction against each other.


# the laws of Hertz's elastic force, which differ in damping only; winkler has another elastic force and is
# compared if it is named
_OF_HERTZ = tuple(law for law in NORMAL_LAWS if law != "winkler")


@attrs.frozen(kw_only=True)
class Laws(OneSet):
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
        within=(0.0, 2.0),
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


# Study ``legs``: the same clearances in legs of other lengths and masses.


HIP, KNEE, FOOT = ("A", "B"), ("G",), ("I", "J")
PLACES: tuple[Names, ...] = (HIP, KNEE, FOOT)
ALL, RIGID_KNEE = HIP + KNEE + FOOT, HIP + FOOT
SETS: tuple[Names, ...] = (*PLACES, ALL, RIGID_KNEE)  # of every leg: each place alone, all, all but the knee


@attrs.frozen(kw_only=True)
class Legs(OneClearance):
    """The claims of the paper in legs of other lengths and masses."""

    title = "Other lengths and masses"
    question = (
        "The paper's lengths and masses are not known: which of its claims hold in any leg of this kind, and "
        "which depend on lengths and masses?"
    )

    legs: int = count_field("drawn legs, those that do not walk included", 1, 260)
    length_tolerance: float = quantity(
        "", "lengths of ground and bodies are drawn within 1 ± this", within=(0.0, 0.5), default=0.1
    )
    mass_tolerance: float = quantity(
        "", "masses of bodies are drawn within 1 ± this", within=(0.0, 0.9), default=0.3
    )
    draw_seed: int = count_field("seed of the lengths and masses", 0, 1)

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
        run = self.run_of(
            ALL, sets=[list(joints) for joints in SETS], leg=number, draw_seed=self.draw_seed,
            length_tolerance=self.length_tolerance, mass_tolerance=self.mass_tolerance,
        )  # fmt: skip
        each = (response("", self.run_of(joints), self.ensemble) for joints in SETS)
        settings = run | attrs.asdict(self.ensemble)
        label = f"leg {number}" if number else "leg of the file"
        return Point(label=label, task="leg", settings=settings, cost=sum(point.cost for point in each))


# Study ``location``: clearance in one place or another.


@attrs.frozen(kw_only=True)
class Location(OneClearance):
    """Clearance in one place or another."""

    title = "Clearance location"
    question = "How do the effects of the same clearance differ between hip, knee and foot?"

    sets: tuple[Names, ...] = described("clearance joints of one run, a list of lists", check=check_sets)

    def points(self) -> list[Point]:
        """Response of each set of clearance joints."""
        return [self._response(joints) for joints in self.sets]

    def _response(self, joints: Names) -> Point:
        return response(set_name(joints), self.run_of(joints), self.ensemble)


# Study ``multi``: clearance in several places at once.


@attrs.frozen(kw_only=True)
class Multi(Location):
    """Clearance in all those places at once, against each place alone."""

    title = "Several clearances at once"
    question = (
        "Is the effect of clearances in all these joints the sum of the effects of each alone, and which "
        "joint is worst?"
    )

    def points(self) -> list[Point]:
        """The sets, and last all of their joints at once."""
        everything = dict.fromkeys(joint for clearance_joints in self.sets for joint in clearance_joints)
        return [*super().points(), self._response(tuple(everything))]


# Study ``size``: clearance size at chosen joints.


@attrs.frozen(kw_only=True)
class Size(Study):
    """Clearance size at chosen joints."""

    title = "Clearance size"
    question = (
        "How does the size of a clearance affect the motion, the impacts, the drive and the wear of the leg?"
    )
    sweep = Sweep("clearance", "radial clearance [mm]", lambda point: 1.0e3 * point.clearance_m)

    joints: Names = clearance_joints_field()
    clearances_m: tuple[float, ...] = clearances_field()
    speed_rpm: float = speed_field()

    def points(self) -> list[Point]:
        """Responses over the clearance."""
        return [
            response(millimetres(size), run_settings(self.joints, size, self.speed_rpm), self.ensemble)
            for size in self.clearances_m
        ]


# Study ``speed``: crank speed with clearance at chosen joints.


@attrs.frozen(kw_only=True)
class Speed(Study):
    """Crank speed with clearance at chosen joints."""

    title = "Crank speed"
    question = "How does the crank's speed affect a leg with clearance?"
    sweep = Sweep("speed", "crank speed [rpm]", lambda point: point.speed_rpm)

    joints: Names = clearance_joints_field()
    speeds_rpm: tuple[float, ...] = speeds_field()
    clearance_m: float = clearance_field()

    def points(self) -> list[Point]:
        """Responses over the speed."""
        return [
            response(f"{speed:g} rpm", run_settings(self.joints, self.clearance_m, speed), self.ensemble)
            for speed in self.speeds_rpm
        ]


# Study ``wear``: where bushings and journals wear, and how that goes on over a life.


_LIKELY_JUMPS = 2.7  # of a life, for each time that the longest one is in the mean opening


@attrs.frozen(kw_only=True)
class Life:
    """How far wear is followed, and by what jumps, as in `leg_wear_monitor.life`."""

    opens_m: float = quantity(
        "m",
        "opening of the mean clearance of the joint that wears fastest",
        within=(1.0e-7, 0.1),
        default=1.0e-4,
    )
    jump_m: float = quantity(
        "m", "deepest change of a surface that a jump may make", within=(1.0e-9, 0.1), default=1.0e-5
    )
    cycles: int = count_field("gait cycles simulated and averaged before each jump", 2, 6)
    runs: int = count_field("lives with different initial conditions", 2, 4)


def life_point(label: str, run: Settings, ensemble: Ensemble, life: Life) -> Point:
    """Point of a life for given run settings."""
    settings = run | attrs.asdict(life)
    settings |= {"perturb_fraction": ensemble.perturb_fraction, "seed": ensemble.seed}
    cycles = _LIKELY_JUMPS * life.opens_m / life.jump_m * (life.cycles + 1)
    return Point(label=label, task="life", settings=settings, cost=life.runs * cycles * cycle_cost(run))


@attrs.frozen(kw_only=True)
class Wear(Location):
    """Where bushings and journals wear, fresh and after wear has fed back over a life."""

    title = "Wear zones"
    question = "Where do bushing and journal of each joint wear, and how does the wear develop over a life?"

    life: Life = described("how far wear is followed", factory=Life)

    def points(self) -> list[Point]:
        """The response of every set, and its life."""
        return super().points() + [
            life_point(set_name(names), self.run_of(names), self.ensemble, self.life) for names in self.sets
        ]


# Study ``load``: a leg in the air, and under the force of the ground on its foot.


@attrs.frozen(kw_only=True)
class Load(OneSet):
    """The same leg under forces of the ground of several sizes, in the stance of a person."""

    title = "Load of the ground"
    question = (
        "What does the force of the ground on the foot change in the forces of the joints, in where and in "
        "which order they wear, in how long they last, and in the disorder of the motion?"
    )

    loads_n: tuple[float, ...] = quantity(
        "N",
        "largest vertical forces of the ground on the toe in stance, one per point; 0 in the air",
        within=(0.0, 10_000.0),
        check=check_rising,
    )
    life: Life = described("how far wear is followed", factory=Life)
    exponent: Exponent = described("how the Lyapunov exponent is measured", factory=Exponent)

    def points(self) -> list[Point]:
        """Response, life and Lyapunov exponent under each load."""
        points = []
        for load_n in self.loads_n:
            run = self.run_of(self.joints, ground_n=load_n)
            label = f"{load_n:g} N"
            points += [
                response(label, run, self.ensemble),
                life_point(label, run, self.ensemble, self.life),
                exponent_point(label, run, self.ensemble, self.exponent),
            ]
        return points


STUDIES: dict[str, type[Study]] = {
    "size": Size,
    "speed": Speed,
    "location": Location,
    "wear": Wear,
    "multi": Multi,
    "chaos": Chaos,
    "laws": Laws,
    "load": Load,
    "legs": Legs,
}
"""By name; each has a file in config/studies/."""
