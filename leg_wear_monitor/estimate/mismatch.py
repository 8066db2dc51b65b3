"""Explanation of a torque residual: the fewest causes that explain it, and their alternatives.

The file goes from curves of the torque and the timing of a curve over the fit of one hypothesis to the choice
among all hypotheses (`explanation`).
"""

import math
from collections.abc import Iterator, Mapping, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.body_torques import at_speed, body_torques
from leg_wear_monitor.estimate.cause import Cause, NamedCause, TorqueExplanation, beyond_friction
from leg_wear_monitor.estimate.least_squares import jackknife, solved
from leg_wear_monitor.mechanism.arrays import Complex, Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueProfile

# Curves of the drive torque over a crank turn, as Fourier coefficients: to turn a curve is to multiply them.


# Harmonics that are compared: higher ones are chaotic impacts, and beyond the 10 Hz of the comparison's
# low-pass filter at 60 rpm. A slow sensor has the second number.
_HARMONICS = (10, 6)
_LEAST_POINTS = 3  # least number of phases with samples, per harmonic


@attrs.frozen(eq=False)
class TorqueCurves:
    """Mean curves of several gait cycles over the crank angle.

    Attributes
    ----------
    measured, predicted, lever : (h,) array
        Coefficients of the harmonics from the first on: measured torque, predicted torque without a foot
        load [N m], torque per foot load [N m/N].
    bodies : mapping of str to (h,) array
        Change of the predicted torque if the body has double mass [N m].
    means : (3,) array
        Means of measured torque, predicted torque and torque per load.
    """

    measured: Complex
    predicted: Complex
    lever: Complex
    bodies: Mapping[str, Complex]
    means: Floats

    @property
    def predicted_rms_nm(self) -> float:
        """RMS of the predicted torque."""
        return float(np.sqrt(inner(self.predicted, self.predicted) + self.means[1] ** 2))


def curves_of(profiles: Sequence[TorqueProfile], bodies: Mapping[str, Floats]) -> TorqueCurves | None:
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
    return TorqueCurves(
        measured,
        predicted,
        lever,
        {name: np.fft.rfft(curve)[1 : harmonics + 1] / len(curve) for name, curve in bodies.items()},
        found[0],
    )


def inner(one: Complex, other: Complex) -> float:
    """Mean of the product of two curves over a turn."""
    return float(2.0 * (one @ other.conj()).real)


def turned(curve: Complex, angle_rad: float) -> Complex:
    """A curve f as f(x + angle)."""
    return np.asarray(curve * np.exp(1j * angle_rad * np.arange(1, len(curve) + 1)))


def slope(curve: Complex) -> Complex:
    """Derivative of a curve by the crank angle."""
    return np.asarray(curve * 1j * np.arange(1, len(curve) + 1))


def values_of(curve: Complex, points: int) -> Floats:
    """Values (points,) of a curve at equal steps of the crank angle."""
    angle = 2.0 * np.pi * np.arange(points) / points
    harmonics = np.arange(1, len(curve) + 1)
    return np.asarray(2.0 * (np.exp(1j * np.outer(angle, harmonics)) @ curve).real)


# Lag of the torque or offset of the crank: both turn the torque's curve, a lag by an angle that grows with
# the speed, an offset by the same angle at any speed.


@attrs.frozen
class TimingBySpeed:
    """Regression of the angle by which a torque is turned on the speed of the crank: offset - lag * speed.

    Attributes
    ----------
    sums : tuple of float
        Sums of weights, and of weights times the speed, its square, the angle, speed times angle, and the
        angle's square.
    """

    sums: tuple[float, float, float, float, float, float] = (0.0,) * 6

    def with_cycle(
        self, angle_rad: float, speed: float, sigma_rad: float = 1.0, forgetting: float = 1.0
    ) -> "TimingBySpeed":
        """Regression with one more gait cycle; earlier ones lose weight by the factor `forgetting`."""
        x, y, w = speed, angle_rad, sigma_rad**-2.0
        new = (w, w * x, w * x * x, w * y, w * x * y, w * y * y)
        a, b, c, d, e, f = (forgetting * one + other for one, other in zip(self.sums, new, strict=True))
        return TimingBySpeed((a, b, c, d, e, f))

    @property
    def split(self) -> tuple[NamedCause, NamedCause] | None:
        """Lag, and offset of the crank, with standard deviations from `sigma_rad`; None at a single speed."""
        w, x, xx, y, xy, _ = self.sums
        size = w * xx - x * x
        if not size > 0.0:
            return None
        lag = NamedCause(Cause.LAG, (x * y - w * xy) / size, (w / size) ** 0.5)
        return lag, NamedCause(Cause.CRANK_OFFSET, (xx * y - x * xy) / size, (xx / size) ** 0.5)

    @property
    def square(self) -> float:
        """Sum of squared residuals, in standard deviations of the angles."""
        found = self.split
        _, _, _, y, xy, yy = self.sums
        return max(yy - found[1].value * y + found[0].value * xy, 0.0) if found else 0.0


# Fit of one hypothesis: measured = factor * (predicted + load + mass) at a shifted crank angle + constant.


# angles that are tried, every half degree, from 0 to half a turn and then from minus half a turn to 0
_GRID_RAD = (np.arange(720) / 720 + 0.5) % 1.0 * TURN - 0.5 * TURN
_MASS_RANGE = (-0.9, 4.0)  # possible error of a body's mass, as a fraction of it
_POINTS, _SECTORS = 64, 8  # points of a turn; sectors of it for the jackknife, each left out once
_LEAST_CYCLES = 6  # gait cycles to separate offset and lag
_SURE_SIGMAS = 3.0  # an offset and a lag are both named from so many standard deviations
# Offset and lag are separated if the angle is at least so many standard deviations of the offset.
_RESOLVED_SIGMAS = 6.0


@attrs.frozen(kw_only=True)
class Hypothesis:
    """Assumed causes of a torque residual.

    Attributes
    ----------
    sign : int
        -1 if the sign is reversed.
    is_scaled, is_turned, is_loaded : bool
        True if the factor differs from 1, the crank angle by more than a usual lag, and the foot load is out
        of its bounds.
    body : str
        Body whose mass differs from the mechanism file; empty for none.
    """

    sign: int = 1
    is_scaled: bool = False
    is_turned: bool = False
    is_loaded: bool = False
    body: str = ""

    @property
    def size(self) -> int:
        """Number of causes."""
        return (self.sign < 0) + self.is_scaled + self.is_turned + self.is_loaded + bool(self.body)


@attrs.frozen(eq=False)
class Fit:
    """Best-fitting values of a hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
    factor, angle_rad, load_n, mass : float
        Factor on the torque, turned angle, foot load, and error of the body's mass as a fraction of it.
    unexplained : float
        RMS of the residual, as a fraction of the RMS of the scaled prediction.
    free : tuple of bool
        True if each of the four values is neither fixed nor at a bound.
    """

    hypothesis: Hypothesis
    factor: float
    angle_rad: float
    load_n: float
    mass: float
    unexplained: float
    free: tuple[bool, bool, bool, bool]


def fit(
    curves: TorqueCurves, hypothesis: Hypothesis, angle_rad: float, loads_n: tuple[float, float]
) -> Fit | None:
    """Fit a hypothesis by least squares on a grid of crank angles; None if no possible values fit.

    Parameters
    ----------
    curves : TorqueCurves
    hypothesis : Hypothesis
    angle_rad : float
        Largest turned angle of a leg without a fault.
    loads_n : (float, float)
        Range of foot loads without a fault [N].
    """
    angles = _GRID_RAD if hypothesis.is_turned else _GRID_RAD[np.abs(_GRID_RAD) <= angle_rad]
    columns = np.stack([curves.predicted, curves.lever, *_body_curve(curves, hypothesis)])
    gram = np.array([[inner(one, other) for other in columns] for one in columns])
    turn = np.exp(1j * np.outer(angles, np.arange(1, columns.shape[1] + 1)))
    # products of the turned columns with the measured curve, (angles, columns)
    along = 2.0 * ((turn[:, None, :] * columns) @ curves.measured.conj()).real
    square, size, best = inner(curves.measured, curves.measured), curves.predicted_rms_nm, None
    for load in _fixed_loads(hypothesis, loads_n, has_toe=gram[1, 1] > 0.0):
        found = _fits_of_angles(gram, along, square, hypothesis, load, loads_n)
        at = int(found[0].argmin())
        residual, factor, force, mass = (float(row[at]) for row in found)
        if math.isfinite(residual) and (best is None or residual < best[0]):
            best = residual, factor, force, mass, at, load is None
    if best is None:
        return None
    residual, factor, force, mass, at, is_free = best
    angle = float(angles[at])
    is_inside = hypothesis.is_turned or abs(angle) < 0.99 * float(np.abs(angles).max())
    free = (hypothesis.is_scaled, is_inside, is_free, bool(hypothesis.body))
    return Fit(hypothesis, factor, angle, force, mass, _fraction(residual, factor, size), free)


def _body_curve(curves: TorqueCurves, hypothesis: Hypothesis) -> list[Complex]:
    return [curves.bodies[hypothesis.body]] if hypothesis.body else []


def _fixed_loads(
    hypothesis: Hypothesis, loads_n: tuple[float, float], *, has_toe: bool
) -> tuple[float | None, ...]:
    """Values to which the foot load is fixed in turn; None leaves it free."""
    if not has_toe:
        return (0.0,)
    return (None,) if hypothesis.is_loaded else (None, *loads_n)


def _fits_of_angles(
    gram: Floats,
    along: Floats,
    square: float,
    hypothesis: Hypothesis,
    load: float | None,
    loads: tuple[float, float],
) -> Floats:
    """Best fit at each of G angles: sum of squares (infinite if impossible), factor, load and mass (4, G).

    The unknowns are the factors on the columns: factor, factor * load, factor * mass. A fixed load joins the
    lever to the prediction; a fixed factor (the sign) leaves the others.
    """
    basis = np.eye(len(gram))
    if load is not None:
        basis[0, 1] = load
        basis = np.delete(basis, 1, axis=0)
    gram, along = basis @ gram @ basis.T, along @ basis.T
    values = np.empty_like(along)
    if hypothesis.is_scaled:
        values[:] = np.linalg.solve(gram, along.T).T
    else:
        values[:, 0] = hypothesis.sign
        remaining = along[:, 1:] - hypothesis.sign * gram[0, 1:]
        values[:, 1:] = np.linalg.solve(gram[1:, 1:], remaining.T).T
    square_of = square - 2.0 * (values * along).sum(axis=1) + ((values @ gram) * values).sum(axis=1)
    factor = values[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        force = values[:, 1] / factor if load is None else np.full(len(factor), load)
        mass = values[:, -1] / factor if hypothesis.body else np.zeros(len(factor))
    possible = (factor * hypothesis.sign > 0.0) & (mass > _MASS_RANGE[0]) & (mass < _MASS_RANGE[1])
    if load is None and not hypothesis.is_loaded:
        possible &= (force >= loads[0]) & (force <= loads[1])
    return np.stack([np.where(possible, np.maximum(square_of, 0.0), np.inf), factor, force, mass])


def _fraction(square: float, factor: float, size_nm: float) -> float:
    """RMS of a residual over the RMS of the scaled prediction; infinite without a prediction."""
    return math.sqrt(square) / (abs(factor) * size_nm) if factor and size_nm else math.inf


@attrs.frozen(eq=False)
class Refined:
    """A fit between the angles of the grid, with standard deviations.

    Attributes
    ----------
    fit : Fit
    sigma : (float, float, float, float)
        Standard deviations of factor, angle, load and mass; 0 for a fixed value.
    unexplained_sigma : float
    constant_nm, constant_sigma_nm : float
        Constant torque in addition to the prediction.
    """

    fit: Fit
    sigma: tuple[float, float, float, float]
    unexplained_sigma: float
    constant_nm: float
    constant_sigma_nm: float


def refined(curves: TorqueCurves, one: Fit) -> Refined:
    """Refine a fit by one Gauss-Newton step; standard deviations by a jackknife over eighths of a turn."""
    body = curves.bodies[one.hypothesis.body] if one.hypothesis.body else 0.0 * curves.lever
    base = turned(curves.predicted + one.load_n * curves.lever + one.mass * body, one.angle_rad)
    lever, heavier = turned(curves.lever, one.angle_rad), turned(body, one.angle_rad)
    derivatives = (base, one.factor * slope(base), one.factor * lever, one.factor * heavier)
    # the factor of a reversed torque is refined, too, because it is reported
    kept = np.flatnonzero((one.free[0] or one.hypothesis.sign < 0, *one.free[1:]))
    residual = values_of(curves.measured - one.factor * base, _POINTS)
    matrix = np.stack([np.ones(_POINTS), *(values_of(derivatives[i], _POINTS) for i in kept)], axis=1)
    *step, remaining = _with_remaining_rms(matrix, residual).tolist()
    sigma = jackknife(lambda some: _with_remaining_rms(matrix[some], residual[some]), _POINTS, _SECTORS)
    values, sigmas = np.array([one.factor, one.angle_rad, one.load_n, one.mass]), np.zeros(4)
    values[kept] += step[1:]
    sigmas[kept] = sigma[1:-1]
    size = abs(values[0]) * curves.predicted_rms_nm
    factor, angle, load, mass = values.tolist()
    better = Fit(one.hypothesis, factor, angle, load, mass, min(remaining / size, one.unexplained), one.free)
    spread = (sigmas[0].item(), sigmas[1].item(), sigmas[2].item(), sigmas[3].item())
    constant = curves.means[0] - factor * (curves.means[1] + load * curves.means[2])
    return Refined(better, spread, float(sigma[-1] / size), float(constant), float(sigma[0]))


def _with_remaining_rms(matrix: Floats, residual: Floats) -> Floats:
    """Coefficients of least squares, and the RMS [N m] of their residual."""
    found = solved(matrix, residual)
    return np.append(found, np.sqrt(np.mean((residual - matrix @ found) ** 2)))


def timing_of(cycles: Sequence[CycleStatistics], best: Fit) -> list[NamedCause]:
    """Offset and lag from gait cycles at several speeds; empty if the speeds do not separate them."""
    timing, speeds = TimingBySpeed(), []
    for one in cycles:
        curves = curves_of([one.torque_profile], {})
        if curves is None:
            continue
        base = best.factor * turned(curves.predicted + best.load_n * curves.lever, best.angle_rad)
        residual, along = curves.measured - base, slope(base)
        speeds.append(one.direction * TURN / one.moving_s)
        timing = timing.with_cycle(best.angle_rad + inner(residual, along) / inner(along, along), speeds[-1])
    found = timing.split
    if len(speeds) < _LEAST_CYCLES or np.ptp(speeds) == 0.0 or found is None:
        return []
    scatter = math.sqrt(timing.square / (len(speeds) - 2))
    lag, offset = (attrs.evolve(one, sigma=one.sigma * scatter) for one in found)
    if _RESOLVED_SIGMAS * offset.sigma > abs(best.angle_rad):
        return []
    most = max(_sureness(offset), _sureness(lag))
    return [one for one in (offset, lag) if _sureness(one) >= min(_SURE_SIGMAS, most)]


def _sureness(one: NamedCause) -> float:
    """Size of a value in standard deviations."""
    return abs(one.value) / one.sigma if one.sigma else math.inf


# The choice among all hypotheses.


_MOST_CAUSES = 3
_LEAST_FACTOR = 1.0e-5  # fraction of the predicted RMS: far below the torque of a leg in a wrong unit
_LARGEST_REMAINDER = 0.5  # more causes may leave at most this fraction of the residual of fewer causes
# alternatives to the best hypothesis may leave so many times as much unexplained, plus an error of the model
_ALTERNATIVE_FACTOR, _MODEL_ERROR = 3.0, 0.02
# bodies whose double mass changes the torque by a smaller fraction of its RMS are not supposed as causes
_LEAST_MASS_EFFECT = 0.02


@attrs.frozen(kw_only=True)
class Allowed:
    """Deviations that a leg without a fault may have.

    Attributes
    ----------
    lag_s : float
        Largest lag of the torque, in both directions.
    loads_n : (float, float)
        Range of the foot load.
    friction_nm : float
        Largest constant torque that counts as friction.
    unexplained : float
        Fraction of the predicted RMS below which a torque counts as predicted.
    """

    lag_s: float
    loads_n: tuple[float, float]
    friction_nm: float
    unexplained: float


def explanation(
    mechanism: Mechanism, cycles: Sequence[CycleStatistics], allowed: Allowed
) -> TorqueExplanation | None:
    """Explanation of the torque residual in gait cycles; None if it is small, or with too few samples."""
    speed = float(np.mean([one.direction * TURN / one.moving_s for one in cycles]))
    curves = curves_of([one.torque_profile for one in cycles], _body_torques(mechanism, speed))
    if curves is None or not curves.predicted_rms_nm > 0.0:
        return None
    if not inner(curves.measured, curves.measured) > (_LEAST_FACTOR * curves.predicted_rms_nm) ** 2:
        return None  # the torque does not vary: no cause follows from it
    samples = float(np.mean([one.torque_profile.number.sum() for one in cycles]))
    # a sample is taken as the mean over the period before it; the angle of an instant is half a period later
    angle = allowed.lag_s * abs(speed) + 0.5 * TURN / samples
    chosen = _chosen(curves, angle, allowed)
    if chosen is None:
        return None
    before, found = chosen
    fits = [refined(curves, one) for one in found]
    best = fits[0] if fits else refined(curves, before)
    friction = math.copysign(best.constant_nm, best.constant_nm * speed * best.fit.factor)
    friction /= abs(best.fit.factor)
    return TorqueExplanation(
        alternatives=tuple(_named_causes(one, cycles) for one in fits),
        before=before.unexplained,
        after=best.fit.unexplained,
        after_sigma=best.unexplained_sigma,
        limit=allowed.unexplained,
        speed_radps=speed,
        bias=beyond_friction(friction, best.constant_sigma_nm / abs(best.fit.factor), allowed.friction_nm),
        cycles=len(cycles),
    )


def _body_torques(mechanism: Mechanism, speed: float) -> dict[str, Floats]:
    """Torque [N m] that each body adds if its mass doubles; without bodies of little effect."""
    found = body_torques(mechanism)
    least = _LEAST_MASS_EFFECT * at_speed(found.own, speed).std()
    added = zip(mechanism.bodies, at_speed(found.mass, speed), strict=True)
    return {name: torque for name, torque in added if torque.std() > least}


def _hypotheses(curves: TorqueCurves) -> Iterator[Hypothesis]:
    """All hypotheses of at most three causes; never both factor and mass, since they look too much alike."""
    loads = (False, True) if np.any(curves.lever) else (False,)
    for sign in (1, -1):
        for turned in (False, True):
            for loaded in loads:
                for scaled, body in ((False, ""), (True, ""), *((False, name) for name in curves.bodies)):
                    one = Hypothesis(
                        sign=sign, is_scaled=scaled, is_turned=turned, is_loaded=loaded, body=body
                    )
                    if one.size <= _MOST_CAUSES:
                        yield one


def _chosen(curves: TorqueCurves, angle_rad: float, allowed: Allowed) -> tuple[Fit, list[Fit]] | None:
    """The fit without a cause, and the fits of the fewest sufficient causes; None if none is needed.

    The list is empty if no hypothesis is much better than the fit without a cause.
    """
    fits: list[list[Fit]] = [[] for _ in range(_MOST_CAUSES + 1)]
    for one in _hypotheses(curves):
        found = fit(curves, one, angle_rad, allowed.loads_n)
        if found is not None:
            fits[one.size].append(found)
    for each in fits:
        each.sort(key=lambda one: one.unexplained)
    # add causes while the torque residual is above its limit, and more causes leave half of it or less
    best = [each[0].unexplained if each else math.inf for each in fits]
    limit, size = allowed.unexplained, 0
    while best[size] > limit:
        more = [k for k in range(size + 1, len(fits)) if best[k] <= _LARGEST_REMAINDER * best[size]]
        if not more:
            break
        size = more[0]
    before = fits[0][0]
    if size == 0:
        return None if before.unexplained <= limit else (before, [])
    enough = _ALTERNATIVE_FACTOR * best[size] + _MODEL_ERROR
    if best[size] <= limit:
        enough = min(enough, limit)
    return before, [one for one in fits[size] if one.unexplained <= enough]


def _named_causes(one: Refined, cycles: Sequence[CycleStatistics]) -> tuple[NamedCause, ...]:
    """The causes of a fit."""
    found, of = one.fit, one.fit.hypothesis
    factor_sigma, angle_sigma, load_sigma, mass_sigma = one.sigma
    causes = []
    if of.sign < 0:
        causes.append(NamedCause(Cause.SIGN, found.factor, factor_sigma))
    if of.is_scaled:
        causes.append(NamedCause(Cause.SCALE, abs(found.factor), factor_sigma))
    if of.is_turned:
        together = NamedCause(Cause.TIMING, found.angle_rad, angle_sigma)
        causes += timing_of(cycles, found) or [together]
    if of.is_loaded:
        causes.append(NamedCause(Cause.LOAD, found.load_n, load_sigma))
    if of.body:
        causes.append(NamedCause(Cause.MASS, found.mass, mass_sigma, of.body))
    return tuple(causes)
