"""A torque and the motion of a joint at the torque's times, while the joint turns."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate.torque_fit.motion import JointMotion
from leg_wear_monitor.estimate.torque_fit.series import Series
from leg_wear_monitor.mechanism.arrays import Floats

_MOVING = 0.2  # of the usual speed, below which the leg stands or starts
_SLOW_S = 1.0  # averaging time for a speed without its ripple
_STEADY = 0.08  # relative width of a speed that counts as one


@attrs.frozen(eq=False)
class Pair:
    """Torque samples with the joint's motion.

    Attributes
    ----------
    time_s, torque, position_rad, speed_radps, acceleration_radps2 : (n,) arrays
        The torque in its own unit; the motion is the joint's, not the crank's.
    recording : (n,) array of int
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
        """Position, speed and acceleration, each (n,), some time before each sample [s]."""
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
        """Whether at least a tenth of the samples is of either direction."""
        backwards = float(np.mean(self.speed_radps < 0.0))
        return 0.1 < backwards < 0.9


_COLUMNS = ("time_s", "torque", "position_rad", "speed_radps", "acceleration_radps2", "recording")


def paired(motion: JointMotion, torque: Series) -> Pair:
    """Torque samples at which the joint turns; none if the two have no time in common."""
    parts = []
    for number in np.unique(motion.recording):
        of_joint, of_torque = motion.recording == number, torque.recording == number
        time_s, times = motion.time_s[of_joint], torque.time_s[of_torque]
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


def slow_speed(pair: Pair) -> Floats:
    """Speed of the joint without the ripple of a turn (n,) [rad/s]."""
    number = max(1, min(len(pair.time_s) // 4, round(_SLOW_S / max(pair.interval_s, 1.0e-6))))
    total = np.concatenate([[0.0], np.cumsum(pair.speed_radps)])
    after = np.minimum(np.arange(len(pair.time_s)) + number // 2 + 1, len(pair.time_s))
    before = np.maximum(np.arange(len(pair.time_s)) - number // 2, 0)
    return np.asarray((total[after] - total[before]) / (after - before))


def is_steady(pair: Pair) -> NDArray[np.bool_]:
    """Where the speed without its ripple is about the same half a second before and after (n,)."""
    speed, at = slow_speed(pair), np.arange(len(pair.time_s))
    half = round(0.5 * _SLOW_S / max(pair.interval_s, 1.0e-6))
    before, after = np.maximum(at - half, 0), np.minimum(at + half, len(at) - 1)
    return np.asarray(np.abs(speed[after] - speed[before]) <= _STEADY * np.abs(speed))


def steady_stretch(pair: Pair) -> Pair:
    """Longest stretch at one speed, in one direction, in one recording."""
    speed = slow_speed(pair)
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    best = slice(0, 0)
    for centre in centres:
        steady = np.abs(speed - centre) <= _STEADY * abs(centre)
        whole = steady[1:] & steady[:-1] & (np.diff(pair.recording) == 0)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if last - first > best.stop - best.start:
                best = slice(first, last + 1)
    return pair.part(best)
