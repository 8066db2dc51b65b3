"""Statistics of a study's points, and its tables."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.study import VARIED, Point
from leg_wear_monitor.studies.tasks import ERRORS, Arrays
from leg_wear_monitor.wear import BUSHING, wear_zone

Found = Sequence[tuple[Point, Arrays]]
"""Points of a study, each with its result."""

TITLES = ("toe displacement", "toe velocity", "toe acceleration", "drive torque")
"""The quantities in `ERRORS` in words."""
# wear depth, and normal force times sliding distance: by Archard's law the worn volume is proportional to it
DEPTH, ARCHARD = "wear_depth_m_per_cycle", "archard_integral_j_per_cycle"
FORGET = 3  # skipped first cycles of an exponent: neighbours turn into the fastest growing direction
# other statistics exist for clearance joints only
_OF_ALL_JOINTS = ("peak_force_n", "mean_force_n", "rms_force_n", "p99_force_n")


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

    For a quantity of the toe, it is the range of x or y, whichever is larger.
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


def exponent(logs: Floats, step_time: float, skip: int = 0) -> Estimate:
    """Lyapunov exponent from the growth factors of independent runs, with its standard error.

    We take the larger standard error of runs and steps, because few runs may agree by chance.

    Parameters
    ----------
    logs : (runs, steps) array
        Logarithmic growth factors [-].
    step_time : float
        Duration of a step, in the unit of time of the exponent.
    skip : int
        Number of first steps to leave out, in which the separation turns into the fastest growing direction.

    Returns
    -------
    Estimate
    """
    rates = logs[:, skip:] / step_time
    each = rates.mean(axis=1)
    errors = each.std(ddof=1) / np.sqrt(len(each)), rates.std(ddof=1) / np.sqrt(rates.size)
    return Estimate(float(each.mean()), float(max(errors)))


# Responses of a study's points as columns of tables; mean and deviation of a statistic after a dot.


Columns = dict[str, list[Any]]

_OF_JOINTS = (
    "peak_force_n",
    "mean_force_n",
    "rms_force_n",
    "p99_force_n",
    "impacts",
    "impact_speed_mps",
    "contact_fraction",
    "friction_work_j_per_cycle",
    ARCHARD,
    DEPTH,
)


def point_columns(found: Found) -> Columns:
    """One row per point: largest errors of toe and drive in a cycle against the ideal leg, and the torque.

    None for the errors of a toe that the leg does not have.
    """
    columns = _settings([point for point, _ in found])
    for name in ERRORS:
        errors = [largest_error(arrays, name) if f"ideal_{name}" in arrays else None for _, arrays in found]
        columns |= _means(name, errors)
    return columns | _means("rms_torque_nm", [spread(arrays["rms_torque_nm"]) for _, arrays in found])


def joint_columns(found: Found) -> Columns:
    """One row per point and clearance joint: forces, impacts, contact, and wear of the bushing."""
    rows = [(point, arrays, joint) for point, arrays in found for joint in clearance_joints_of(arrays)]
    columns = _settings([point for point, *_ in rows]) | {"joint": [joint for *_, joint in rows]}
    for name in _OF_JOINTS:
        columns |= _means(name, [of_joint(arrays, name, joint) for _, arrays, joint in rows])
    return columns


def exponent_columns(found: Found) -> Columns:
    """One row per point: the largest Lyapunov exponent per gait cycle, and its standard error."""
    estimates = [exponent(arrays["stretch_per_cycle"], 1.0, FORGET) for _, arrays in found]
    return _settings([point for point, _ in found]) | {
        "exponent_per_cycle": [estimate.value for estimate in estimates],
        "error_per_cycle": [estimate.error for estimate in estimates],
    }


def section_columns(found: Found) -> Columns:
    """One row per point, clearance joint and gait cycle: the journal at one crank angle."""
    rows = [
        (point, joint, arrays["section_eccentricity_m"][cycle, k], arrays["section_rate_mps"][cycle, k])
        for point, arrays in found
        for k, joint in enumerate(clearance_joints_of(arrays))
        for cycle in range(len(arrays["section_rate_mps"]))
    ]
    columns = _settings([point for point, *_ in rows]) | {"joint": [joint for _, joint, *_ in rows]}
    for i, axis in enumerate("xy"):
        columns[f"eccentricity_m.{axis}"] = [float(place[i]) for *_, place, _ in rows]
        columns[f"rate_mps.{axis}"] = [float(rate[i]) for *_, rate in rows]
    return columns


TABLES: dict[str, tuple[str, Callable[[Found], Columns]]] = {
    "points": ("response", point_columns),
    "joints": ("response", joint_columns),
    "exponents": ("exponent", exponent_columns),
    "sections": ("section", section_columns),
    "portraits": ("portrait", section_columns),
}
"""Tables of a study: the task whose points they have, and their columns."""


def _settings(points: Sequence[Point]) -> Columns:
    """Label and settings of each row's point; None if a point keeps the value of the mechanism file."""
    return {
        "point": [point.label for point in points],
        "clearances": [", ".join(point.settings["clearances"]) for point in points],
        **{name: [point.settings.get(name) for point in points] for name in VARIED if name != "clearances"},
    }


def _means(name: str, values: Sequence[Spread | None]) -> Columns:
    return {
        f"{name}.mean": [None if value is None else value.mean for value in values],
        f"{name}.deviation": [None if value is None else value.deviation for value in values],
    }
