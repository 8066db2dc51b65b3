"""Gross causes of a torque residual: sign, scale, timing, foot load and the mass of a body.

They need no reference and no baseline, only the curve of the torque over a turn of the crank: the predicted
curve, times a factor, with a foot load and a heavier body, turned by an angle. Each of these quantities has
the narrow prior of a leg without a fault, or a wide prior if it is the cause. The most probable single cause
explains the residual, with the odds of `cause` for a cause and for a name.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import (
    SURE_LOG_ODDS,
    SURE_OF_NAME,
    Cause,
    NamedCause,
    TorqueExplanation,
)
from leg_wear_monitor.estimate.torque_model import at_speed, body_torques
from leg_wear_monitor.mechanism.arrays import Complex, Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueProfile

# Harmonics that are compared: higher ones are chaotic impacts, and beyond the 10 Hz of the comparison's
# low-pass filter at 60 rpm. A slow sensor has the second number. Amplitude and phase of a harmonic count as
# one independent number, because the errors of the model affect both.
_HARMONICS = (10, 6)
_LEAST_POINTS = 3  # least number of phases with samples, per harmonic

_SCALE_SIGMA = 0.001  # without a cause, the factor is the declared one
_ANY, _ANY_LOAD_N = 10.0, 1.0e4  # wide priors of the factor and of the load
# prior of a body's mass, as a fraction of it: a tool or a cover, rarely as heavy as the body itself
_MASS_SIGMA = 0.5
_MODEL_ERROR = 0.02  # fraction of the predicted RMS that even the right causes leave
_PART = 0.5  # fraction of the residual that a cause leaves at most: else most of it has a different cause
_MASS_RANGE = (-0.9, 4.0)  # possible error of a body's mass, as a fraction of it
# bodies whose double mass changes the torque by a smaller fraction of its RMS are not supposed as causes
_LEAST_MASS_EFFECT = 0.02
_LEAST_FACTOR = 1.0e-5  # fraction of the predicted RMS, far below the torque in a wrong unit
# angles that are tried, every half degree, from 0 to half a turn and then from minus half a turn to 0
_GRID_RAD = (np.arange(720) / 720 + 0.5) % 1.0 * TURN - 0.5 * TURN


@attrs.frozen(kw_only=True)
class Allowed:
    """Deviations that a leg without a fault may have.

    Attributes
    ----------
    lag_s : float
        Largest lag of the torque, in both directions.
    loads_n : (float, float)
        Range of the foot load.
    unexplained : float
        Fraction of the predicted RMS below which a torque counts as predicted.
    """

    lag_s: float
    loads_n: tuple[float, float]
    unexplained: float


class _Curves(NamedTuple):
    """Mean curves of gait cycles over the crank angle: coefficients (h,) of the harmonics from the first on.

    Measured torque, predicted torque without a foot load [N m], torque per foot load [N m/N], change by a
    double mass of each body [N m]; and means (3,) of the first three.
    """

    measured: Complex
    predicted: Complex
    lever: Complex
    bodies: Mapping[str, Complex]
    means: Floats

    @property
    def size_nm(self) -> float:
        """RMS of the predicted torque."""
        return math.sqrt(_inner(self.predicted, self.predicted) + float(self.means[1]) ** 2)


def _curves_of(profiles: Sequence[TorqueProfile], bodies: Mapping[str, Floats]) -> _Curves | None:
    """Curves of gait cycles; None with too few samples.

    Parameters
    ----------
    profiles : sequence of TorqueProfile
    bodies : mapping of str to (m,) array
        Torques by a body's mass at equal steps of the crank angle from 0 [N m].
    """
    sums = np.sum([attrs.astuple(one, recurse=False) for one in profiles], axis=0)
    number, angle, *torques = sums[:, sums[0] > 0.0]  # sums over the samples of each phase
    harmonics = next((n for n in _HARMONICS if len(number) >= _LEAST_POINTS * n), 0)
    if not harmonics:
        return None
    # least squares for a mean and the harmonics, since the samples need not lie at equal steps
    turns = np.exp(1j * np.outer(angle / number, np.arange(1, harmonics + 1)))
    matrix = np.concatenate([np.ones((len(number), 1)), turns.real, -turns.imag], axis=1)
    weight = np.sqrt(number)[:, None]
    found = np.linalg.lstsq(weight * matrix, weight * (np.array(torques) / number).T, rcond=1e-6)[0]
    measured, predicted, lever = 0.5 * (found[1 : harmonics + 1] + 1j * found[harmonics + 1 :]).T
    of_bodies = {name: np.fft.rfft(curve)[1 : harmonics + 1] / len(curve) for name, curve in bodies.items()}
    return _Curves(measured, predicted, lever, of_bodies, found[0])


def _inner(one: Complex, other: Complex) -> float:
    """Mean of the product of two curves over a turn."""
    return float(2.0 * (one @ other.conj()).real)


def _turned(curve: Complex, angle_rad: float) -> Complex:
    """A curve f as f(x + angle)."""
    return np.asarray(curve * np.exp(1j * angle_rad * np.arange(1, len(curve) + 1)))


def _slope(curve: Complex) -> Complex:
    """Derivative of a curve by the crank angle."""
    return np.asarray(curve * 1j * np.arange(1, len(curve) + 1))


def _reals(curve: Complex) -> Floats:
    """Real numbers (..., 2 h) of curves (..., h) whose products are those of the curves."""
    return math.sqrt(2.0) * np.concatenate([curve.real, curve.imag], axis=-1)


@attrs.frozen(eq=False)
class _Fit:
    """Most probable values with a supposed cause.

    Attributes
    ----------
    cause : Cause
        UNKNOWN without a supposed cause.
    body : str
        The heavier body; empty for other causes.
    x : (4,) array
        Factor on the torque, angle [rad], foot load [N], and error of the body's mass as a fraction of it.
    unexplained : float
        RMS of the residual, as a fraction of the RMS of the scaled prediction.
    unlikely : float
        Minus the logarithm of the probability, less a constant.
    """

    cause: Cause
    body: str
    x: Floats
    unexplained: float
    unlikely: float


_PLACES = {Cause.SIGN: 0, Cause.SCALE: 0, Cause.TIMING: 1, Cause.LOAD: 2, Cause.MASS: 3}
"""Index of a cause's value in `_Fit.x`."""


def explanation(
    mechanism: Mechanism, cycles: Sequence[CycleStatistics], allowed: Allowed
) -> TorqueExplanation | None:
    """Explanation of the torque residual in gait cycles; None if it is small, or with too few samples."""
    speed = float(np.mean([one.direction * TURN / one.moving_s for one in cycles]))
    curves = _curves_of([one.torque_profile for one in cycles], _body_torques(mechanism, speed))
    if curves is None or not curves.size_nm > 0.0:
        return None
    if not _inner(curves.measured, curves.measured) > (_LEAST_FACTOR * curves.size_nm) ** 2:
        return None  # the torque does not vary: no cause follows from it
    samples = float(np.mean([one.torque_profile.number.sum() for one in cycles]))
    # a sample is taken as the mean over the period before it; the angle of an instant is half a period later
    lag_rad = allowed.lag_s * abs(speed) + 0.5 * TURN / samples
    before = _fit(curves, Cause.UNKNOWN, "", lag_rad, allowed)
    if before is None or before.unexplained <= allowed.unexplained:
        return None
    causes = [(cause, "") for cause in (Cause.SIGN, Cause.SCALE, Cause.TIMING)]
    causes += [(Cause.LOAD, "")] if np.any(curves.lever) else []
    causes += [(Cause.MASS, name) for name in curves.bodies]
    fits = [one for cause in causes if (one := _fit(curves, *cause, lag_rad, allowed))]
    found = [_refined(curves, one) for one in _chosen(before, fits, allowed.unexplained)]
    best = found[0][0] if found else before
    return TorqueExplanation(
        alternatives=tuple(_named(*one) for one in found),
        before=before.unexplained,
        after=best.unexplained,
        after_sigma=best.unexplained / math.sqrt(4.0 * len(curves.measured)),
        limit=allowed.unexplained,
        speed_radps=speed,
    )


def _body_torques(mechanism: Mechanism, speed: float) -> dict[str, Floats]:
    """Torque [N m] that each body adds if its mass doubles; without bodies of little effect."""
    found = body_torques(mechanism)
    least = _LEAST_MASS_EFFECT * at_speed(found.own, speed).std()
    added = zip(mechanism.bodies, at_speed(found.mass, speed), strict=True)
    return {name: torque for name, torque in added if torque.std() > least}


def _fit(curves: _Curves, cause: Cause, body: str, lag_rad: float, allowed: Allowed) -> _Fit | None:
    """Most probable values with a cause, on a grid of crank angles; None if no possible values fit."""
    angles = _GRID_RAD if cause is Cause.TIMING else _GRID_RAD[np.abs(_GRID_RAD) <= lag_rad]
    heavier = curves.bodies[body] if body else 0.0 * curves.lever
    columns = _reals(np.stack([curves.predicted, curves.lever, heavier]))
    turns = np.exp(-1j * np.outer(angles, np.arange(1, len(heavier) + 1)))
    measured = _reals(turns * curves.measured)  # turned back
    # least squares for factor, load and mass with their priors
    sign, is_scaled, is_loaded = (
        -1.0 if cause is Cause.SIGN else 1.0,
        cause in (Cause.SIGN, Cause.SCALE),
        cause is Cause.LOAD,
    )
    middle_n, reach_n = 0.5 * sum(allowed.loads_n), 0.5 * (allowed.loads_n[1] - allowed.loads_n[0])
    mean = np.array([sign, sign * middle_n * (not is_loaded), 0.0])
    load_sigma_n = _ANY_LOAD_N if is_loaded else max(reach_n, 1.0e-6)
    sigma = np.array([_ANY if is_scaled else _SCALE_SIGMA, load_sigma_n, _MASS_SIGMA])
    weight = np.square(allowed.unexplained * curves.size_nm / sigma) / len(heavier)
    values = np.linalg.solve(
        columns @ columns.T + np.diag(weight), columns @ measured.T + (weight * mean)[:, None]
    )
    factor, load_n, mass = values[0], values[1] / values[0], values[2] / values[0]
    rest = np.sqrt(np.square(measured - values.T @ columns).sum(axis=1)) / (np.abs(factor) * curves.size_nm)
    narrow = np.array([not is_scaled, not is_loaded, True])
    beyond = np.square((values - mean[:, None]) / sigma[:, None])[narrow].sum(axis=0)
    unlikely = 0.5 * len(heavier) * np.log(rest**2 + _MODEL_ERROR**2) + 0.5 * beyond
    is_possible = (factor * sign > 0.0) & (mass > _MASS_RANGE[0]) & (mass < _MASS_RANGE[1])
    if not is_possible.any():
        return None
    best = int(np.where(is_possible, unlikely, np.inf).argmin())
    x = np.array([factor[best], angles[best], load_n[best], mass[best]])
    return _Fit(cause, body, x, float(rest[best]), float(unlikely[best]))


def _chosen(before: _Fit, fits: Sequence[_Fit], limit: float) -> list[_Fit]:
    """The most probable cause, and others that explain equally well; empty if none explains enough."""
    found = sorted(
        (one for one in fits if one.unexplained < _PART * before.unexplained), key=lambda one: one.unlikely
    )
    if not found or before.unlikely - found[0].unlikely < SURE_LOG_ODDS:
        return []
    most = limit if found[0].unexplained <= limit else math.inf
    near = found[0].unlikely + SURE_OF_NAME
    return [one for one in found if one.unlikely < near and one.unexplained <= most]


def _refined(curves: _Curves, one: _Fit) -> tuple[_Fit, float]:
    """A fit with its cause's value between the angles of the grid, and the value's standard deviation."""
    factor, angle_rad, load_n, mass = one.x.tolist()
    body = curves.bodies[one.body] if one.body else 0.0 * curves.lever
    base = _turned(curves.predicted + load_n * curves.lever + mass * body, angle_rad)
    slopes = (
        base,
        factor * _slope(base),
        *(factor * _turned(each, angle_rad) for each in (curves.lever, body)),
    )
    place = _PLACES[one.cause]
    column, residual = _reals(slopes[place]), _reals(curves.measured - factor * base)
    step = float(column @ residual) / float(column @ column)
    rest, x = residual - step * column, one.x.copy()
    x[place] += step
    sigma = math.sqrt(float(rest @ rest) / (len(rest) - 1) / float(column @ column))
    unexplained = math.sqrt(float(rest @ rest)) / (abs(float(x[0])) * curves.size_nm)
    return attrs.evolve(one, x=x, unexplained=min(unexplained, one.unexplained)), sigma


def _named(one: _Fit, sigma: float) -> NamedCause:
    """The cause of a fit with its value."""
    return NamedCause(one.cause, float(one.x[_PLACES[one.cause]]), sigma, one.body)
