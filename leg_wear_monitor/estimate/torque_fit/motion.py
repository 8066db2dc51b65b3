"""Motion of a joint that turns on and on: position, speed and acceleration, and noise of its encoder."""

import math

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate.torque_fit.series import Series
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

_WINDOW_S = 0.12  # of the local fit: a twelfth of a turn at 40 rpm, so a ripple of two a turn stays
_LEAST_WINDOW = 7  # samples, enough for a cubic with three to spare
_GAP_SAMPLES = 4.0  # sampling intervals without a sample that are not bridged
_LEAST_TRAVEL_RAD = 1.0
# A crank that walks forwards and back as far travels twice its range; a joint that swings, once a cycle
_ROCKING = 0.2
_NO_VARIANCE = 1.0e-12


@attrs.frozen(eq=False)
class JointMotion:
    """Smoothed motion of a joint.

    Attributes
    ----------
    time_s, position_rad, speed_radps, acceleration_radps2 : (n,) arrays
        Smoothed; the position counts on over turns.
    recording : (n,) array of int
    near : (n,) array of bool
        Whether samples lie around this time.
    is_wrapped : bool
        Whether the encoder's readings are wrapped to a turn.
    noise_rad : float
        Standard deviation of the readings about the smoothed position [rad].
    first_rad : (recordings,) array
        First reading of each recording [rad].
    rate_hz : float
    """

    time_s: Floats
    position_rad: Floats
    speed_radps: Floats
    acceleration_radps2: Floats
    recording: NDArray[np.int64]
    near: NDArray[np.bool_]
    is_wrapped: bool
    noise_rad: float
    first_rad: Floats
    rate_hz: float


def why_not_a_crank(joint: Series) -> str:
    """Why a joint cannot be the crank: it stands, or swings to and fro; empty if it turns on and on."""
    if len(joint.value) < 4 * _LEAST_WINDOW:
        return f"has only {len(joint.value)} samples"
    position = _unwrapped(joint)
    reach = float(np.ptp(position))
    if reach < _LEAST_TRAVEL_RAD:
        return f"moves by {reach:.2g} rad in all"
    turning_points = position[:: max(1, len(position) // 2000)]  # coarse, so that noise adds no path
    path = float(np.abs(np.diff(turning_points)).sum())
    return f"swings to and fro within {reach:.2g} rad" if reach < _ROCKING * path else ""


def motion_of(joint: Series) -> JointMotion:
    """Smoothed motion of a joint for which `why_not_a_crank` is empty."""
    parts = []
    for number in np.unique(joint.recording):
        chosen = joint.recording == number
        time_s, value = joint.time_s[chosen], _unwrapped_values(joint.value[chosen])
        if len(time_s) >= 2 * _LEAST_WINDOW:
            parts.append((number, value[0], *_smoothed(time_s, value)))
    columns = [np.concatenate([part[i] for part in parts]) for i in range(2, 7)]
    number = np.concatenate([np.full(len(part[2]), part[0]) for part in parts])
    return JointMotion(
        time_s=columns[0],
        position_rad=columns[1],
        speed_radps=columns[2],
        acceleration_radps2=columns[3],
        recording=number,
        near=columns[4],
        is_wrapped=is_wrapped(joint.value),
        noise_rad=float(np.median([part[7] for part in parts])),
        first_rad=np.array([part[1] for part in parts]),
        rate_hz=float(1.0 / np.median(np.diff(joint.time_s))),
    )


def is_wrapped(value: Floats) -> bool:
    """Whether readings jump by about a turn and stay within one."""
    jumps = np.abs(np.diff(value)) > math.pi
    return bool(jumps.any() and np.ptp(value) <= 1.05 * TURN)


def _unwrapped_values(value: Floats) -> Floats:
    return np.asarray(np.unwrap(value)) if is_wrapped(value) else value


def _unwrapped(joint: Series) -> Floats:
    """Positions without jumps, not even from one recording to the next."""
    value = joint.value.astype(float)
    if is_wrapped(value):
        return np.asarray(np.unwrap(value))
    step = np.diff(value)
    step[np.diff(joint.recording) != 0] = 0.0
    return np.concatenate([value[:1], value[0] + np.cumsum(step)])


def _smoothed(
    time_s: Floats, value: Floats
) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.bool_], float]:
    """Time, position, speed, acceleration on an even grid; where samples are near; noise."""
    step = float(np.median(np.diff(time_s)))
    grid = np.arange(time_s[0], time_s[-1], step)
    even = np.interp(grid, time_s, value)
    half = max(_LEAST_WINDOW, round(_WINDOW_S / step)) // 2
    offsets = step * np.arange(-half, half + 1)
    rows = np.linalg.pinv(np.vander(offsets, 4, increasing=True))  # a local cubic by least squares
    position, speed, halved = (np.convolve(even, row[::-1], mode="valid") for row in rows[:3])
    inner = slice(half, len(grid) - half)
    left = value - np.interp(time_s, grid[inner], position, left=np.nan, right=np.nan)
    noise = float(np.nanmedian(np.abs(left)) / 0.6745 / math.sqrt(1.0 - rows[0, half]))
    acceleration = 2.0 * halved
    error = 2.0 * noise * float(np.linalg.norm(rows[2]))
    # an encoder's noise shall not stand in the torque as the leg's inertia
    acceleration *= max(0.0, 1.0 - error**2 / max(float(acceleration.var()), error**2, _NO_VARIANCE))
    after = np.searchsorted(time_s, grid[inner]).clip(1, len(time_s) - 1)
    near = time_s[after] - time_s[after - 1] <= _GAP_SAMPLES * step
    return grid[inner], position, speed, acceleration, near, noise
