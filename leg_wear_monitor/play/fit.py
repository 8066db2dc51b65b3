"""Fit of the play and of a slow drift to plateaus, robust against pushes that stop short."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.play.plateaus import NORMAL_MAD, Plateaus

_MOST_DEGREE = 3  # of the drift: a slow change with at most two turning points
_A_DEGREE = 4  # plateaus for each further degree
_ROUNDS = 20
_FAR = 3.5  # standard deviations from which a plateau is left out
MANY = 0.25  # fraction of the pushes
_NEAR = 0.25  # of the play: pushes as near to the others differ, none of them is an outlier


@attrs.frozen(eq=False)
class Fit:
    """Play and drift of plateaus.

    Attributes
    ----------
    play_rad, sigma_rad : float
        Signed play: angle on the side 1.0 minus angle on the side -1.0. Its standard deviation from the
        scatter of the plateaus, with Student's few degrees of freedom.
    scatter_rad : float
        Standard deviation of a plateau about the fit.
    drift : (n,) array
        Coefficients of Legendre polynomials over the time of the plateaus.
    used : (m,) array of bool
        Plateaus that count.
    short : int
        Plateaus left out because the angle stopped short of the others.
    """

    play_rad: float
    sigma_rad: float
    scatter_rad: float
    drift: Floats
    begin_s: float
    end_s: float
    used: NDArray[np.bool_]
    short: int

    def drift_at(self, time_s: Floats) -> Floats:
        """Drift [rad] at times within those of the plateaus; constant before and after."""
        return np.asarray(
            np.polynomial.legendre.legval(_scaled(time_s, self.begin_s, self.end_s), self.drift)
        )


def fit_play(found: Plateaus, least_rad: float) -> Fit:
    """Fit play and drift.

    Parameters
    ----------
    found : Plateaus
    least_rad : float
        Standard deviation of a plateau from count and noise: no plateau is left out for less.
    """
    m = len(found.side)
    degree = int(np.clip((m - _A_DEGREE) // _A_DEGREE, 1, _MOST_DEGREE))
    begin, end = float(found.time_s[0]), float(found.time_s[-1])
    basis = np.polynomial.legendre.legvander(_scaled(found.time_s, begin, end), degree)
    columns = np.column_stack([0.5 * found.side, basis])
    used, solution = _robust(columns, found.angle_rad, least_rad)
    residual = found.angle_rad - columns @ solution
    if np.count_nonzero(~used) > MANY * m:
        # two ends on one side, none of which is the rare one
        used = used | (np.abs(residual) < _NEAR * abs(solution[0]))
        solution = _solved(columns[used], found.angle_rad[used], np.ones(int(used.sum())))
        residual = found.angle_rad - columns @ solution
    outward = residual * found.side * np.sign(solution[0])
    x, rest = columns[used], int(used.sum()) - columns.shape[1]
    scatter = float(np.sqrt(np.sum(np.square(residual[used])) / max(rest, 1)))
    # a mean of few values scatters as Student's t: variance rest / (rest - 2)
    few = np.sqrt(rest / (rest - 2.0)) if rest > 2 else np.inf
    unit = float(np.sqrt(np.linalg.pinv(x.T @ x)[0, 0]))
    return Fit(
        float(solution[0]),
        float(few * scatter * unit) if scatter else 0.0,
        scatter,
        solution[1:],
        begin,
        end,
        used,
        int(np.count_nonzero(~used & (outward < 0.0))),
    )


def _robust(columns: Floats, y: Floats, least: float) -> tuple[NDArray[np.bool_], Floats]:
    """Plateaus that count, and the least-squares solution of these; begins with least absolute values."""
    weight = np.ones(len(y))
    solution = np.zeros(columns.shape[1])
    for _ in range(_ROUNDS):
        solution = _solved(columns, y, np.sqrt(weight))
        weight = 1.0 / np.maximum(np.abs(y - columns @ solution), 0.1 * least)
    used = np.ones(len(y), bool)
    for _ in range(_ROUNDS):
        residual = np.abs(y - columns @ solution)
        near = residual <= _FAR * max(NORMAL_MAD * float(np.median(residual)), least)
        solution = _solved(columns[near], y[near], np.ones(int(near.sum())))
        if (near == used).all():
            break
        used = near
    return used, solution


def _solved(columns: Floats, y: Floats, root: Floats) -> Floats:
    return np.asarray(np.linalg.lstsq(columns * root[:, None], y * root, rcond=None)[0])


def _scaled(time_s: Floats, begin: float, end: float) -> Floats:
    return np.asarray(np.clip(2.0 * (time_s - begin) / max(end - begin, 1.0e-9) - 1.0, -1.0, 1.0))
