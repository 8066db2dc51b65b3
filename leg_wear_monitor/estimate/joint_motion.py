"""The smoothed motion of a joint, and a drive torque with that motion at the times of its samples.

A joint is a candidate for the crank: an encoder that a gear may separate from it.
"""

import math

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN

# Values over time: positions of a joint, torques.


@attrs.frozen(eq=False)
class Series:
    """Values over time, in order of their stamps.

    Attributes
    ----------
    time_s : (n,) array
        Since the first stamp of all recordings [s].
    value : (n,) array
        Positions [rad], or torques in the unit of their sensor.
    """

    time_s: Floats
    value: Floats


def series(stamp_ns: NDArray[np.int64], value: Floats, first_ns: int) -> Series:
    """Series of the finite values, in order of their stamps; of values with equal stamps, the first.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps [ns], in any order.
    value : (n,) array
    first_ns : int
        Stamp of time 0 [ns].
    """
    finite = np.isfinite(value)
    stamp_ns, value = stamp_ns[finite], value[finite]
    stamps, chosen = np.unique(stamp_ns, return_index=True)
    return Series(np.asarray(1.0e-9 * (stamps - first_ns), np.float64), value[chosen])


# Motion of a joint that turns on and on: position, speed and acceleration, and noise of its encoder.


_WINDOW_S = 0.12  # local fit: a twelfth of a turn at 40 rpm, which keeps a ripple of two periods per turn
_LEAST_WINDOW = 7  # samples: three more than a cubic has coefficients
_GAP_SAMPLES = 4.0  # a longer gap between samples, in sampling intervals, is not bridged
_LEAST_TURNS = 3.0  # least travel of an angle in a wrong unit
_LEAST_TRAVEL_RAD = 1.0  # a joint that moves by less in all does not turn
# Least range of the positions as a fraction of the path: 1 for a crank that turns one way, 1/2 for one that
# walks forwards and then as far back, 1/(2 n) for a joint that swings to and fro in each of n gait cycles.
_ROCKING = 0.2
_NO_VARIANCE = 1.0e-12  # (rad/s^2)^2, so that nothing is divided by 0 if there is no acceleration


@attrs.frozen(eq=False)
class JointMotion:
    """Smoothed motion of a joint.

    Attributes
    ----------
    time_s, position_rad, speed_radps, acceleration_radps2 : (n,) arrays
        Smoothed; the position counts on over turns.
    near : (n,) array of bool
        True if the time is not in a gap between samples.
    is_wrapped : bool
        True if the encoder's readings are wrapped to a turn.
    """

    time_s: Floats
    position_rad: Floats
    speed_radps: Floats
    acceleration_radps2: Floats
    near: NDArray[np.bool_]
    is_wrapped: bool


def why_not_a_crank(joint: Series) -> str:
    """Why a joint cannot be the crank: it stands, or swings to and fro; empty if it turns on and on."""
    if len(joint.value) < 4 * _LEAST_WINDOW:
        return f"has only {len(joint.value)} samples"
    position = _unwrapped(joint)
    for turn, unit in ((1.0, "turns"), (360.0, "degrees")):
        travel = np.ptp(np.unwrap(joint.value, period=turn))
        if np.ptp(joint.value) < 1.1 * turn and travel > _LEAST_TURNS * turn:  # tolerance for noise
            return f"seems to be in {unit}, wrapped to a turn. Publish radians"
    reach = float(np.ptp(position))
    if reach < _LEAST_TRAVEL_RAD:
        return f"moves by {reach:.2g} rad in all"
    coarse = position[:: max(1, len(position) // 2000)]  # smoothed, because noise would lengthen the path
    path = float(np.abs(np.diff(coarse)).sum())
    if reach < _ROCKING * path:
        return f"swings to and fro within {reach:.2g} rad"
    return ""


def is_wrapped(value: Floats) -> bool:
    """True if readings (n,) [rad] jump by about a turn and stay within one turn, apart from noise."""
    jumps = np.abs(np.diff(value)) > math.pi
    return bool(jumps.any() and np.ptp(value) <= 1.05 * TURN)


def _unwrapped(joint: Series) -> Floats:
    """Positions (n,) [rad] that count on over turns."""
    value = joint.value.astype(float)
    return np.asarray(np.unwrap(value)) if is_wrapped(value) else value


def motion_of(joint: Series) -> JointMotion:
    """Smoothed motion of a joint for which `why_not_a_crank` is empty, by a cubic around each time."""
    # positions at even steps of time
    time_s, value = joint.time_s, _unwrapped(joint)
    step = float(np.median(np.diff(time_s)))
    half = max(_LEAST_WINDOW, round(_WINDOW_S / step)) // 2
    grid = np.arange(time_s[0], time_s[-1], step)
    even, inner = np.interp(grid, time_s, value), slice(half, len(grid) - half)
    # a cubic by least squares over each window, whose coefficients are sums of the positions with weights
    offsets = step * np.arange(-half, half + 1)
    weights = np.linalg.pinv(np.vander(offsets, 4, increasing=True))
    position, speed, half_acceleration = (np.convolve(even, row[::-1], mode="valid") for row in weights[:3])
    acceleration = 2.0 * half_acceleration
    # noise by the median residual, which is 0.6745 standard deviations of a normal distribution; the fit
    # follows the noise of its middle sample in part, so that residuals are smaller than the noise
    residual = value - np.interp(time_s, grid[inner], position, left=np.nan, right=np.nan)
    noise = float(np.nanmedian(np.abs(residual)) / 0.6745 / math.sqrt(1.0 - weights[0, half]))
    # The acceleration is reduced to the fraction of its variance that is not noise of the encoder, because
    # the fit of the torque would take that noise for the inertia of the leg.
    error = 2.0 * noise * float(np.linalg.norm(weights[2]))
    acceleration *= max(0.0, 1.0 - error**2 / max(float(acceleration.var()), error**2, _NO_VARIANCE))
    # gaps: the distance of the samples before and after each time
    after = np.searchsorted(time_s, grid[inner]).clip(1, len(time_s) - 1)
    near = time_s[after] - time_s[after - 1] <= _GAP_SAMPLES * step
    return JointMotion(grid[inner], position, speed, acceleration, near, is_wrapped(joint.value))


# A torque and the motion of a joint at the torque's times, while the joint turns.


_MOVING = 0.2  # below this fraction of the median speed, the leg stands or starts
_SLOW_S = 1.0  # averaging time for a speed without its ripple
_STEADY = 0.08  # relative difference up to which two speeds count as the same


@attrs.frozen(eq=False)
class Pair:
    """Samples of a torque, paired with the motion of a joint at their times.

    Attributes
    ----------
    time_s, torque, position_rad, speed_radps, acceleration_radps2 : (n,) arrays
        The torque is in the unit of its sensor; the motion is the joint's, before any gear to the crank.
    interval_s : float
        Sampling interval of the torque [s].
    """

    time_s: Floats
    torque: Floats
    position_rad: Floats
    speed_radps: Floats
    acceleration_radps2: Floats
    interval_s: float

    def part(self, which: NDArray[np.bool_] | slice) -> "Pair":
        """Pair of a subset of the samples."""
        columns = {name: getattr(self, name)[which] for name in _COLUMNS}
        return attrs.evolve(self, **columns)


_COLUMNS = ("time_s", "torque", "position_rad", "speed_radps", "acceleration_radps2")


def paired(motion: JointMotion, torque: Series, late_s: float = 0.0) -> Pair:
    """Torque samples at which the joint turns; none if the two have no time in common.

    A torque that is late by a time [s] belongs to the motion before.
    """
    time_s, times = motion.time_s, torque.time_s - late_s
    # Keep the torque samples that lie within the motion and outside its gaps.
    inside = (times >= time_s[0]) & (times <= time_s[-1])
    inside[inside] = np.interp(times[inside], time_s, motion.near.astype(float)) > 0.5
    at, values = times[inside], (motion.position_rad, motion.speed_radps, motion.acceleration_radps2)
    columns = (at, torque.value[inside], *(np.interp(at, time_s, value) for value in values))
    interval_s = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    pair = Pair(**dict(zip(_COLUMNS, columns, strict=True)), interval_s=interval_s)
    speed = np.abs(pair.speed_radps)
    return pair.part(speed > _MOVING * np.median(speed)) if len(speed) else pair


def slow_speed(pair: Pair) -> Floats:
    """Speed of the joint (n,) [rad/s] without its ripple: the mean over a second around each sample.

    The mean spans at most a quarter of all samples, and fewer at both ends.
    """
    samples = max(1, min(len(pair.time_s) // 4, round(_SLOW_S / max(pair.interval_s, 1.0e-6))))
    total = np.concatenate([[0.0], np.cumsum(pair.speed_radps)])
    after = np.minimum(np.arange(len(pair.time_s)) + samples // 2 + 1, len(pair.time_s))
    before = np.maximum(np.arange(len(pair.time_s)) - samples // 2, 0)
    return np.asarray((total[after] - total[before]) / (after - before))


def steady_stretch(pair: Pair) -> Pair:
    """Longest stretch of samples at about one speed, in one direction."""
    speed = slow_speed(pair)
    # each speed that occurs is tried as the one
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    best = slice(0, 0)
    for centre in centres:
        steady = np.abs(speed - centre) <= _STEADY * abs(centre)
        # samples that belong together with the next sample; a stretch is a run of them
        linked = steady[1:] & steady[:-1]
        edges = np.flatnonzero(np.diff(np.concatenate([[False], linked, [False]]).astype(int)))
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if last - first > best.stop - best.start:
                best = slice(first, last + 1)
    return pair.part(best)
