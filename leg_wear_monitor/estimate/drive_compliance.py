"""Compliance between the measured crank angle and the crank, from the mean torque of a commissioned leg.

Behind a coupling or a belt the crank of a leg swings at some 4 to 20 Hz, and the measured torque is that of
the spring: harmonics near the resonance grow, those above vanish. A delay or a low-pass turns and weakens
harmonics in their order, and masses, lengths and friction change the first ones, so all of these are left
free. The leg has ideal joints here, so an identification with simulated legs goes on from what is found.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.estimate.body_torques import body_torques
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import COUPLING_DAMPING, LegParameters

STIFFNESS_NM_PER_RAD = np.geomspace(
    8000.0, 150.0, 24
)  # that are tried, neighbours at half a resonance's width

_POINTS = 256  # of a gait cycle
_HARMONICS = 12  # of the mean torque
# of the measured torque's size: what a leg with clearances is off one with ideal joints, in the mean and with
# each harmonic more
_ERROR, _ERROR_BY_HARMONIC = 0.01, 0.005
_MASS, _LENGTH = 0.03, 0.006  # standard deviations about the file's, as in `identification`
# those of friction, over the torque's size, and load friction; of the sensor's scale and delay
_FRICTION, _LOAD_FRICTION, _SCALE, _DELAY_S = 0.5, 0.2, 0.1, 0.04
_TIME_CONSTANTS_S = (0.0, 0.004, 0.008, 0.016)  # low-passes that are tried on a rigid drive: to 10 Hz
_ROUNDS = 4  # of Gauss and Newton

# Sums of squares of what is left over: with a coupling at most the first, and less than that of a rigid drive
# by the second. Behind 200 to 5000 N m/rad they are 2 to 15, and 31 to 593 as of a rigid drive; of rigid ones
# 2.5 to 8, with a lag, a low-pass, load friction, lengths within 5 % or twice the friction of joints, too,
# and 310 to 1500 on the ground (docs/explanation/diagnosis.md)
_FITS, _BETTER = 40.0, 15.0

# rad/(N m): what clearances of 0.3 mm add where the torque of some 20 N m changes its sign, 1.3e-4 to 1.9e-4
# behind 200 to 5000 N m/rad; at most this part of the compliance
_CLEARANCES, _MOST_OF_IT = 1.5e-4, 0.5

# dampings over the critical one that are tried, and what losses in clearances add to it: 0.005 to 0.015
_DAMPINGS, _DAMPING_OF_CLEARANCES = np.geomspace(0.01, 0.16, 9), 0.012

_RIGID_NM_PER_RAD = 2.0e4  # a resonance above 35 Hz, which no signature of 200 samples shows


class _Fit(NamedTuple):
    """A fitted leg: sum of squares, factors on bodies less 1 (2 bodies,), and how the crank deviates."""

    square: float
    bodies: Floats
    deviation: Floats


def leg_behind_coupling(
    mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
) -> LegParameters | None:
    """The leg with a compliant drive that explains a mean torque; None where a rigid drive does as well.

    Parameters
    ----------
    mechanism : Mechanism
    sensor : TorqueSensor
    profile : CrankProfile
        Of the measured angle.
    mean : (F,) array
        Mean signature of a leg as expected.
    """
    search = _Search(mechanism, sensor, profile, mean[: sensor.phases])
    rigid = min(search.fit(0.0, time_constant_s).square for time_constant_s in _TIME_CONSTANTS_S)
    if rigid < _BETTER:
        return None
    found: list[_Fit] = []
    for stiffness in STIFFNESS_NM_PER_RAD:
        found.append(search.fit(stiffness, 0.0, found[-1] if found else None))
    squares = np.array([one.square for one in found])
    best = int(np.argmin(squares))
    if squares[best] > min(_FITS, rigid - _BETTER) or best in (0, len(found) - 1):
        return None
    stiffness = math.exp(
        _vertex(np.log(STIFFNESS_NM_PER_RAD[best - 1 : best + 2]), squares[best - 1 : best + 2])
    )
    mass, length = np.split(1.0 + found[best].bodies, 2)
    compliance = max((1.0 - _MOST_OF_IT) / stiffness, 1.0 / stiffness - _CLEARANCES)
    damping = search.damping_at(stiffness, found[best])
    return LegParameters(mass, length, compliance=compliance, damping=damping)


def compliance_of(stiffness_nm_per_rad: float) -> float:
    """Compliance [rad/(N m)] of a drive whose stiffness is declared; 0 where it may be taken for rigid."""
    return 0.0 if stiffness_nm_per_rad >= _RIGID_NM_PER_RAD else 1.0 / stiffness_nm_per_rad


class _Search:
    """Fits of legs behind couplings to a mean torque by phase (phases,)."""

    def __init__(
        self, mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
    ) -> None:
        torques, self._speed = body_torques(mechanism), profile.speed
        self._own, self._by_body = torques.own, np.concatenate([torques.mass, torques.length])
        self._phi = np.arange(_POINTS) * (TURN / _POINTS)
        motion = np.array([profile.at(phi) for phi in self._phi])
        self._angle, self._rate, self._acceleration = motion.T
        order = np.fft.fftfreq(_POINTS, 1.0 / _POINTS)[:, None]
        unit = np.fft.fft(np.eye(_POINTS), axis=0)
        self._slope = np.asarray(np.fft.ifft(1j * order * unit, axis=0).real * self._speed)
        phases = len(mean)
        self._order = np.arange(min(_HARMONICS, phases // 2 - 1) + 1.0)
        middle = (np.arange(phases) + 0.5) * (TURN / phases)
        self._wanted = np.exp(-1j * np.outer(self._order, middle)) @ mean / phases
        size = float(np.std(mean))
        error = size * (_ERROR + _ERROR_BY_HARMONIC * self._order)
        self._weight = np.where(self._order > 0.0, math.sqrt(2.0), 1.0) / error
        # means over a sample that end at its angle, in phases that fade into their neighbours
        omega = self._order * self._speed
        self._sensor = np.sinc(self._order / phases) ** 2
        if not sensor.is_instant:
            period = sensor.period_s * sensor.together
            self._sensor = self._sensor * np.sinc(omega * period / TURN) * np.exp(-0.5j * omega * period)
        bodies = len(mechanism.bodies)
        drive = _FRICTION * size, _LOAD_FRICTION, _SCALE, _DELAY_S
        self._sigma = np.array([*[_MASS] * bodies, *[_LENGTH] * bodies, *drive])

    def damping_at(self, stiffness: float, start: _Fit) -> float:
        """Damping over the critical one of a leg behind a stiffness [N m/rad]."""
        squares = np.array([self.fit(stiffness, 0.0, start, ratio).square for ratio in _DAMPINGS])
        best = int(np.clip(np.argmin(squares), 1, len(_DAMPINGS) - 2))
        near = slice(best - 1, best + 2)
        found = math.exp(_vertex(np.log(_DAMPINGS[near]), squares[near]))
        return float(np.clip(found - _DAMPING_OF_CLEARANCES, _DAMPINGS[0], _DAMPINGS[-1]))

    def fit(
        self,
        stiffness: float,
        time_constant_s: float,
        start: _Fit | None = None,
        damping_ratio: float = COUPLING_DAMPING,
    ) -> _Fit:
        """The most probable leg behind a stiffness [N m/rad], 0 for a rigid drive, and a low-pass [s]."""
        x, omega = np.zeros(len(self._sigma)), self._order * self._speed
        deviation = start.deviation if start else np.zeros(_POINTS)
        if start:
            x[:-4] = start.bodies
        square = math.inf
        for _ in range(_ROUNDS):
            tables = self._own + np.tensordot(x[:-4], self._by_body, 1)
            deviation, torque = self._torques(tables, stiffness, damping_ratio, deviation)
            passed = self._sensor * np.exp(-1j * omega * x[-1]) / (1.0 + 1j * omega * time_constant_s)
            rubbing = np.copysign(np.abs(torque[:1]), self._speed)
            leg, load_friction, *by_body = passed * self._harmonics(
                np.vstack([torque[:1], rubbing, torque[1:]])
            )
            constant = np.eye(len(leg))[0]
            whole = (1.0 + x[-2]) * leg + x[-3] * load_friction + x[-4] * constant
            columns = np.vstack([*by_body, constant, load_friction, leg, -1j * omega * leg])
            rest, by = self._real(self._wanted - whole), self._real(columns)
            square = float(rest @ rest + np.sum((x / self._sigma) ** 2))
            information = by @ by.T + np.diag(self._sigma**-2.0)
            x = x + np.linalg.solve(information, by @ rest - x / self._sigma**2)
        return _Fit(square, x[:-4], deviation)

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
        """How the crank deviates (POINTS,) [rad], and the measured torque with its derivatives by bodies.

        The crank's motion is periodic; Newton's method finds it. The torques are rows (1 + 2 bodies, POINTS).
        """
        if not stiffness:
            powers = np.stack([np.ones(_POINTS), self._rate, self._rate**2, self._acceleration])
            both = np.concatenate([tables[None], self._by_body])
            return deviation, np.asarray((_at(both, self._angle)[0] * powers).sum(axis=1))
        damping = 2.0 * damping_ratio * math.sqrt(stiffness * float(tables[3].mean()))
        twice = self._slope @ self._slope
        for _ in range(_MOST):
            angle, rate = self._angle + deviation, self._rate + self._slope @ deviation
            powers = np.stack([np.ones(_POINTS), rate, rate**2, self._acceleration + twice @ deviation])
            values, slopes = _at(tables, angle)
            spring = stiffness * deviation + damping * (self._slope @ deviation)
            steep = (values[1] + 2.0 * rate * values[2] + damping)[:, None] * self._slope
            jacobian = np.diag((slopes * powers).sum(axis=0) + stiffness) + steep + values[3][:, None] * twice
            step = np.linalg.solve(jacobian, -(values * powers).sum(axis=0) - spring)
            largest = float(np.abs(step).max())
            deviation = deviation + min(1.0, _FURTHEST / max(largest, _SMALL)) * step
            if largest < _SMALL:
                break
        push = (_at(self._by_body, angle)[0] * powers).sum(axis=1)
        moved = np.vstack([deviation, np.linalg.solve(jacobian, -push.T).T])
        return deviation, np.asarray(-stiffness * moved - damping * moved @ self._slope.T)


_MOST, _FURTHEST, _SMALL = 30, 0.05, 1.0e-7  # steps of Newton's method; of the deviation, the longest [rad]


def _at(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (..., n) of periodic tables (..., P) at angles (n,), and their slopes by the angle."""
    points = tables.shape[-1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[..., left]
    step = tables[..., (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)


def _vertex(x: Floats, y: Floats) -> float:
    """Place of the vertex of the parabola through three points, the middle one of which is the least."""
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (right - left) / (0.5 * (x[2] - x[0]))
    return float(0.5 * (x[0] + x[1]) - left / bend)
