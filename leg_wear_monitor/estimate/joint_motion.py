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
    recording : (n,) array of int
        Index of the recording; the readings of an encoder may begin anew in each.
    """

    time_s: Floats
    value: Floats
    recording: NDArray[np.int64]


def series(stamp_ns: NDArray[np.int64], value: Floats, recording: NDArray[np.int64], first_ns: int) -> Series:
    """Series of the finite values, in order of their stamps; of values with equal stamps, the first.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps [ns], in any order.
    value : (n,) array
    recording : (n,) array of int
        As in `Series`.
    first_ns : int
        Stamp of time 0 [ns].
    """
    finite = np.isfinite(value)
    stamp_ns, value, recording = stamp_ns[finite], value[finite], recording[finite]
    stamps, chosen = np.unique(stamp_ns, return_index=True)
    return Series(np.asarray(1.0e-9 * (stamps - first_ns), np.float64), value[chosen], recording[chosen])


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
    recording : (n,) array of int
    near : (n,) array of bool
        True if the time is not in a gap between samples.
    is_wrapped : bool
        True if the encoder's readings are wrapped to a turn.
    noise_rad : float
        Standard deviation of the readings about the smoothed position [rad].
    rate_hz : float
        Usual sampling rate of the encoder.
    """

    time_s: Floats
    position_rad: Floats
    speed_radps: Floats
    acceleration_radps2: Floats
    recording: NDArray[np.int64]
    near: NDArray[np.bool_]
    is_wrapped: bool
    noise_rad: float
    rate_hz: float


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
    return "" if len(_long_enough(joint)) else "has no recording long enough for smoothing"


def motion_of(joint: Series) -> JointMotion:
    """Smoothed motion of a joint for which `why_not_a_crank` is empty.

    Each recording is smoothed by itself; one that is too short is left out.
    """
    parts = []  # per recording: its index, and the six results of `_smoothed`
    for index in _long_enough(joint):
        chosen = joint.recording == index
        value = _unwrapped_values(joint.value[chosen])
        parts.append((index, *_smoothed(joint.time_s[chosen], value)))
    columns = [np.concatenate([part[i] for part in parts]) for i in range(1, 6)]
    number = np.concatenate([np.full(len(part[1]), part[0]) for part in parts])
    return JointMotion(
        time_s=columns[0],
        position_rad=columns[1],
        speed_radps=columns[2],
        acceleration_radps2=columns[3],
        recording=number,
        near=columns[4],
        is_wrapped=is_wrapped(joint.value),
        noise_rad=float(np.median([part[6] for part in parts])),
        rate_hz=float(1.0 / np.median(np.diff(joint.time_s))),
    )


def _long_enough(joint: Series) -> list[int]:
    """Indices of the recordings that are longer than a window of the smoothing."""
    found = []
    for number in np.unique(joint.recording).tolist():
        time_s = joint.time_s[joint.recording == number]
        if len(time_s) >= 2 * _LEAST_WINDOW:
            step, half = _window(time_s)
            if time_s[-1] - time_s[0] > (2 * half + 1) * step:
                found.append(number)
    return found


def _window(time_s: Floats) -> tuple[float, int]:
    """Sampling interval of a recording [s], and the samples on either side of a time that smooth it."""
    step = float(np.median(np.diff(time_s)))
    return step, max(_LEAST_WINDOW, round(_WINDOW_S / step)) // 2


def is_wrapped(value: Floats) -> bool:
    """True if readings (n,) [rad] jump by about a turn and stay within one turn, apart from noise."""
    jumps = np.abs(np.diff(value)) > math.pi
    return bool(jumps.any() and np.ptp(value) <= 1.05 * TURN)


def _unwrapped_values(value: Floats) -> Floats:
    """Readings (n,) [rad] of one recording that count on over turns."""
    return np.asarray(np.unwrap(value)) if is_wrapped(value) else value


def _unwrapped(joint: Series) -> Floats:
    """Positions (n,) [rad] that count on over turns, and over recordings without a jump."""
    value = joint.value.astype(float)
    if is_wrapped(value):
        return np.asarray(np.unwrap(value))
    step = np.diff(value)
    step[np.diff(joint.recording) != 0] = 0.0
    return np.concatenate([value[:1], value[0] + np.cumsum(step)])


def _smoothed(
    time_s: Floats, value: Floats
) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.bool_], float]:
    """Smooth the positions of one recording by a cubic that is fitted around each time.

    Parameters
    ----------
    time_s, value : (n,) arrays
        Times [s] and positions [rad] that count on over turns.

    Returns
    -------
    time_s, position, speed, acceleration : (m,) arrays
        At even steps, half a window inside the first and the last sample [s, rad, rad/s, rad/s^2].
    near : (m,) array of bool
        True if the time is not in a gap between samples.
    noise : float
        Standard deviation of the samples about the smoothed position [rad].
    """
    # positions at even steps of time
    step, half = _window(time_s)
    grid = np.arange(time_s[0], time_s[-1], step)
    even = np.interp(grid, time_s, value)
    # a cubic by least squares over each window, whose coefficients are sums of the positions with weights
    offsets = step * np.arange(-half, half + 1)
    weights = np.linalg.pinv(np.vander(offsets, 4, increasing=True))
    position, speed, half_acceleration = (np.convolve(even, row[::-1], mode="valid") for row in weights[:3])
    acceleration = 2.0 * half_acceleration
    inner = slice(half, len(grid) - half)
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
    return grid[inner], position, speed, acceleration, near, noise


# A torque and the motion of a joint at the torque's times, while the joint turns.


_MOVING = 0.2  # below this fraction of the median speed, the leg stands or starts
_WAVES = 8  # harmonics of a turn of the crank, in the ripple of the speed that repeats
_SLOW_S = 1.0  # averaging time for a speed without its ripple
_STEADY = 0.08  # relative difference up to which two speeds count as the same


@attrs.frozen(eq=False)
class Pair:
    """Samples of a torque, paired with the motion of a joint at their times.

    Attributes
    ----------
    time_s, torque, position_rad, speed_radps, acceleration_radps2 : (n,) arrays
        The torque is in the unit of its sensor; the motion is the joint's, before any gear to the crank.
    recording : (n,) array of int
        Index of the recording.
    interval_s : float
        Sampling interval of the torque [s].
    """

    time_s: Floats
    torque: Floats
    position_rad: Floats
    speed_radps: Floats
    acceleration_radps2: Floats
    recording: NDArray[np.int64]
    interval_s: float

    def part(self, which: NDArray[np.bool_] | slice) -> "Pair":
        """Pair of a subset of the samples."""
        columns = {name: getattr(self, name)[which] for name in _COLUMNS}
        return attrs.evolve(self, **columns)

    def earlier(self, by_s: float) -> tuple[Floats, Floats, Floats]:
        """Position, speed and acceleration, each (n,), by a time [s] before each sample."""
        motion = (self.position_rad, self.speed_radps, self.acceleration_radps2)
        if by_s == 0.0:
            return motion
        moved = np.array(motion)
        for number in np.unique(self.recording):
            inside = self.recording == number
            for row in moved:
                row[inside] = np.interp(self.time_s[inside] - by_s, self.time_s[inside], row[inside])
        return moved[0], moved[1], moved[2]

    @property
    def walks_both_ways(self) -> bool:
        """True if each direction has at least a tenth of the samples."""
        backwards = float(np.mean(self.speed_radps < 0.0))
        return 0.1 < backwards < 0.9


_COLUMNS = ("time_s", "torque", "position_rad", "speed_radps", "acceleration_radps2", "recording")


def paired(motion: JointMotion, torque: Series) -> Pair:
    """Torque samples at which the joint turns; none if the two have no time in common."""
    parts = []
    for number in np.unique(motion.recording):
        of_joint, of_torque = motion.recording == number, torque.recording == number
        time_s, times = motion.time_s[of_joint], torque.time_s[of_torque]
        # torque samples during the motion, and those of them outside its gaps
        inside = (times >= time_s[0]) & (times <= time_s[-1])
        inside[inside] = np.interp(times[inside], time_s, motion.near[of_joint].astype(float)) > 0.5
        at = times[inside]
        values = (motion.position_rad, motion.speed_radps, motion.acceleration_radps2)
        moved = [np.interp(at, time_s, value[of_joint]) for value in values]
        parts.append((at, torque.value[of_torque][inside], *moved, np.full(len(at), number)))
    interval_s = float(np.median(np.diff(torque.time_s))) if len(torque.time_s) > 1 else 0.0
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    pair = Pair(**dict(zip(_COLUMNS, columns, strict=True)), interval_s=interval_s)
    speed = np.abs(pair.speed_radps)
    return pair.part(speed > _MOVING * np.median(speed)) if len(speed) else pair


def with_repeating_acceleration(pair: Pair, ratio: float) -> Pair:
    """The pair with only that part of the acceleration that repeats in each turn of the crank.

    Noise of the encoder may be as large as the acceleration within one turn, but averages out over many.

    The speed is modelled as u (1 + w(φ)): u is its mean over a turn of the crank, and w a Fourier series of
    the crank angle φ = ratio · position, fitted by least squares. So the acceleration is u w'(φ) dφ/dt, with
    dφ/dt = ratio · u.

    Parameters
    ----------
    pair : Pair
    ratio : float
        Turns of the crank per turn of the joint.
    """
    speed = slow_speed(pair, TURN / abs(ratio * float(np.median(pair.speed_radps))))
    order = np.arange(1, _WAVES + 1)
    angle = np.outer(ratio * pair.position_rad, order)
    waves = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    amplitudes = np.linalg.lstsq(waves, pair.speed_radps / speed - 1.0, rcond=None)[0]
    slope = np.concatenate([-order * np.sin(angle), order * np.cos(angle)], axis=1) @ amplitudes
    return attrs.evolve(pair, acceleration_radps2=ratio * speed**2 * slope)


def slow_speed(pair: Pair, span_s: float = _SLOW_S) -> Floats:
    """Speed of the joint (n,) [rad/s] without its ripple: the mean over a time [s] around each sample.

    The mean spans at most a quarter of all samples, and fewer at both ends.
    """
    samples = max(1, min(len(pair.time_s) // 4, round(span_s / max(pair.interval_s, 1.0e-6))))
    total = np.concatenate([[0.0], np.cumsum(pair.speed_radps)])
    after = np.minimum(np.arange(len(pair.time_s)) + samples // 2 + 1, len(pair.time_s))
    before = np.maximum(np.arange(len(pair.time_s)) - samples // 2, 0)
    return np.asarray((total[after] - total[before]) / (after - before))


def is_steady(pair: Pair) -> NDArray[np.bool_]:
    """True (n,) where the speed without ripple is about the same half a second before and after a sample."""
    speed, at = slow_speed(pair), np.arange(len(pair.time_s))
    half = round(0.5 * _SLOW_S / max(pair.interval_s, 1.0e-6))
    before, after = np.maximum(at - half, 0), np.minimum(at + half, len(at) - 1)
    return np.asarray(np.abs(speed[after] - speed[before]) <= _STEADY * np.abs(speed))


def steady_stretch(pair: Pair) -> Pair:
    """Longest stretch of samples at about one speed, in one direction, in one recording."""
    speed = slow_speed(pair)
    # each speed that occurs is tried as the one
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    best = slice(0, 0)
    for centre in centres:
        steady = np.abs(speed - centre) <= _STEADY * abs(centre)
        # samples that belong together with the next sample; a stretch is a run of them
        linked = steady[1:] & steady[:-1] & (np.diff(pair.recording) == 0)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], linked, [False]]).astype(int)))
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if last - first > best.stop - best.start:
                best = slice(first, last + 1)
    return pair.part(best)
