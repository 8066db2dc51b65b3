"""A drive and its sensor: their effect on the leg's torque, and their declared values."""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Complex, Floats
from leg_wear_monitor.mechanism.position import TURN

_RIGID_NM_PER_RAD = 2.0e4  # resonance above 35 Hz, which no signature of 200 samples a cycle shows


@attrs.frozen(kw_only=True)
class Channel:
    """Effect of a drive on the leg's torque before it is sampled.

    Attributes
    ----------
    delay_s : float
        Delay of the samples relative to their crank angle: the lag minus the crank offset divided by the
        speed.
    time_constant_s : float
        T of the low-pass 1 / (1 + T s + c T² s²): the time by which it delays slow changes; 0 without one.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    second_order : float
        c: 0 for a low-pass of first order, 1/4 for two equal ones in a row, 1/2 for Butterworth's.
    """

    delay_s: float = 0.0
    time_constant_s: float = 0.0
    load_friction: float = 0.0
    second_order: float = 0.0

    @property
    def lateness_s(self) -> float:
        """Delay of slow changes of the torque by delay and low-pass together [s]."""
        return self.delay_s + self.time_constant_s

    @property
    def bandwidth_hz(self) -> float:
        """Frequency at which half of the power passes; infinite without low-pass and averaging."""
        if self.time_constant_s == 0.0:
            return math.inf
        c = self.second_order  # |response|⁻² = (1 - c x)² + x = 2, at x = (omega T)²
        x = 2.0 / (1.0 - 2.0 * c + math.hypot(1.0 - 2.0 * c, 2.0 * c))
        return math.sqrt(x) / (TURN * self.time_constant_s)

    def received(self, torque: Floats, step_s: float, direction: float) -> Floats:
        """Torques (..., n) in equal steps of time [s] behind the drive; taken as periodic.

        Parameters
        ----------
        torque : (..., n) array
            Of the leg [N m].
        step_s : float
        direction : float
            Sign of the crank's speed: friction takes power in both directions of the power.
        """
        if self.load_friction:
            torque = torque + direction * self.load_friction * np.abs(torque)
        if self.delay_s == 0.0 and self.time_constant_s == 0.0:
            return torque
        points = torque.shape[-1]
        response = self.response(np.asarray(TURN * np.fft.rfftfreq(points, step_s), np.float64))
        return np.asarray(np.fft.irfft(np.fft.rfft(torque) * response, points))

    def response(self, omega: Floats) -> Complex:
        """Frequency response (n,) of delay and low-pass at angular frequencies (n,) [rad/s]."""
        s = 1j * omega * self.time_constant_s
        return np.asarray(np.exp(-1j * omega * self.delay_s) / (1.0 + s + self.second_order * s**2))


DIRECT = Channel()
"""A drive that adds nothing."""


# Declared values of a drive: prior knowledge of the estimate.


@attrs.frozen(kw_only=True)
class DriveFigures:
    """Declared values of a drive, at the crank's shaft; NaN for undeclared values.

    Values of a motor or a gear are converted to the crank beforehand: torques with the gear ratio, friction
    by speed and stiffness with its square.

    Attributes
    ----------
    lag_s : float
        Time by which the measured torque is late.
    bandwidth_hz : float
        Corner frequency of a first-order low-pass between the torque on the crank and the measured torque.
    load_friction : float
        Fraction eta of the friction eta |torque| sign(speed).
    coulomb_nm : float
        Constant friction.
    viscous_nms : float
        Friction by speed [N m s/rad].
    stiffness_nm_per_rad : float
        Stiffness between the measured angle and the crank.
    """

    lag_s: float = math.nan
    bandwidth_hz: float = math.nan
    load_friction: float = math.nan
    coulomb_nm: float = math.nan
    viscous_nms: float = math.nan
    stiffness_nm_per_rad: float = math.nan

    @property
    def compliance(self) -> float:
        """Declared compliance [rad/(N m)]; 0 if none is declared, or if the drive is practically rigid."""
        return 1.0 / self.stiffness_nm_per_rad if self.stiffness_nm_per_rad < _RIGID_NM_PER_RAD else 0.0

    @property
    def declared(self) -> dict[str, float]:
        """Declared values by name."""
        return {name: value for name, value in attrs.asdict(self).items() if not math.isnan(value)}

    @property
    def lateness_s(self) -> float:
        """Declared delay of slow changes of the torque, by lag and low-pass together [s]."""
        parts = (self.lag_s, 1.0 / (2.0 * math.pi * self.bandwidth_hz))
        return sum(one for one in parts if not math.isnan(one))


UNDECLARED = DriveFigures()
"""Nothing is known."""
