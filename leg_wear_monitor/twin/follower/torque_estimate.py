"""Foot load, frictions and lag of the drive from the residual of its torque (physics.md section 9).

By virtual work, a load F at the toe needs the drive torque -F dy/dtheta. If the load depends on the toe's
height alone, this torque has no mean over a turn, while a constant friction torque has only a mean: the two
are orthogonal. A lag tau changes the torque by -tau dT/dt. A gear loses a fraction of the torque that it
transmits. The four parameters are estimated by least squares over each gait cycle and filtered over cycles by
their scatter. Friction of the drive does not load the joints; the foot load does.
"""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.record import Record
from leg_wear_monitor.twin.follower.state import FRICTION, LOAD, LOAD_FRICTION, REGRESSORS

LEAST_SAMPLES = 8
_SMALL = 1.0e-9
# prior standard deviations of the four around 0 [N, N m, s, -], and random walk per cycle
_UNKNOWN = np.array([1000.0, 10.0, 0.02, 0.2])
_DRIFT = np.array([1.0, 0.02, 1.0e-4, 1.0e-3])
MOST_LOAD_FRICTION = 0.45  # planetary servos have up to 0.31 (config/drives)
_SUDDEN = 3.0  # a deviation of this many standard deviations counts as a sudden change
_ACTS_ABOVE, _CEASES_BELOW = 3.0, 2.0  # standard deviations from 0 at which a load begins and ceases to act


@attrs.frozen(eq=False)
class CycleEstimate:
    """Estimate of one cycle: values (4,), standard deviations (4,), condition number, RMS residual [N m].

    ``left`` is the residual for values within their bounds; ``values`` are not bounded.
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
    values, sigma = np.zeros(REGRESSORS), np.zeros(REGRESSORS)
    values[active] = inverse @ along[active]
    likely = bounded(gram, along, *bounds(loads))
    square = float(sums.residual_squares - 2.0 * likely @ along + likely @ gram @ likely)
    left = max(square, 0.0) / sums.weight
    sigma[active] = np.sqrt(left * max(correlated, 1.0) * np.diag(inverse))
    return CycleEstimate(values, sigma, condition, float(left**0.5))


def bounded(gram: Floats, along: Floats, low: Floats, high: Floats) -> Floats:
    """Values (n,) of least squares within bounds: those out of theirs are set to them, the furthest first.

    Parameters
    ----------
    gram : (n, n) array
        Products of the regressors with each other; zeros for one that is not there, whose value is 0.
    along : (n,) array
        Products of the regressors with what is to be explained.
    low, high : (n,) arrays
    """
    scale = np.sqrt(np.diag(gram))
    free = scale > _SMALL * max(scale.max(), _SMALL)
    values = np.zeros(len(along))
    while free.any():
        by = scale[free]
        rest = (along - gram @ np.where(free, 0.0, values))[free] / by
        values[free] = np.linalg.lstsq(gram[np.ix_(free, free)] / np.outer(by, by), rest, rcond=None)[0] / by
        beyond = np.where(free, np.maximum(np.maximum(low - values, values - high), 0.0), 0.0) * scale
        worst = int(beyond.argmax())
        if not beyond[worst] > 0.0:
            break
        values[worst], free[worst] = min(max(float(values[worst]), low[worst]), high[worst]), False
    return values


def bounds(loads: tuple[float, float]) -> tuple[Floats, Floats]:
    """Least and largest possible values (4,) of load, friction, lag and load friction."""
    low, high = np.full(REGRESSORS, -np.inf), np.full(REGRESSORS, np.inf)
    low[[LOAD, LOAD_FRICTION]] = loads[0], 0.0
    high[[LOAD, LOAD_FRICTION]] = loads[1], MOST_LOAD_FRICTION
    return low, high


class LoadEstimate:
    """Load [N], friction [N m], lag [s] and load friction, filtered over cycles; each is a random walk.

    Parameters
    ----------
    limit : float
        Largest possible load [N].
    least : float, optional
        Least possible load [N]; default: minus the largest.

    Attributes
    ----------
    state : (9,) array
        The four values, their variances, and the load that acts on the leg.
    """

    def __init__(self, limit: float, least: float | None = None) -> None:
        self._limit, self._least = limit, -limit if least is None else least
        self.state = np.concatenate([np.zeros(REGRESSORS), _UNKNOWN**2, np.zeros(1)])

    @property
    def values(self) -> Floats:
        """The four values; a view."""
        return self.state[:REGRESSORS]

    @property
    def sigma(self) -> Floats:
        """Their standard deviations (4,)."""
        return np.asarray(np.sqrt(self.state[REGRESSORS:-1]))

    @property
    def acting(self) -> float:
        """The load that acts on the leg [N]."""
        return float(self.state[-1])

    @property
    def room(self) -> tuple[float, float]:
        """Least and largest possible load minus the acting one [N]."""
        return self._least - self.acting, self._limit - self.acting

    def restart_load(self, load_n: float, acts: bool) -> None:
        """Begin with a load of another shape [N], known from a few cycles; ``acts`` as in `take`."""
        self.values[LOAD], self.state[REGRESSORS + LOAD] = load_n, _UNKNOWN[LOAD] ** 2
        self.state[-1] = load_n if acts else 0.0

    def wait(self, cycles: int) -> None:
        """Let so many cycles pass without an estimate."""
        self.state[REGRESSORS:-1] += cycles * _DRIFT**2

    def take(self, found: CycleEstimate, acts: bool) -> None:
        """Update by a cycle's estimate; ``acts``: whether a significant load acts on the leg."""
        values, variance = self.values, self.state[REGRESSORS:-1]
        measured = found.values.copy()
        measured[LOAD] += self.acting
        variance += _DRIFT**2
        surprise = measured - values
        sudden = surprise**2 > _SUDDEN**2 * (variance + found.sigma**2)
        variance += np.where(sudden, surprise**2, 0.0)
        gain = variance / (variance + found.sigma**2 + _SMALL)
        values += gain * surprise
        variance *= 1.0 - gain
        values[LOAD] = np.clip(values[LOAD], self._least, self._limit)
        values[LOAD_FRICTION] = np.clip(values[LOAD_FRICTION], 0.0, MOST_LOAD_FRICTION)
        enough = (_CEASES_BELOW if self.acting else _ACTS_ABOVE) * self.sigma[LOAD]
        self.state[-1] = values[LOAD] if acts and abs(values[LOAD]) > enough else 0.0
