"""Statistics of an ensemble: means with their spread, and comparisons between sets of joints."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.wear.surfaces import BUSHING, wear_zone

RANGES = {  # largest errors, and the ideal curve whose range they are compared with
    "toe_position_m": "ideal_toe_position_m",
    "toe_velocity_mps": "ideal_toe_velocity_mps",
    "toe_acceleration_mps2": "ideal_toe_acceleration_mps2",
    "drive_torque_nm": "ideal_drive_torque_nm",
}


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
    """Spread of the largest error per cycle, over the cycles of all runs; `name` is a key of `RANGES`."""
    return spread(arrays[f"error_{name}"])


def fraction_of_range(arrays: Arrays, name: str) -> float:
    """Mean largest error per cycle divided by the range of the ideal curve (larger one of x and y)."""
    ideal = arrays[RANGES[name]]
    return largest_error(arrays, name).mean / float(np.ptp(ideal, axis=0).max())


def clearance_joints_of(arrays: Arrays) -> list[str]:
    """Names of the clearance joints."""
    return [str(name) for name in arrays["clearance_joints"]]


def peak_force(arrays: Arrays, joint: str) -> Spread:
    """Spread of the largest force of a joint per cycle, over the cycles of all runs."""
    return spread(arrays["peak_force_n"][..., [str(name) for name in arrays["joints"]].index(joint)])


def joint_force(arrays: Arrays, name: str, joint: str) -> Spread:
    """``mean_force_n``, ``rms_force_n`` or ``p99_force_n`` of a joint, over runs."""
    return spread(arrays[name][:, [str(other) for other in arrays["joints"]].index(joint)])


def of_clearance_joints(arrays: Arrays, name: str, joint: str) -> Spread:
    """Spread of an array for one clearance joint (index of the last axis), over all other axes."""
    return spread(arrays[name][..., clearance_joints_of(arrays).index(joint)])


def depth_per_cycle(arrays: Arrays, joint: str) -> Spread:
    """Spread of the greatest bushing wear depth per cycle [m], over runs."""
    return spread(
        arrays["wear_depth_m_per_cycle"][:, clearance_joints_of(arrays).index(joint), BUSHING].max(axis=1)
    )


def mean_profile(arrays: Arrays, joint: str) -> Floats:
    """Mean wear depth per cycle (N,) [m] of a joint's bushing."""
    return np.asarray(
        arrays["wear_depth_m_per_cycle"][:, clearance_joints_of(arrays).index(joint), BUSHING].mean(axis=0)
    )


def worst_zone(arrays: Arrays, joint: str, fraction: float = 0.9) -> tuple[float, float] | None:
    """Narrowest zone [deg] that contains a fraction of the bushing's mean wear; None without wear."""
    return wear_zone(mean_profile(arrays, joint), fraction)


def power_law(values: ArrayLike, errors: ArrayLike) -> tuple[float, float]:
    """Exponent p of errors ~ values^p by least squares of the logarithms, and its standard error."""
    x, y = np.log(np.asarray(values, dtype=float)), np.log(np.asarray(errors, dtype=float))
    if len(x) < 4:
        return float(np.polyfit(x, y, 1)[0]), math.nan
    slope, covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope[0]), float(np.sqrt(covariance[0, 0]))
