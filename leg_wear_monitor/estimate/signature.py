"""The signature of a gait cycle: what its drive torque is in each phase, and how rough."""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.ideal import TURN

SAMPLES = 200  # a gait cycle: what comes faster is averaged, since clearances show at these times already

_PHASES = (80, 40, 20, 10)
_LEAST_IN_PHASE = 2.5  # samples on average
_FLOOR = 1.0e-4  # of the torque's size, below which roughness is rounding
_CLIP = 8.0  # times the torque's size: a peak counts as at most this


@attrs.frozen(kw_only=True)
class Channel:
    """What a drive makes of the leg's torque before it is sampled.

    Attributes
    ----------
    delay_s : float
        Time by which samples are late for their crank angle: a lag, less an offset of the crank over its
        speed.
    time_constant_s : float
        Of the first-order low-pass; 0 without one.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    """

    delay_s: float = 0.0
    time_constant_s: float = 0.0
    load_friction: float = 0.0

    @property
    def lateness_s(self) -> float:
        """Time by which slow changes of the torque are late: by the delay and by the low-pass."""
        return self.delay_s + self.time_constant_s

    def received(self, torque: Floats, step_s: float, direction: float) -> Floats:
        """Torque (n,) in equal steps of time [s] behind the drive; taken as periodic.

        Parameters
        ----------
        torque : (n,) array
            Of the leg [N m].
        step_s : float
        direction : float
            Sign of the crank's speed: friction takes power in both directions of the power.
        """
        if self.load_friction:
            torque = torque + direction * self.load_friction * np.abs(torque)
        if self.delay_s == 0.0 and self.time_constant_s == 0.0:
            return torque
        omega = TURN * np.fft.rfftfreq(len(torque), step_s)
        response = np.exp(-1j * omega * self.delay_s) / (1.0 + 1j * omega * self.time_constant_s)
        return np.asarray(np.fft.irfft(np.fft.rfft(torque) * response, len(torque)))


DIRECT = Channel()
"""A drive that adds nothing."""


@attrs.frozen
class TorqueSensor:
    """How a drive torque is measured.

    Attributes
    ----------
    period_s : float
        Time between two samples.
    cycle_s : float
        Duration of a gait cycle.
    size_nm : float
        RMS of the leg's drive torque.
    is_instant : bool
        Whether a sample is the torque at its instant, or else the mean since the one before.
    noise_nm : float
        Standard deviation of a sample.
    channel : Channel
    """

    period_s: float
    cycle_s: float
    size_nm: float
    is_instant: bool = False
    noise_nm: float = 0.0
    channel: Channel = DIRECT

    @property
    def together(self) -> int:
        """Number of samples that are averaged into one."""
        return max(1, round(self.cycle_s / SAMPLES / self.period_s))

    @property
    def phases(self) -> int:
        """Number of phases of a signature; 0 where samples are too few for one."""
        return next((phases for phases in _PHASES if round(self.samples) >= _LEAST_IN_PHASE * phases), 0)

    @property
    def samples(self) -> float:
        """Number of samples in a gait cycle, after averaging."""
        return self.cycle_s / (self.period_s * self.together)


def averaged(values: Floats, together: int) -> Floats:
    """Means (n // together,) of neighbouring values; what is left over at the end is dropped."""
    whole = len(values) // together * together
    return np.asarray(values[:whole].reshape(-1, together).mean(axis=1))


def signatures(cycle: Ints, angle: Floats, torque: Floats, step: Floats, sensor: TorqueSensor) -> Floats:
    """Signatures of gait cycles.

    Parameters
    ----------
    cycle : (n,) array of int
        Number of the gait cycle of each sample, from 0.
    angle, torque : (n,) arrays
        Crank angle [rad] and drive torque [N m] of each sample.
    step : (n,) array
        Torque less that of the sample before [N m]; NaN where that was lost.
    sensor : TorqueSensor

    Returns
    -------
    (cycles, 2 phases) array
        Mean torque [N m] of each phase, then the logarithm of the mean size of the steps [log N m]; NaN for a
        phase without samples.
    """
    shape = int(cycle.max()) + 1 if len(cycle) else 0, sensor.phases
    known = np.isfinite(step)
    steps = PhaseMeans(cycle[known], angle[known], shape)
    return signatures_by_phase(PhaseMeans(cycle, angle, shape), steps, torque, step[known], sensor)


class PhaseMeans:
    """Means of quantities in each phase of gait cycles, for samples at given angles.

    A sample counts for the two phases whose middles are next to it, the nearer one more. Samples often come
    at the same angles in each cycle, and a small shift of theirs must not move them into another phase.

    Parameters
    ----------
    cycle : (n,) array of int
        Number of the gait cycle of each sample, from 0.
    angle : (n,) array
        Crank angle of each sample [rad].
    shape : (cycles, phases)
        That of the means.
    """

    def __init__(self, cycle: Ints, angle: Floats, shape: tuple[int, int]) -> None:
        phases = shape[1]
        place = ((angle / TURN) % 1.0) * phases - 0.5
        before = np.floor(place).astype(np.int64)
        self._shape = shape
        self._flat = np.concatenate([cycle * phases + at % phases for at in (before, before + 1)])
        self._weight = np.concatenate([before + 1 - place, place - before])
        self._counts = np.bincount(self._flat, self._weight, shape[0] * phases)

    def of(self, value: Floats) -> Floats:
        """Means of a quantity (n,), NaN for a phase without samples."""
        sums = np.bincount(self._flat, self._weight * np.tile(value, 2), len(self._counts))
        with np.errstate(invalid="ignore"):
            return np.asarray((sums / self._counts).reshape(self._shape))


def signatures_by_phase(
    samples: PhaseMeans, steps: PhaseMeans, torque: Floats, step: Floats, sensor: TorqueSensor
) -> Floats:
    """`signatures` of samples whose phases are known: torques (n,) and steps (m,) at their places."""
    furthest = _CLIP * sensor.size_nm
    mean = samples.of(np.clip(torque, -furthest, furthest))
    rough = steps.of(np.minimum(np.abs(step), furthest))
    return np.hstack([mean, np.log(rough + _FLOOR * sensor.size_nm)])


def quiet_phases(signature: Floats) -> Floats:
    """Which entries (2 phases,) are the roughness of the calmest third of the phases, as booleans."""
    phases = len(signature) // 2
    limit = np.sort(signature[phases:])[math.ceil(phases / 3) - 1]
    return np.concatenate([np.zeros(phases, bool), signature[phases:] <= limit])
