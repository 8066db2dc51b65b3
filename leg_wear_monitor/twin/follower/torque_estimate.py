"""Foot load, drive friction and sensor lag from the residual of the drive torque (physics.md section 9).

By virtual work, a load F at the toe needs the drive torque -F dy/dtheta. If the load depends on the toe's
height alone, this torque has no mean over a turn, while a constant friction torque has only a mean: the two
are orthogonal. A lag tau changes the torque by -tau dT/dt. The three parameters are estimated by least
squares over each gait cycle and filtered over cycles by their scatter. Drive friction does not load the
joints; the foot load does.
"""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.record import Record
from leg_wear_monitor.twin.follower.state import FRICTION, LOAD

LEAST_SAMPLES = 8
_SMALL = 1.0e-9
# prior standard deviations of the three around 0 [N, N m, s], and random walk per cycle
_UNKNOWN = np.array([1000.0, 10.0, 0.02])
_DRIFT = np.array([1.0, 0.02, 1.0e-4])
_SUDDEN = 3.0  # a deviation of this many standard deviations counts as a sudden change
_ACTS_ABOVE, _CEASES_BELOW = 3.0, 2.0  # standard deviations from 0 at which a load begins and ceases to act


@attrs.frozen(eq=False)
class CycleEstimate:
    """Estimate of one cycle: values (3,), standard deviations (3,), condition number, RMS residual [N m].

    ``left`` is the residual for a load within its bounds; ``values`` are not bounded.
    """

    values: Floats
    sigma: Floats
    condition: float
    left: float


def find(
    sums: Record, correlated: float, loads: tuple[float, float] = (-np.inf, np.inf)
) -> CycleEstimate | None:
    """Least-squares estimate from the sums of a cycle.

    Parameters
    ----------
    sums : Record
        `TORQUE_SUMS` of the cycle.
    correlated : float
        Number of samples per independent sample, because of the low-pass filter.
    loads : (float, float)
        Least and largest possible load minus the acting load [N].

    Returns
    -------
    CycleEstimate or None
        None without enough samples. For a mechanism without a toe, the load is 0 with a standard deviation of
        0. The condition number is that of the normalised regressors, 1 if they are orthogonal.
    """
    gram, along = sums.gram, sums.along
    scale = np.sqrt(np.diag(gram))
    active = scale > _SMALL * max(scale.max(), _SMALL)
    if sums.number < LEAST_SAMPLES or not active[FRICTION]:
        return None
    scaled = gram[np.ix_(active, active)] / np.outer(scale[active], scale[active])
    condition = float(np.linalg.cond(scaled)) ** 0.5
    if not condition < 1.0 / _SMALL:
        return None
    inverse = np.linalg.inv(scaled) / np.outer(scale[active], scale[active])
    values, sigma = np.zeros(3), np.zeros(3)
    values[active] = inverse @ along[active]
    bounded = _bounded(values, gram, along, active, loads)
    square = float(sums.residual_squares - 2.0 * bounded @ along + bounded @ gram @ bounded)
    left = max(square, 0.0) / sums.weight
    sigma[active] = np.sqrt(left * max(correlated, 1.0) * np.diag(inverse))
    return CycleEstimate(values, sigma, condition, float(left**0.5))


def _bounded(
    values: Floats, gram: Floats, along: Floats, active: NDArray[np.bool_], loads: tuple[float, float]
) -> Floats:
    """The least-squares values (3,) with the load within its bounds."""
    load = min(max(float(values[LOAD]), loads[0]), loads[1])
    if load == values[LOAD]:
        return values
    rest = active & (np.arange(3) != LOAD)
    found = np.zeros(3)
    found[LOAD] = load
    found[rest] = np.linalg.solve(gram[np.ix_(rest, rest)], along[rest] - gram[rest, LOAD] * load)
    return found


class LoadEstimate:
    """Load [N], friction [N m] and lag [s], filtered over cycles; each is modelled as a random walk.

    Parameters
    ----------
    limit : float
        Largest possible load [N].
    least : float, optional
        Least possible load [N]; default: minus the largest.

    Attributes
    ----------
    state : (7,) array
        The three values, their variances, and the load that acts on the leg.
    """

    def __init__(self, limit: float, least: float | None = None) -> None:
        self._limit, self._least = limit, -limit if least is None else least
        self.state = np.concatenate([np.zeros(3), _UNKNOWN**2, np.zeros(1)])

    @property
    def values(self) -> Floats:
        """The three values; a view."""
        return self.state[:3]

    @property
    def sigma(self) -> Floats:
        """Their standard deviations (3,)."""
        return np.asarray(np.sqrt(self.state[3:6]))

    @property
    def acting(self) -> float:
        """The load that acts on the leg [N]."""
        return float(self.state[6])

    @property
    def room(self) -> tuple[float, float]:
        """Least and largest possible load minus the acting one [N]."""
        return self._least - self.acting, self._limit - self.acting

    def wait(self, cycles: int) -> None:
        """Let so many cycles pass without an estimate."""
        self.state[3:6] += cycles * _DRIFT**2

    def take(self, found: CycleEstimate, acts: bool) -> None:
        """Update by a cycle's estimate; ``acts``: whether a significant load acts on the leg."""
        values, variance = self.state[:3], self.state[3:6]
        measured = found.values + np.array([self.acting, 0.0, 0.0])
        variance += _DRIFT**2
        surprise = measured - values
        sudden = surprise**2 > _SUDDEN**2 * (variance + found.sigma**2)
        variance += np.where(sudden, surprise**2, 0.0)
        gain = variance / (variance + found.sigma**2 + _SMALL)
        values += gain * surprise
        variance *= 1.0 - gain
        values[LOAD] = np.clip(values[LOAD], self._least, self._limit)
        enough = (_CEASES_BELOW if self.acting else _ACTS_ABOVE) * self.sigma[LOAD]
        self.state[6] = values[LOAD] if acts and abs(values[LOAD]) > enough else 0.0
