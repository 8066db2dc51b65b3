"""Plan of a study: settings that studies share, points, keys of results, statistics.

A study answers a question by simulations of the leg. Each of its points is one computation with settings of
its own, such as one crank speed; most are the response of the leg, an ensemble of runs that differ in their
start only. `kinds` has the studies, `leg_tasks` and `life_tasks` the computations, `execution` runs them.
"""

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration import FieldError, described, quantity
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.wear import BUSHING, wear_zone
from leg_wear_monitor.workers import package_digest

# Settings that several studies share, and their validation.


Names = tuple[str, ...]  # of joints, or of laws
_MOST = 1_000_000  # of anything that is counted


def check_rising(values: tuple[float, ...]) -> str | None:
    """Error text if values do not increase strictly, or if there is none; None if they are valid."""
    if values and all(a < b for a, b in pairwise(values)):
        return None
    return f"{list(values)} does not rise from value to value"


def check_joints(names: Names) -> str | None:
    """Error text if a list of joints is empty or has one twice; None if it is valid."""
    if names and len(set(names)) == len(names):
        return None
    return f"{list(names)} is not a list of at least one joint, each once"


def check_sets(sets: tuple[Names, ...]) -> str | None:
    """Error text if a list of lists of joints is empty, or a list in it is invalid; None if it is valid."""
    if not sets:
        return "is empty, expected at least one list of joints"
    return next((fault for fault in map(check_joints, sets) if fault), None)


def some_of(known: Names) -> Callable[[Names], str | None]:
    """Check of a setting like `check_joints`, which also refuses names that are not known."""

    def check(names: Names) -> str | None:
        strange = [name for name in names if name not in known]
        return f"{strange[0]!r} is not one of {', '.join(known)}" if strange else check_joints(names)

    return check


def count_field(doc: str, least: int, default: int) -> Any:
    """A setting that counts something; ``doc`` says what, for a user."""
    return quantity("", doc, within=(least, _MOST), default=default)


def clearance_field() -> Any:
    """The setting of a study in which all clearance joints have the same clearance."""
    return quantity("m", "radial clearance of the clearance joints", within=(1.0e-6, 0.1), default=3.0e-4)


def clearances_field() -> Any:
    """The setting of a study over the clearance: one for each point, of all clearance joints."""
    return quantity(
        "m", "radial clearances of the clearance joints", within=(1.0e-6, 0.1), check=check_rising
    )


_DIRECTION = "in the direction of the mechanism's drive"


def speed_field() -> Any:
    """The setting of a study at one crank speed."""
    what = f"speed of the crank, {_DIRECTION}"
    return quantity("rpm", what, within=(0.1, 10_000.0), default=60.0)


def speeds_field() -> Any:
    """The setting of a study over the crank speed: one for each point."""
    what = f"speeds of the crank, {_DIRECTION}"
    return quantity("rpm", what, within=(0.1, 10_000.0), check=check_rising)


def clearance_joints_field() -> Any:
    """The setting of a study with one set of clearance joints."""
    return described("joints with clearance", check=check_joints)


# One point of a study: its task, its settings, and the key under which its result is stored.


# result of a point; `leg_tasks.run_ensemble` lists the arrays of a response, with their shapes
Arrays = dict[str, np.ndarray[Any, Any]]
# settings of a point as JSON has them: numbers, texts, lists and dictionaries
Settings = dict[str, Any]

# sources that a result depends on: folders, and files; from `studies`, only the tasks
_FOLDERS = ("configuration", "mechanism", "contact", "dynamics", "life")
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
        All that the computation depends on besides mechanism and code, including the seed.
    cost : float
        Approximate computing time, as a multiple of that of one gait cycle with one clearance joint at
        60 rpm. The costliest points are computed first, and the progress is measured by it.
    """

    label: str
    task: str
    settings: Settings
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
        leg = repr(attrs.evolve(mechanism, source=""))  # the same leg from another file has the same key
        return hashlib.sha256("\n".join((plain, leg, code_digest())).encode()).hexdigest()[:20]


Found = Sequence[tuple[Point, Arrays]]
"""Points of a study, each with its result."""


def code_digest() -> str:
    """Digest of the sources that produce results: the physics, and the tasks of studies."""
    return package_digest(*_FOLDERS, *_FILES)


# Base classes of studies: question, settings, points.


@attrs.frozen(kw_only=True)
class Ensemble:
    """The runs whose statistics a point gives: motion with clearance is chaotic, so one run says little."""

    runs: int = count_field("runs with different initial conditions", 2, 12)
    cycles: int = count_field("gait cycles counted in each run", 2, 20)
    skip_cycles: int = count_field("gait cycles before them", 0, 3)
    traced_cycles: int = count_field("counted cycles of each run whose curves are kept", 1, 5)
    perturb_fraction: float = quantity(
        "",
        "journals start up to this fraction of the clearance from the centre",
        within=(0.0, 1.0),
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
        """Check what the study needs beside valid settings, such as an optional library.

        Raises
        ------
        ConfigError
            If something is missing.
        """

    def points(self) -> list[Point]:
        """Points to compute, in display order; those with equal keys are computed once."""
        raise NotImplementedError


# Points of studies: settings of the runs, and their estimated cost in the unit of `Point.cost`.


_FURTHER_JOINT = 0.7  # of each clearance joint after the first
_TRACED_CYCLE = 20.0  # of recording the curves of a cycle


def set_name(clearance_joints: Sequence[str]) -> str:
    """Label of a point by its clearance joints, such as ``A, B``."""
    return ", ".join(clearance_joints)


def millimetres(clearance_m: float) -> str:
    """Label of a point by its clearance, such as ``0.3 mm``."""
    return f"{1.0e3 * clearance_m:g} mm"


def run_settings(joints: Sequence[str], clearance_m: float, speed_rpm: float, **more: Any) -> Settings:
    """Settings of the runs of a point: clearance joints, their clearance, speed of the crank, and others."""
    return {
        "clearance_joints": list(joints),
        "clearance_m": clearance_m,
        "speed_rpm": speed_rpm,
        **more,
    }


def cycle_cost(run: Settings) -> float:
    """Cost of a gait cycle with the settings of a run."""
    joints = len(run["clearance_joints"])
    return (1.0 + _FURTHER_JOINT * (joints - 1)) * math.sqrt(60.0 / run["speed_rpm"])


def response(label: str, run: Settings, ensemble: Ensemble) -> Point:
    """Point of the response to clearance, as `leg_tasks.run_ensemble` computes it."""
    cycles = ensemble.cycles + ensemble.skip_cycles
    each = cycles * cycle_cost(run) + _TRACED_CYCLE * ensemble.traced_cycles
    settings = run | attrs.asdict(ensemble)
    return Point(label=label, task="response", settings=settings, cost=ensemble.runs * each)


@attrs.frozen(kw_only=True)
class OneClearance(Study):
    """Base of studies with one clearance and one speed."""

    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()

    def run_of(self, joints: Names, **more: Any) -> Settings:
        """Settings of runs with these clearance joints, at the study's clearance and speed."""
        return run_settings(joints, self.clearance_m, self.speed_rpm, **more)


@attrs.frozen(kw_only=True)
class OneSet(OneClearance):
    """Base of studies with one set of clearance joints, one clearance and one speed."""

    joints: Names = clearance_joints_field()

    def response(self, label: str, **more: Any) -> Point:
        """Point of the response with these, and with further settings of the runs."""
        return response(label, self.run_of(self.joints, **more), self.ensemble)


# Statistics of an ensemble: means with their spread, and comparisons between sets of joints.


ERRORS = ("toe_position_m", "toe_velocity_mps", "toe_acceleration_mps2", "drive_torque_nm")
"""Quantities of a response that are compared with the ideal leg, which has no clearance. Of each, the array
``error_<name>`` has the largest deviation in each cycle, and ``ideal_<name>`` the curve of the ideal leg."""
TITLES = ("toe displacement", "toe velocity", "toe acceleration", "drive torque")
"""The same quantities in words."""
# wear depth, and normal force times sliding distance: by Archard's law the worn volume is proportional to it
DEPTH, ARCHARD = "wear_depth_m_per_cycle", "archard_integral_j_per_cycle"
_OF_ALL_JOINTS = ("peak_force_n", "mean_force_n", "rms_force_n", "p99_force_n")  # others: of clearance joints


@attrs.frozen
class Estimate:
    """A value and its standard error, such as a mean over runs, or by how much a claim of the paper holds.

    Attributes
    ----------
    value : float
    error : float
        Its standard error, from the scatter over runs; in the unit of the value.
    """

    value: float
    error: float

    @property
    def score(self) -> float:
        """The value as a multiple of its standard error, with its sign; infinite if only the error is 0."""
        if self.error > 0.0:
            return self.value / self.error
        return float(np.copysign(np.inf, self.value)) if self.value else 0.0


class Spread(NamedTuple):
    """Mean and standard deviation of all values of an ensemble, and their 10th and 90th percentile."""

    mean: float
    deviation: float
    low: float
    high: float


def spread(values: ArrayLike) -> Spread:
    """Spread of all values of an array of any shape."""
    array = np.asarray(values, dtype=float)
    low, high = np.quantile(array, (0.1, 0.9))
    return Spread(float(array.mean()), float(array.std()), float(low), float(high))


def largest_error(arrays: Arrays, name: str) -> Spread:
    """Spread of the largest deviation in each cycle, over the cycles of all runs; ``name`` as in `ERRORS`."""
    return spread(arrays[f"error_{name}"])


def fraction_of_range(arrays: Arrays, name: str) -> float:
    """Mean of the largest deviations as a fraction of the range of the ideal curve.

    Of a quantity of the toe, it is the range of x or y, the larger one.
    """
    return largest_error(arrays, name).mean / float(np.ptp(arrays[f"ideal_{name}"], axis=0).max())


def clearance_joints_of(arrays: Arrays) -> list[str]:
    """Names of the clearance joints of a response, (k,)."""
    return [str(name) for name in arrays["clearance_joints"]]


def of_joint(arrays: Arrays, name: str, joint: str) -> Spread:
    """Spread of a statistic of a joint over runs, or over all their cycles if it has a value for each cycle.

    Forces are known of all joints, other statistics of the clearance joints.
    """
    if name in _OF_ALL_JOINTS:
        return spread(arrays[name][..., [str(other) for other in arrays["joints"]].index(joint)])
    k = clearance_joints_of(arrays).index(joint)
    # wear depths are (runs, k, 2, sectors): of each run, the deepest sector of the bushing
    return spread(arrays[name][:, k, BUSHING].max(axis=1) if name == DEPTH else arrays[name][..., k])


def worst_zone(arrays: Arrays, joint: str, fraction: float) -> tuple[float, float] | None:
    """Narrowest zone of a joint's bushing that contains a fraction of its wear, averaged over runs.

    Begin and end [deg] in the bushing's frame, as `wear_zone` returns them; None without wear.
    """
    profiles = arrays[DEPTH][:, clearance_joints_of(arrays).index(joint), BUSHING]
    return wear_zone(np.asarray(profiles.mean(axis=0)), fraction)


def power_law(values: ArrayLike, effects: ArrayLike) -> tuple[float, float]:
    """Exponent p of a law effect ~ value^p by least squares of the logarithms, and its standard error.

    Parameters
    ----------
    values : (n,) array
        What is varied, such as the clearance; above 0.
    effects : (n,) array
        What follows from each, such as the largest deviation; above 0.

    Returns
    -------
    exponent, error : float
        The error is NaN for less than four points, whose scatter says too little.
    """
    x, y = np.log(np.asarray(values, dtype=float)), np.log(np.asarray(effects, dtype=float))
    if len(x) < 4:
        return float(np.polyfit(x, y, 1)[0]), math.nan
    slope, covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope[0]), float(np.sqrt(covariance[0, 0]))
