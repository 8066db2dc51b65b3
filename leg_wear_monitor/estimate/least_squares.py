"""Damped Gauss-Newton for least squares, and the scatter of its result.

A prior is a further row of the residual; an impossible point has an infinite residual.
"""

from collections.abc import Callable
from typing import Generic, TypeVar

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats

DATA_ERRORS = (LegWearError, ArithmeticError, np.linalg.LinAlgError)
"""Exceptions that measured data can make an estimator raise. Any other is a fault of this package."""

_ROUNDS = 30
_SHORTEST = 0.001  # smallest tried fraction of a step
_LESS = 1.0e-9  # fraction by which the square must decrease
_SMALL = 1.0e-9  # singular values below this fraction of the largest count as 0


@attrs.frozen(eq=False)
class Point:
    """A model at some values of its parameters.

    Attributes
    ----------
    rest : (m,) array
        Residual in standard deviations.
    slopes : callable
        Its derivatives (m, k) by the parameters.
    """

    rest: Floats
    slopes: Callable[[], Floats]

    @property
    def square(self) -> float:
        """Sum of the squares of the residual."""
        return float(self.rest @ self.rest)


P = TypeVar("P", bound=Point)


@attrs.frozen(eq=False)
class Solution(Generic[P]):
    """Values (k,) of the parameters with the least square, the model there, and its derivatives (m, k)."""

    x: Floats
    point: P
    slopes: Floats

    @property
    def covariance(self) -> Floats:
        """Covariance (k, k) of the parameters."""
        return np.asarray(np.linalg.inv(self.slopes.T @ self.slopes))


def gauss_newton(
    model: Callable[[Floats], P],
    start: Floats,
    *,
    low: Floats | float = -np.inf,
    high: Floats | float = np.inf,
    longest: Floats | float = np.inf,
    done: Floats | float = 0.0,
) -> Solution[P]:
    """Least square near a start.

    Parameters
    ----------
    model : callable
        The model at values (k,) of its parameters.
    start, low, high : (k,) arrays
        Where to begin, and bounds.
    longest, done : (k,) arrays
        Largest step of each parameter, and the one below which the step was the last.
    """
    x = np.clip(start, low, high)
    point = model(x)
    slopes = point.slopes()
    for _ in range(_ROUNDS):
        # a parameter at its bound stays there; otherwise the others would move as if it had crossed the bound
        downhill = -slopes.T @ point.rest
        free = ~((x <= low) & (downhill < 0.0) | (x >= high) & (downhill > 0.0))
        if not free.any():
            break
        step = np.zeros_like(x)
        step[free] = solved(slopes[:, free], -point.rest)
        gain = slopes @ step
        if float(gain @ gain) < _LESS * point.square:  # predicted decrease of the square
            break
        step /= max(1.0, float(np.max(np.abs(step) / longest)))
        length, moved = 1.0, np.clip(x + step, low, high)
        while not (there := model(moved)).square < (1.0 - _LESS) * point.square:
            length *= 0.5
            if length <= _SHORTEST or np.all(length * np.abs(step) < done):
                return Solution(x, point, slopes)
            moved = np.clip(x + length * step, low, high)
        x, point, slopes = moved, there, there.slopes()
        if np.all(length * np.abs(step) < done):
            break
    return Solution(x, point, slopes)


def solved(columns: Floats, values: Floats) -> Floats:
    """Coefficients (k,) of columns (m, k), which may be of very different size, for values (m,).

    With values (m, n) coefficients (k, n).
    """
    size = np.linalg.norm(columns, axis=0)
    size[size < _SMALL * max(float(size.max()), _SMALL)] = np.inf
    found = np.linalg.lstsq(columns / size, values, rcond=_SMALL)[0]
    return np.asarray((found.T / size).T)


def jackknife(estimate: Callable[[NDArray[np.bool_]], Floats], number: int, parts: int) -> Floats:
    """Standard deviations of an estimate, from leaving out each part of the data in turn.

    Parameters
    ----------
    estimate : callable
        Estimate from the data that are chosen (number,).
    number, parts : int
        Number of data, and of parts of neighbours.
    """
    part = np.arange(number) * parts // max(number, 1)
    found = np.array([estimate(part != i) for i in range(parts)])
    return np.asarray(np.sqrt((parts - 1) * found.var(axis=0)))
