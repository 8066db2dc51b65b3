"""The compliance between the measured crank angle and the crank, from the torque of a commissioned leg.

Behind a coupling or a belt the crank of a leg swings at some 4 to 20 Hz, and the measured torque is that of
the spring: harmonics near the resonance grow, those above vanish. A delay and a low-pass also turn and
weaken harmonics, the higher the more, and masses, lengths and friction change the first ones; so all of
these are fitted together with the stiffness. The joints are ideal here, without clearances; an
identification with simulated legs (`estimate.identification`) starts from the result.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.estimate.body_torques import body_torques
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.estimate.torque_model import at_angles
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import COUPLING_DAMPING, CrankProfile, LegParameters

# tried stiffnesses; neighbours are half the width of a resonance apart
STIFFNESS_NM_PER_RAD = np.geomspace(8000.0, 150.0, 24)

_POINTS = 256  # points of a gait cycle, at equal steps of time
_MEAN_HARMONICS = 12  # fitted harmonics of the mean torque
# Error of a harmonic because the real joints have clearances, as a fraction of the measured torque's size: a
# constant part, and a part for each order.
_MEAN_ERROR, _ERROR_PER_HARMONIC = 0.01, 0.005
_MASS_SIGMA, _LENGTH_SIGMA = 0.03, 0.006  # relative standard deviations about the mechanism file
_FURTHEST = 0.5  # largest relative deviation: masses and lengths stay positive, whatever the torque is
_LEAST_SWING = 0.01  # of the predicted torque's size
# standard deviations: constant friction over the torque's size, load friction; scale and delay of the sensor
_CONSTANT_FRICTION_SIGMA, _LOAD_FRICTION_SIGMA, _SCALE_SIGMA, _DELAY_SIGMA_S = 0.5, 0.2, 0.1, 0.04
_RIGID_TIME_CONSTANTS_S = (0.0, 0.004, 0.008, 0.016)  # low-passes tried on a rigid drive, to 10 Hz
_GAUSS_NEWTON_STEPS = 4

# A coupling is accepted if the residual's sum of squares is at most the first number, and smaller than that
# of a rigid drive by at least the second. Simulated legs behind 200 to 5000 N m/rad have sums of 2 to 15, and
# of 31 to 593 if a rigid drive is assumed. Legs with a rigid drive have 2.5 to 8, also with a lag, a
# low-pass, load friction, lengths within 5 % or twice the friction in the joints, and 310 to 1500 on the
# ground (docs/explanation/diagnosis.md).
_MOST_SQUARES, _IMPROVEMENT = 40.0, 15.0

# Clearances look like compliance where the torque changes its sign: joints of 0.3 mm under some 20 N m add
# 1.3e-4 to 1.9e-4 rad/(N m) behind 200 to 5000 N m/rad. So much is subtracted, at most half of the
# compliance.
_CLEARANCE_COMPLIANCE, _MOST_CLEARANCE_FRACTION = 1.5e-4, 0.5

# tried damping ratios; losses in clearances look like 0.005 to 0.015 more, which is subtracted
_DAMPINGS, _CLEARANCE_DAMPING = np.geomspace(0.01, 0.16, 9), 0.012

_RIGID_NM_PER_RAD = 2.0e4  # resonance above 35 Hz, which no signature of 200 samples a cycle shows

# Newton's method for the crank's motion: most steps, longest step, and step at which it has converged
_NEWTON_STEPS, _LONGEST_STEP_RAD, _CONVERGED_RAD = 30, 0.05, 1.0e-7


class _FittedLeg(NamedTuple):
    """A leg fitted to a mean torque.

    Attributes
    ----------
    square : float
        Sum of squares of the residual and of the parameters, in units of their standard deviations.
    bodies : (2 bodies,) array
        Factors on the masses, then on the lengths of the bodies, less 1.
    deviation : (POINTS,) array
        Crank angle less measured angle [rad].
    """

    square: float
    bodies: Floats
    deviation: Floats


def leg_behind_coupling(
    mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
) -> LegParameters | None:
    """The leg with a compliant drive that explains a mean torque; None if a rigid drive explains it as well.

    Parameters
    ----------
    mechanism : Mechanism
    sensor : TorqueSensor
    profile : CrankProfile
        Motion of the measured angle.
    mean : (F,) array
        Mean signature of a leg that is as expected; its mean torques are used.
    """
    fitter = _CouplingFit(mechanism, sensor, profile, mean[: sensor.phases])
    rigid = min(fitter.fit(0.0, time_constant_s).square for time_constant_s in _RIGID_TIME_CONSTANTS_S)
    if rigid < _IMPROVEMENT:
        return None
    found: list[_FittedLeg] = []
    for stiffness in STIFFNESS_NM_PER_RAD:
        found.append(fitter.fit(stiffness, 0.0, found[-1] if found else None))
    squares = np.array([one.square for one in found])
    best = int(np.argmin(squares))
    if squares[best] > min(_MOST_SQUARES, rigid - _IMPROVEMENT) or best in (0, len(found) - 1):
        return None  # a poor fit, or the best stiffness is at an end of the range
    stiffness = math.exp(
        _vertex(np.log(STIFFNESS_NM_PER_RAD[best - 1 : best + 2]), squares[best - 1 : best + 2])
    )
    mass, length = np.split(1.0 + found[best].bodies, 2)
    compliance = max((1.0 - _MOST_CLEARANCE_FRACTION) / stiffness, 1.0 / stiffness - _CLEARANCE_COMPLIANCE)
    damping = fitter.damping_at(stiffness, found[best])
    return LegParameters(mass, length, compliance=compliance, damping=damping)


def compliance_of(stiffness_nm_per_rad: float) -> float:
    """Compliance [rad/(N m)] of a declared stiffness; 0 if the drive is as good as rigid."""
    return 0.0 if stiffness_nm_per_rad >= _RIGID_NM_PER_RAD else 1.0 / stiffness_nm_per_rad


class _CouplingFit:
    """Fits a leg with ideal joints behind a coupling to a mean torque by phase (phases,).

    The parameters x are the factors on masses and lengths less 1 (2 bodies), constant friction [N m], load
    friction, the sensor's scale less 1, and delay [s].
    """

    def __init__(
        self, mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
    ) -> None:
        torques, self._speed = body_torques(mechanism), profile.speed
        self._own, self._by_body = torques.own, np.concatenate([torques.mass, torques.length])
        self._phi = np.arange(_POINTS) * (TURN / _POINTS)
        motion = np.array([profile.at(phi) for phi in self._phi])
        self._angle, self._rate, self._acceleration = motion.T
        # matrix of the time derivative of a periodic function at the points
        order = np.fft.fftfreq(_POINTS, 1.0 / _POINTS)[:, None]
        unit = np.fft.fft(np.eye(_POINTS), axis=0)
        self._slope = np.asarray(np.fft.ifft(1j * order * unit, axis=0).real * self._speed)
        phases = len(mean)
        self._order = np.arange(min(_MEAN_HARMONICS, phases // 2 - 1) + 1.0)
        # harmonics of the measured torque, from the middles of the phases
        middle = (np.arange(phases) + 0.5) * (TURN / phases)
        self._measured = np.exp(-1j * np.outer(self._order, middle)) @ mean / phases
        # a torque that hardly varies still has the error of the model
        size = max(float(np.std(mean)), _LEAST_SWING * sensor.size_nm)
        error = size * (_MEAN_ERROR + _ERROR_PER_HARMONIC * self._order)
        # order 0 is the mean; any other harmonic stands for its conjugate, too
        self._weight = np.where(self._order > 0.0, math.sqrt(2.0), 1.0) / error
        # response of the sensor: a sample counts for two phases, and is a mean over the time before it
        omega = self._order * self._speed
        self._sensor = np.sinc(self._order / phases) ** 2
        if not sensor.is_instant:
            period = sensor.period_s * sensor.together
            self._sensor = self._sensor * np.sinc(omega * period / TURN) * np.exp(-0.5j * omega * period)
        bodies = len(mechanism.bodies)
        drive = _CONSTANT_FRICTION_SIGMA * size, _LOAD_FRICTION_SIGMA, _SCALE_SIGMA, _DELAY_SIGMA_S
        self._sigma = np.array([*[_MASS_SIGMA] * bodies, *[_LENGTH_SIGMA] * bodies, *drive])

    def damping_at(self, stiffness: float, start: _FittedLeg) -> float:
        """Damping ratio of the coupling at a stiffness [N m/rad]."""
        squares = np.array([self.fit(stiffness, 0.0, start, ratio).square for ratio in _DAMPINGS])
        best = int(np.clip(np.argmin(squares), 1, len(_DAMPINGS) - 2))
        near = slice(best - 1, best + 2)
        found = math.exp(_vertex(np.log(_DAMPINGS[near]), squares[near]))
        return float(np.clip(found - _CLEARANCE_DAMPING, _DAMPINGS[0], _DAMPINGS[-1]))

    def fit(
        self,
        stiffness: float,
        time_constant_s: float,
        start: _FittedLeg | None = None,
        damping_ratio: float = COUPLING_DAMPING,
    ) -> _FittedLeg:
        """The most probable leg behind a stiffness [N m/rad], 0 for a rigid drive, and a low-pass [s]."""
        x, omega = np.zeros(len(self._sigma)), self._order * self._speed
        deviation = start.deviation if start else np.zeros(_POINTS)
        if start:
            x[:-4] = start.bodies
        square = math.inf
        for _ in range(_GAUSS_NEWTON_STEPS):
            tables = self._own + np.tensordot(x[:-4], self._by_body, 1)
            deviation, torque = self._torques(tables, stiffness, damping_ratio, deviation)
            passed = self._sensor * np.exp(-1j * omega * x[-1]) / (1.0 + 1j * omega * time_constant_s)
            friction_change = np.copysign(np.abs(torque[:1]), self._speed)
            leg, load_friction, *by_body = passed * self._harmonics(
                np.vstack([torque[:1], friction_change, torque[1:]])
            )
            constant = np.eye(len(leg))[0]
            whole = (1.0 + x[-2]) * leg + x[-3] * load_friction + x[-4] * constant
            columns = np.vstack([*by_body, constant, load_friction, leg, -1j * omega * leg])
            residual, jacobian = self._real(self._measured - whole), self._real(columns)
            square = float(residual @ residual + np.sum((x / self._sigma) ** 2))
            information = jacobian @ jacobian.T + np.diag(self._sigma**-2.0)
            x = x + np.linalg.solve(information, jacobian @ residual - x / self._sigma**2)
            x[:-4] = np.clip(x[:-4], -_FURTHEST, _FURTHEST)
        return _FittedLeg(square, x[:-4], deviation)

    def _real(self, harmonics: Floats) -> Floats:
        """Harmonics (..., h) in units of their errors, as real numbers (..., 2 h)."""
        scaled = harmonics * self._weight
        return np.concatenate([scaled.real, scaled.imag], axis=-1)

    def _harmonics(self, torque: Floats) -> Floats:
        """Harmonics (..., h) over the measured angle of torques (..., POINTS) at equal steps of time."""
        kernel = np.exp(-1j * np.outer(self._order, self._angle)) * (self._rate / self._speed / _POINTS)
        return np.asarray(torque @ kernel.T)

    def _torques(
        self, tables: Floats, stiffness: float, damping_ratio: float, deviation: Floats
    ) -> tuple[Floats, Floats]:
        """Deviation of the crank (POINTS,) [rad], and the torque with its derivatives by masses and lengths.

        The crank's motion is periodic; Newton's method finds it. The torques are rows (1 + 2 bodies, POINTS).
        `tables` are the coefficients of 1, speed, its square and acceleration over the crank angle.
        """
        if not stiffness:
            powers = np.stack([np.ones(_POINTS), self._rate, self._rate**2, self._acceleration])
            rows = np.concatenate([tables[None], self._by_body])
            return deviation, np.asarray((at_angles(rows, self._angle)[0] * powers).sum(axis=1))
        damping = 2.0 * damping_ratio * math.sqrt(stiffness * float(tables[3].mean()))
        second = self._slope @ self._slope  # second time derivative
        for _ in range(_NEWTON_STEPS):
            angle, rate = self._angle + deviation, self._rate + self._slope @ deviation
            powers = np.stack([np.ones(_POINTS), rate, rate**2, self._acceleration + second @ deviation])
            values, slopes = at_angles(tables, angle)
            spring = stiffness * deviation + damping * (self._slope @ deviation)
            by_rate = (values[1] + 2.0 * rate * values[2] + damping)[:, None] * self._slope
            by_angle = np.diag((slopes * powers).sum(axis=0) + stiffness)
            jacobian = by_angle + by_rate + values[3][:, None] * second
            step = np.linalg.solve(jacobian, -(values * powers).sum(axis=0) - spring)
            largest = float(np.abs(step).max())
            deviation = deviation + min(1.0, _LONGEST_STEP_RAD / max(largest, _CONVERGED_RAD)) * step
            if largest < _CONVERGED_RAD:
                break
        # the measured torque is that of the spring; a change of a body changes it by the deviation
        by_body = (at_angles(self._by_body, angle)[0] * powers).sum(axis=1)
        deviations = np.vstack([deviation, np.linalg.solve(jacobian, -by_body.T).T])
        return deviation, np.asarray(-stiffness * deviations - damping * deviations @ self._slope.T)


def _vertex(x: Floats, y: Floats) -> float:
    """Minimum of the parabola through three points, of which the middle one is the lowest."""
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (right - left) / (0.5 * (x[2] - x[0]))
    return float(0.5 * (x[0] + x[1]) - left / bend)
