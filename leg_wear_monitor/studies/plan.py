"""Plan of a study: settings that studies share, points, keys of results, statistics."""

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration import FieldError, described, quantity
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.wear import BUSHING, wear_zone

# Settings that several studies share, and their validation.


Names = tuple[str, ...]
MOST = 1_000_000


def check_rising(values: tuple[float, ...]) -> str | None:
    """Error text if values do not increase."""
    if values and all(a < b for a, b in pairwise(values)):
        return None
    return f"{list(values)} does not rise from value to value"


def check_joints(names: Names) -> str | None:
    """Error text for an invalid list of joints."""
    if names and len(set(names)) == len(names):
        return None
    return f"{list(names)} is not a list of at least one joint, each once"


def check_sets(sets: tuple[Names, ...]) -> str | None:
    """Error text for an invalid list of lists of joints."""
    if not sets:
        return "is empty, expected at least one list of joints"
    return next((fault for fault in map(check_joints, sets) if fault), None)


def some_of(known: Names) -> Callable[[Names], str | None]:
    """Validator that accepts only known names."""

    def check(names: Names) -> str | None:
        strange = [name for name in names if name not in known]
        return f"{strange[0]!r} is not one of {', '.join(known)}" if strange else check_joints(names)

    return check


def count_field(doc: str, least: int, default: int) -> Any:
    """An integer."""
    return quantity("", doc, at_least=least, at_most=MOST, default=default)


def clearance_field() -> Any:
    """The clearance of all clearance joints."""
    return quantity(
        "m", "radial clearance of the clearance joints", at_least=1.0e-6, at_most=0.1, default=3.0e-4
    )


def clearances_field() -> Any:
    """Clearances, one per point."""
    return quantity(
        "m", "radial clearances of the clearance joints", at_least=1.0e-6, at_most=0.1, check=check_rising
    )


_DIRECTION = "in the direction of the mechanism's drive"


def speed_field() -> Any:
    """The crank's speed."""
    what = f"speed of the crank, {_DIRECTION}"
    return quantity("rpm", what, at_least=0.1, at_most=10_000.0, default=60.0)


def speeds_field() -> Any:
    """Speeds, one per point."""
    what = f"speeds of the crank, {_DIRECTION}"
    return quantity("rpm", what, at_least=0.1, at_most=10_000.0, check=check_rising)


def clearance_joints_field() -> Any:
    """Clearance joints by name."""
    return described("joints with clearance", check=check_joints)


# One point of a study: its task, its settings, and the key under which its result is stored.


Arrays = dict[str, np.ndarray[Any, Any]]
Settings = dict[str, Any]

# sources that a result depends on; from `studies`, only the tasks
_ROOMS = ("configuration", "mechanism", "contact", "dynamics", "life")
_FILES = ("wear.py", "studies/leg_tasks.py", "studies/life_tasks.py", "twin/reference.py")


@attrs.frozen(kw_only=True)
class Point:
    """One point of a study.

    Attributes
    ----------
    label : str
        Name of the point in figures and tables; the result does not depend on it.
    task : str
        Computation, a key of `leg_wear_monitor.studies.leg_tasks.TASKS`.
    settings : dict
        Plain values, including the seed.
    cost : float
        Approximate cost, in cycles of one clearance joint.
    """

    label: str
    task: str
    settings: dict[str, Any]
    cost: float = 1.0

    @property
    def clearance_joints(self) -> list[str]:
        """Clearance joints of its runs."""
        return list(self.settings["clearance_joints"])

    @property
    def clearance_m(self) -> float:
        """Radial clearance of these joints [m]."""
        return float(self.settings["clearance_m"])

    @property
    def speed_rpm(self) -> float:
        """Speed of the crank [rpm]."""
        return float(self.settings["speed_rpm"])

    def key(self, mechanism: Mechanism) -> str:
        """Digest of everything the result depends on: task, settings, mechanism and code."""
        plain = json.dumps([self.task, self.settings], sort_keys=True, allow_nan=False)
        leg = repr(attrs.evolve(mechanism, source=""))
        return hashlib.sha256("\n".join((plain, leg, code_digest())).encode()).hexdigest()[:20]


Found = Sequence[tuple[Point, Arrays]]
"""Points with their results."""


@cache
def code_digest() -> str:
    """Digest of the sources that produce results: the physics, and the tasks of studies."""
    home = Path(__file__).parents[1]
    sources = [source for room in _ROOMS for source in (home / room).rglob("*.py")]
    sources += [home / name for name in _FILES]
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(f"{source.relative_to(home).as_posix()}\n".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


# Base classes of studies: question, settings, points.


@attrs.frozen(kw_only=True)
class Ensemble:
    """The runs behind each number: motion with clearance is chaotic, so one run says little."""

    runs: int = count_field("runs with different initial conditions", 2, 12)
    cycles: int = count_field("gait cycles counted in each run", 2, 20)
    skip_cycles: int = count_field("gait cycles before them", 0, 3)
    traced_cycles: int = count_field("counted cycles of each run whose curves are kept", 1, 5)
    perturb_fraction: float = quantity(
        "",
        "journals start up to this fraction of the clearance from the centre",
        at_least=0.0,
        at_most=1.0,
        default=0.3,
    )
    seed: int = count_field("seed of the initial conditions", 0, 1)

    def __attrs_post_init__(self) -> None:
        if self.traced_cycles > self.cycles:
            raise FieldError(
                "traced_cycles", f"{self.traced_cycles} is more than the {self.cycles} cycles counted"
            )


@attrs.frozen
class Sweep:
    """A study over one quantity; its page draws every statistic over it.

    Attributes
    ----------
    quantity : str
        Name of the quantity in sentences and tables.
    axis : str
        Label of the axis, with unit.
    value : callable
        Value of a point on that axis.
    """

    quantity: str
    axis: str
    value: Callable[[Point], float]


@attrs.frozen(kw_only=True)
class Study:
    """Settings of a study; its subclasses are the studies, in `studies.kinds`.

    Attributes
    ----------
    title, question : str
        Head of its page.
    sweep : Sweep or None
        For a study over one quantity: its page follows from it. Another study has a page of its own in
        `report.study.page`.
    """

    title: ClassVar[str]
    question: ClassVar[str]
    sweep: ClassVar[Sweep | None] = None

    mechanism: str = described("a mechanism that comes with the package, or a file", default="bionic_leg")
    ensemble: Ensemble = described("the runs of each point", factory=Ensemble)

    def check(self) -> None:
        """Check what the study needs beside valid settings.

        Raises
        ------
        ConfigError
            If something is missing.
        """

    def points(self) -> list[Point]:
        """Points to compute, in display order; duplicates are allowed."""
        raise NotImplementedError


# Points of studies: settings of the runs, and their estimated cost.


_EACH_JOINT = 0.7  # cost of each further clearance joint, relative to the first
_MOMENTS = 20.0  # cost of observing a cycle, relative to a cycle of one clearance joint


def set_name(clearance_joints: Sequence[str]) -> str:
    """Name of a set of clearance joints."""
    return ", ".join(clearance_joints)


def millimetres(clearance_m: float) -> str:
    """A clearance as text."""
    return f"{1.0e3 * clearance_m:g} mm"


def place(clearance_joints: Sequence[str], clearance_m: float, speed_rpm: float, **more: Any) -> Settings:
    """Settings of a run: clearance joints, clearance and speed."""
    return {
        "clearance_joints": list(clearance_joints),
        "clearance_m": clearance_m,
        "speed_rpm": speed_rpm,
        **more,
    }


def cycle_cost(where: Settings) -> float:
    """Cost of a gait cycle with given settings, relative to one clearance joint at 60 rpm."""
    joints = len(where["clearance_joints"])
    return (1.0 + _EACH_JOINT * (joints - 1)) * math.sqrt(60.0 / where["speed_rpm"])


def response(label: str, where: Settings, ensemble: Ensemble) -> Point:
    """Response point for given run settings."""
    cycles = ensemble.cycles + ensemble.skip_cycles
    each = cycles * cycle_cost(where) + _MOMENTS * ensemble.traced_cycles
    settings = where | attrs.asdict(ensemble)
    return Point(label=label, task="response", settings=settings, cost=ensemble.runs * each)


@attrs.frozen(kw_only=True)
class OneClearance(Study):
    """Base of studies with one clearance and one speed."""

    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()

    def at(self, joints: Names, **more: Any) -> Settings:
        """Settings of a run with these clearance joints."""
        return place(joints, self.clearance_m, self.speed_rpm, **more)


@attrs.frozen(kw_only=True)
class OnePlace(OneClearance):
    """Base of studies with one set of clearance joints, one clearance and one speed."""

    joints: Names = clearance_joints_field()

    def place(self, **more: Any) -> Settings:
        """Settings of a run there."""
        return self.at(self.joints, **more)

    def response(self, label: str, **more: Any) -> Point:
        """Response point there."""
        return response(label, self.place(**more), self.ensemble)


# Statistics of an ensemble: means with their spread, and comparisons between sets of joints.


ERRORS = ("toe_position_m", "toe_velocity_mps", "toe_acceleration_mps2", "drive_torque_nm")
"""What is compared with the ideal leg: ``error_<name>``, ``ideal_<name>`` and so on."""
TITLES = ("toe displacement", "toe velocity", "toe acceleration", "drive torque")
"""What readers call them."""
DEPTH, VOLUME = "wear_depth_m_per_cycle", "archard_integral_j_per_cycle"
_OF_ALL_JOINTS = ("peak_force_n", "mean_force_n", "rms_force_n", "p99_force_n")


@attrs.frozen
class Estimate:
    """A value and its standard error, such as a mean over runs, or the measure of a claim.

    Attributes
    ----------
    value : float
    error : float
        Its standard error, from the scatter over runs.
    """

    value: float
    error: float

    @property
    def score(self) -> float:
        """The value in standard errors."""
        if self.error > 0.0:
            return self.value / self.error
        return float(np.copysign(np.inf, self.value)) if self.value else 0.0


class Spread(NamedTuple):
    """Mean and standard deviation of an ensemble, and its 10th and 90th percentile."""

    mean: float
    deviation: float
    low: float
    high: float


def spread(values: ArrayLike) -> Spread:
    """Spread over all values."""
    array = np.asarray(values, dtype=float)
    low, high = np.quantile(array, (0.1, 0.9))
    return Spread(float(array.mean()), float(array.std()), float(low), float(high))


def largest_error(arrays: Arrays, name: str) -> Spread:
    """Spread of the largest error per cycle, over the cycles of all runs; `name` is one of `ERRORS`."""
    return spread(arrays[f"error_{name}"])


def fraction_of_range(arrays: Arrays, name: str) -> float:
    """Mean largest error per cycle divided by the range of the ideal curve (larger one of x and y)."""
    return largest_error(arrays, name).mean / float(np.ptp(arrays[f"ideal_{name}"], axis=0).max())


def clearance_joints_of(arrays: Arrays) -> list[str]:
    """Names of the clearance joints."""
    return [str(name) for name in arrays["clearance_joints"]]


def of_joint(arrays: Arrays, name: str, joint: str) -> Spread:
    """Spread of a statistic of a joint over runs, and over their cycles if each of these has one.

    Forces are known of all joints, other statistics of the clearance joints; of a wear depth, the greatest of
    the bushing counts.
    """
    if name in _OF_ALL_JOINTS:
        return spread(arrays[name][..., [str(other) for other in arrays["joints"]].index(joint)])
    k = clearance_joints_of(arrays).index(joint)
    return spread(arrays[name][:, k, BUSHING].max(axis=1) if name == DEPTH else arrays[name][..., k])


def worst_zone(arrays: Arrays, joint: str, fraction: float = 0.9) -> tuple[float, float] | None:
    """Narrowest zone [deg] that contains a fraction of the bushing's mean wear; None without wear."""
    profiles = arrays[DEPTH][:, clearance_joints_of(arrays).index(joint), BUSHING]
    return wear_zone(np.asarray(profiles.mean(axis=0)), fraction)


def power_law(values: ArrayLike, errors: ArrayLike) -> tuple[float, float]:
    """Exponent p of errors ~ values^p by least squares of the logarithms, and its standard error."""
    x, y = np.log(np.asarray(values, dtype=float)), np.log(np.asarray(errors, dtype=float))
    if len(x) < 4:
        return float(np.polyfit(x, y, 1)[0]), math.nan
    slope, covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope[0]), float(np.sqrt(covariance[0, 0]))
