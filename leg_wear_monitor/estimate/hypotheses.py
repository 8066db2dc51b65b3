"""Fit of a hypothesis: measured = factor * (predicted + load + mass) at another crank angle + constant.

Crank offset and torque lag differ by how the turned angle changes with the speed of the crank.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import NamedCause
from leg_wear_monitor.estimate.least_squares import jackknife, solved
from leg_wear_monitor.estimate.timing_by_speed import TimingBySpeed
from leg_wear_monitor.estimate.torque_curves import (
    Complex,
    TorqueCurves,
    curves_of,
    inner,
    slope,
    turned,
    values_of,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.statistics import CycleStatistics

_ANGLES = (np.arange(720) / 720 + 0.5) % 1.0 * TURN - 0.5 * TURN
_MASSES = (-0.9, 4.0)  # possible fractions by which a body's mass is off
_POINTS, _SECTORS = 64, 8  # of a turn; each sector is left out once
_LEAST_CYCLES = 6
_SURE = 3.0  # standard deviations of an offset or a lag beside the other
_RESOLVED = 6.0  # standard deviations of the offset by which an offset and a lag of the same angle differ


@attrs.frozen(kw_only=True)
class Hypothesis:
    """What is supposed to be wrong.

    Attributes
    ----------
    sign : int
        -1 if the sign is reversed.
    is_scaled, is_turned, is_loaded : bool
        Whether the factor differs from 1, the crank angle by more than a usual lag, and the foot load is out
        of its bounds.
    body : str
        Body whose mass is another; empty if none is.
    """

    sign: int = 1
    is_scaled: bool = False
    is_turned: bool = False
    is_loaded: bool = False
    body: str = ""

    @property
    def size(self) -> int:
        """Number of things that are wrong."""
        return (self.sign < 0) + self.is_scaled + self.is_turned + self.is_loaded + bool(self.body)


@attrs.frozen(eq=False)
class Fit:
    """Best values of a hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
    factor, angle_rad, load_n, mass : float
        The mass is the fraction by which that of the hypothesis' body is larger.
    unexplained : float
        RMS of what remains, as a fraction of that of the scaled prediction.
    free : tuple of bool
        Which of the four are not fixed, nor at a bound.
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
    """Least-squares fit on a grid of crank angles; None if no possible values fit.

    Parameters
    ----------
    curves : TorqueCurves
    hypothesis : Hypothesis
    angle_rad : float
        Largest turned angle without a fault.
    loads_n : (float, float)
        Foot loads without a fault.
    """
    angles = _ANGLES if hypothesis.is_turned else _ANGLES[np.abs(_ANGLES) <= angle_rad]
    columns = np.stack([curves.predicted, curves.lever, *_body(curves, hypothesis)])
    gram = np.array([[inner(one, other) for other in columns] for one in columns])
    turn = np.exp(1j * np.outer(angles, np.arange(1, columns.shape[1] + 1)))
    along = 2.0 * ((turn[:, None, :] * columns) @ curves.measured.conj()).real
    square, size, best = inner(curves.measured, curves.measured), curves.predicted_rms_nm, None
    for load in _loads(hypothesis, loads_n, has_toe=gram[1, 1] > 0.0):
        found = _least(gram, along, square, hypothesis, load, loads_n)
        at = int(found[0].argmin())
        rest, factor, force, mass = (float(row[at]) for row in found)
        if math.isfinite(rest) and (best is None or rest < best[0]):
            best = rest, factor, force, mass, at, load is None
    if best is None:
        return None
    rest, factor, force, mass, at, is_free = best
    angle = float(angles[at])
    is_inside = hypothesis.is_turned or abs(angle) < 0.99 * float(np.abs(angles).max())
    free = (hypothesis.is_scaled, is_inside, is_free, bool(hypothesis.body))
    return Fit(hypothesis, factor, angle, force, mass, _fraction(rest, factor, size), free)


def _body(curves: TorqueCurves, hypothesis: Hypothesis) -> list[Complex]:
    return [curves.bodies[hypothesis.body]] if hypothesis.body else []


def _loads(
    hypothesis: Hypothesis, loads_n: tuple[float, float], *, has_toe: bool
) -> tuple[float | None, ...]:
    """Foot loads to fix; None: a free one."""
    if not has_toe:
        return (0.0,)
    return (None,) if hypothesis.is_loaded else (None, *loads_n)


def _least(
    gram: Floats,
    along: Floats,
    square: float,
    hypothesis: Hypothesis,
    load: float | None,
    loads: tuple[float, float],
) -> Floats:
    """Residual square (infinite where values are impossible), factor, load and mass (4, G) of each angle."""
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
        rest = along[:, 1:] - hypothesis.sign * gram[0, 1:]
        values[:, 1:] = np.linalg.solve(gram[1:, 1:], rest.T).T
    square_of = square - 2.0 * (values * along).sum(axis=1) + ((values @ gram) * values).sum(axis=1)
    factor = values[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        force = values[:, 1] / factor if load is None else np.full(len(factor), load)
        mass = values[:, -1] / factor if hypothesis.body else np.zeros(len(factor))
    possible = (factor * hypothesis.sign > 0.0) & (mass > _MASSES[0]) & (mass < _MASSES[1])
    if load is None and not hypothesis.is_loaded:
        possible &= (force >= loads[0]) & (force <= loads[1])
    return np.stack([np.where(possible, np.maximum(square_of, 0.0), np.inf), factor, force, mass])


def _fraction(square: float, factor: float, size_nm: float) -> float:
    return math.sqrt(square) / (abs(factor) * size_nm) if factor and size_nm else math.inf


@attrs.frozen(eq=False)
class Refined:
    """A fit with standard deviations of (factor, angle, load, mass), and of what remains unexplained."""

    fit: Fit
    sigma: tuple[float, float, float, float]
    unexplained_sigma: float
    constant_nm: float
    constant_sigma_nm: float


def refined(curves: TorqueCurves, one: Fit) -> Refined:
    """One linear step from the grid, with standard deviations from leaving out each eighth of a turn."""
    body = curves.bodies[one.hypothesis.body] if one.hypothesis.body else 0.0 * curves.lever
    base = turned(curves.predicted + one.load_n * curves.lever + one.mass * body, one.angle_rad)
    lever, heavier = turned(curves.lever, one.angle_rad), turned(body, one.angle_rad)
    given = (base, one.factor * slope(base), one.factor * lever, one.factor * heavier)
    # of a reversed torque the factor is worth knowing, too
    kept = np.flatnonzero((one.free[0] or one.hypothesis.sign < 0, *one.free[1:]))
    rest = values_of(curves.measured - one.factor * base, _POINTS)
    matrix = np.stack([np.ones(_POINTS), *(values_of(given[i], _POINTS) for i in kept)], axis=1)
    *step, left = _with_rest(matrix, rest).tolist()
    sigma = jackknife(lambda some: _with_rest(matrix[some], rest[some]), _POINTS, _SECTORS)
    values, sigmas = np.array([one.factor, one.angle_rad, one.load_n, one.mass]), np.zeros(4)
    values[kept] += step[1:]
    sigmas[kept] = sigma[1:-1]
    size = abs(values[0]) * curves.predicted_rms_nm
    factor, angle, load, mass = values.tolist()
    better = Fit(one.hypothesis, factor, angle, load, mass, min(left / size, one.unexplained), one.free)
    spread = (sigmas[0].item(), sigmas[1].item(), sigmas[2].item(), sigmas[3].item())
    constant = curves.means[0] - factor * (curves.means[1] + load * curves.means[2])
    return Refined(better, spread, float(sigma[-1] / size), float(constant), float(sigma[0]))


def _with_rest(matrix: Floats, rest: Floats) -> Floats:
    """Coefficients, and the RMS [N m] of what remains."""
    found = solved(matrix, rest)
    return np.append(found, np.sqrt(np.mean((rest - matrix @ found) ** 2)))


def timing_of(cycles: Sequence[CycleStatistics], best: Fit) -> list[NamedCause]:
    """Offset and lag from gait cycles at several speeds; none while the speeds are too similar.

    The angle of a cycle is offset - lag * speed.
    """
    timing, speeds = TimingBySpeed(), []
    for one in cycles:
        curves = curves_of([one.torque_profile], {})
        if curves is None:
            continue
        base = best.factor * turned(curves.predicted + best.load_n * curves.lever, best.angle_rad)
        rest, along = curves.measured - base, slope(base)
        speeds.append(one.direction * TURN / one.moving_s)
        timing = timing.with_angle(best.angle_rad + inner(rest, along) / inner(along, along), speeds[-1])
    found = timing.split
    if len(speeds) < _LEAST_CYCLES or np.ptp(speeds) == 0.0 or found is None:
        return []
    scatter = math.sqrt(timing.square / (len(speeds) - 2))
    lag, offset = (attrs.evolve(one, sigma=one.sigma * scatter) for one in found)
    if _RESOLVED * offset.sigma > abs(best.angle_rad):
        return []
    most = max(_sureness(offset), _sureness(lag))
    return [one for one in (offset, lag) if _sureness(one) >= min(_SURE, most)]


def _sureness(one: NamedCause) -> float:
    """Size of a value in standard deviations."""
    return abs(one.value) / one.sigma if one.sigma else math.inf
