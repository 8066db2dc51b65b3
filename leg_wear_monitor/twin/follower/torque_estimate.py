"""Foot load, friction and the sensor's lag from what measured and predicted drive torque differ by.

By virtual work a load F at the toe asks the drive for -F dy/dtheta. Over a whole turn a load that depends on
the toe's height alone has no mean in it, while a constant friction torque is nothing but mean: neither can be
taken for the other. A torque that comes late looks like minus its own derivative. The three follow from one
torque over a gait cycle by least squares, and settle over cycles as their scatter allows. Friction in the
drive makes no force in the joints; the load does.
"""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.record import Record
from leg_wear_monitor.twin.follower.state import FRICTION, LOAD

_LEAST_SAMPLES = 8
_SMALL = 1.0e-9
# what the three are held to be before anything is measured: 0 give or take this [N, N m, s], and by how much
# they may drift in a cycle
_UNKNOWN = np.array([1000.0, 10.0, 0.02])
_DRIFT = np.array([1.0, 0.02, 1.0e-4])
_SUDDEN = 3.0  # standard deviations beyond which something has changed
_BELIEVED, _DOUBTED = 3.0, 2.0  # standard deviations from 0 at which a load begins and ceases to act


@attrs.frozen(eq=False)
class CycleEstimate:
    """What a cycle says: values (3,), their standard deviations, condition number, RMS of the rest [N m].

    The rest is that for a load within its bounds; the values are what the torque says, bounded or not.
    """

    values: Floats
    sigma: Floats
    condition: float
    left: float


def find(
    sums: Record, correlated: float, loads: tuple[float, float] = (-np.inf, np.inf)
) -> CycleEstimate | None:
    """Least squares from the sums of a cycle; None without enough samples.

    Parameters
    ----------
    sums : Record
        `TORQUE_SUMS` of the cycle.
    correlated : float
        How many samples count as one, since all went through a low-pass.
    loads : (float, float)
        Least and largest load that there may be, less the load that acts [N].

    Returns
    -------
    CycleEstimate
        Without a load's signature (a mechanism without toe), 0 for the load, known exactly. The condition
        number is that of the torques scaled to one size: 1 where none looks like another.
    """
    gram, along = sums.gram, sums.along
    scale = np.sqrt(np.diag(gram))
    seen = scale > _SMALL * max(scale.max(), _SMALL)
    if sums.number < _LEAST_SAMPLES or not seen[FRICTION]:
        return None
    scaled = gram[np.ix_(seen, seen)] / np.outer(scale[seen], scale[seen])
    condition = float(np.linalg.cond(scaled)) ** 0.5
    if not condition < 1.0 / _SMALL:
        return None
    inverse = np.linalg.inv(scaled) / np.outer(scale[seen], scale[seen])
    values, sigma = np.zeros(3), np.zeros(3)
    values[seen] = inverse @ along[seen]
    bounded = _bounded(values, gram, along, seen, loads)
    square = float(sums.residual_squares - 2.0 * bounded @ along + bounded @ gram @ bounded)
    left = max(square, 0.0) / sums.number
    sigma[seen] = np.sqrt(left * max(correlated, 1.0) * np.diag(inverse))
    return CycleEstimate(values, sigma, condition, float(left**0.5))


def _bounded(
    values: Floats, gram: Floats, along: Floats, seen: NDArray[np.bool_], loads: tuple[float, float]
) -> Floats:
    """The best values with a load within bounds."""
    load = min(max(float(values[LOAD]), loads[0]), loads[1])
    if load == values[LOAD]:
        return values
    rest = seen & (np.arange(3) != LOAD)
    found = np.zeros(3)
    found[LOAD] = load
    found[rest] = np.linalg.solve(gram[np.ix_(rest, rest)], along[rest] - gram[rest, LOAD] * load)
    return found


class LoadEstimate:
    """Load [N], friction [N m] and lag [s] as they settle over cycles; each a random walk.

    Parameters
    ----------
    limit : float
        Largest load believed [N].
    least : float, optional
        Least load that there may be [N]; minus the largest if not given.

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
        """Least and largest load that there may be beside the one that acts [N]."""
        return self._least - self.acting, self._limit - self.acting

    def take(self, found: CycleEstimate, acts: bool) -> None:
        """Take in a cycle's estimate; ``acts`` whether a load that is believed shall act on the leg."""
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
        enough = (_DOUBTED if self.acting else _BELIEVED) * self.sigma[LOAD]
        self.state[6] = values[LOAD] if acts and abs(values[LOAD]) > enough else 0.0
