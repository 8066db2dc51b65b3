"""A torque sensor on simulated legs: its samples, and their signatures."""

import numpy as np

from leg_wear_monitor.estimate.signature import (
    PhaseMeans,
    TorqueSensor,
    averaged,
    signatures_by_phase,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.reference.leg_simulation import POINTS
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

# of the noise that is added to simulated torques: the same at each start, and another one for each leg, or
# their covariance would be that of a single leg's cycles
_SEED = 20261122
_PART_OF_SAMPLE = 0.618  # by which samples move in each simulated gait cycle


class SimulatedSensor:
    """A sensor on legs of a reference that were simulated for as many gait cycles as each other.

    Its samples fall at the same times on each of these legs.

    Parameters
    ----------
    reference : TorqueReference
    cycles : int
        Simulated gait cycles of a leg.
    sensor : TorqueSensor
    offset_rad : float
        Added to the crank angle.
    """

    def __init__(
        self, reference: TorqueReference, cycles: int, sensor: TorqueSensor, offset_rad: float = 0.0
    ) -> None:
        self._reference, self._sensor = reference, sensor
        period = TURN / abs(reference.profile.speed)
        # another part of a sample each gait cycle: samples of a real leg fall anywhere, too
        between = period / (period / sensor.period_s + _PART_OF_SAMPLE)
        place = np.arange(between, period * cycles, between) * (POINTS / period)
        self._cycles, self._step_s = cycles, period / POINTS
        self._samples, self._between = len(place), between * (POINTS / period)
        self._at = np.minimum(place.astype(np.int64), cycles * POINTS - 1)
        # of averaged samples
        self._ends = place[sensor.together - 1 :: sensor.together]
        cycle = np.minimum((self._ends / POINTS).astype(np.int64), cycles - 1)
        angle = np.interp(self._ends % POINTS, np.arange(POINTS + 1.0), reference.angle) + offset_rad
        shape = cycles, sensor.phases
        self._phases = PhaseMeans(cycle, angle, shape), PhaseMeans(cycle[1:], angle[1:], shape)

    def signatures(self, leg: int, scale: float = 1.0) -> Floats:
        """Signatures (cycles, F) of a leg, with the sensor's noise and a factor on the torque."""
        torque = scale * self.torque(leg)
        return self.signatures_of(torque + self._sensor.noise_nm * self.noise(leg))

    def signatures_of(self, torque: Floats) -> Floats:
        """Signatures (cycles, F) of averaged samples (n,) [N m]."""
        return signatures_by_phase(*self._phases, torque, np.diff(torque), self._sensor)

    def torque(self, leg: int) -> Floats:
        """Averaged samples (n,) of a leg [N m], without noise."""
        simulated = self._reference.torque_nm[leg][: self._cycles].astype(float).ravel()
        direction = float(np.sign(self._reference.profile.speed))
        torque = self._sensor.channel.received(simulated, self._step_s, direction)
        if self._sensor.is_instant:
            return averaged(torque[self._at], self._sensor.together)
        at = np.minimum(self._ends.astype(np.int64), len(torque) - 1)
        impulse = np.cumsum(torque)[at] + (self._ends - at - 1.0) * torque[at]
        return np.asarray(np.diff(impulse, prepend=0.0) / (self._sensor.together * self._between))

    def noise(self, leg: int) -> Floats:
        """Noise (n,) of averaged samples of a leg, in standard deviations of a single sample."""
        noise = np.random.default_rng([_SEED, leg]).standard_normal(self._samples)
        return averaged(noise, self._sensor.together)
