"""How the growth of each joint's clearance depends on all joints' clearances, fitted to simulated lives.

    ln(growth_k / x_k) = a_k + sum over j of B_kj ln(c_j / c_j0)

with x_k the factor on joint k's wear coefficient, c_j the mean clearances and c_j0 those when new: a power
law. What the lives are off a law that does not know them is its sigma.
"""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats

PRIOR_SIGMA = 1.0  # of B beforehand: growth may double or halve where a clearance doubles
_SCATTER = 0.1  # of ln growth, by which the prior is weighed against the lives
LEAST_LIVES = 4  # with coefficients that differ, for the law to be judged
_STEPS = 12  # from new to the limit


@attrs.frozen(eq=False)
class SimulatedLife:
    """A life as the law needs it; p points, k joints.

    Attributes
    ----------
    factor : (k,) array
        On the joints' wear coefficients.
    cycles : (p,) array
    clearance_m, growth_m_per_cycle : (p, k) arrays
    """

    factor: Floats
    cycles: Floats
    clearance_m: Floats
    growth_m_per_cycle: Floats


@attrs.frozen(eq=False)
class GrowthLaw:
    """Growth over all clearances, relative to that of the same leg at others.

    Attributes
    ----------
    coupling : (k, k) array
        B: of ln growth of the row's joint over ln clearance of the column's.
    fresh_m, widest_m : (k,) arrays
        Clearances when new, and the largest that lives have seen: beyond both, growth stays as it is there.
    sigma : (k,) array
        Standard deviation of what ln growth is off.
    lives : int
        It was fitted to.
    """

    coupling: Floats
    fresh_m: Floats
    widest_m: Floats
    sigma: Floats
    lives: int = 0

    def log_growth(self, clearance_m: Floats) -> Floats:
        """Logarithm of growth (k, n) at clearances (k, n), but for a_k."""
        in_range = np.clip(clearance_m, self.fresh_m[:, None], self.widest_m[:, None])
        return np.asarray(self.coupling @ np.log(in_range / self.fresh_m[:, None]))


def no_law(fresh_m: Floats, sigma: float) -> GrowthLaw:
    """Growth that stays as it is, off by a standard deviation of its logarithm."""
    k = len(fresh_m)
    return GrowthLaw(np.zeros((k, k)), fresh_m, np.full(k, np.inf), np.full(k, sigma))


def fitted_law(lives: Sequence[SimulatedLife], sigma: float) -> GrowthLaw:
    """The law of simulated lives that all begin with the same clearances.

    Parameters
    ----------
    lives : sequence of SimulatedLife
    sigma : float
        Standard deviation of ln growth where there are too few lives to tell it.
    """
    fresh = lives[0].clearance_m[0]
    coupling, _ = _coefficients(lives, fresh)
    widest = np.max([life.clearance_m.max(axis=0) for life in lives], axis=0)
    return GrowthLaw(coupling, fresh, widest, _sigma(lives, sigma), len(lives))


def _sigma(lives: Sequence[SimulatedLife], unknown: float) -> Floats:
    """What lives are off, of each joint; where they are too few, or it does not open, what is given."""
    if len(lives) < LEAST_LIVES:
        return np.full(len(lives[0].factor), unknown)
    off = left_over(lives)
    is_known = np.isfinite(off)
    square = np.square(off, where=is_known, out=np.zeros_like(off)).sum(axis=0)
    return np.where(is_known.any(axis=0), np.sqrt(square / np.maximum(is_known.sum(axis=0), 1)), unknown)


def left_over(lives: Sequence[SimulatedLife]) -> Floats:
    """Logarithm (n, k) of the cycles each life took to its end, over those by the law of all the others.

    NaN where a joint has not opened.
    """
    fresh, off = lives[0].clearance_m[0], []
    for i, life in enumerate(lives):
        coupling, level = _coefficients([*lives[:i], *lives[i + 1 :]], fresh)
        law = GrowthLaw(coupling, fresh, np.full(len(fresh), np.inf), np.zeros(len(fresh)))
        base = life.factor * np.exp(level)
        expected = cycles_to(law, fresh[:, None], base[:, None], life.clearance_m[-1])
        opened = np.isfinite(expected[:, 0]) & (expected[:, 0] > 0.0)
        off.append(np.log(np.where(opened, life.cycles[-1] / np.where(opened, expected[:, 0], 1.0), np.nan)))
    return np.array(off)


def _coefficients(lives: Sequence[SimulatedLife], fresh_m: Floats) -> tuple[Floats, Floats]:
    """B (k, k) and a (k,), of ridge regression."""
    x = np.log(np.concatenate([life.clearance_m for life in lives]) / fresh_m)
    growth = np.concatenate([life.growth_m_per_cycle / life.factor for life in lives])
    prior = (_SCATTER / PRIOR_SIGMA) ** 2 * np.eye(x.shape[1])
    coupling, level = np.zeros((x.shape[1],) * 2), np.zeros(x.shape[1])
    for k in range(x.shape[1]):
        grows = growth[:, k] > 0.0
        if not grows.any():
            level[k] = -np.inf
            continue
        y, own = np.log(growth[grows, k]), x[grows]
        centred = own - own.mean(axis=0)
        coupling[k] = np.linalg.solve(centred.T @ centred + prior, centred.T @ (y - y.mean()))
        level[k] = y.mean() - own.mean(axis=0) @ coupling[k]
    return coupling, level


def cycles_to(law: GrowthLaw, clearance_m: Floats, base_m: Floats, limit_m: Floats) -> Floats:
    """Gait cycles until each joint reaches its limit, all joints growing together.

    A joint that is at its limit stays there: its part is replaced before it opens further.

    Parameters
    ----------
    law : GrowthLaw
    clearance_m : (k, n) array
        Of n legs.
    base_m : (k, n) array
        exp(a) x: growth a cycle when all is new.
    limit_m : (k,) array

    Returns
    -------
    (k, n) array
        Infinite where a clearance does not grow; 0 where it is at its limit.
    """
    limit = limit_m[:, None]
    step = np.maximum(limit - law.fresh_m[:, None], 1.0e-3 * limit) / _STEPS
    clearance = np.minimum(clearance_m, limit)
    ends = np.where(clearance_m >= limit, 0.0, np.inf)
    going, spent = (clearance_m < limit) & (base_m > 0.0), np.zeros(clearance_m.shape[1])
    base = np.where(going, base_m, 0.0)
    while going.any():
        # Heun's method; the joint that goes fastest says how far
        first = base * np.exp(law.log_growth(clearance))
        fastest = (first / step).max(axis=0)
        cycles = np.divide(1.0, fastest, out=np.zeros_like(fastest), where=fastest > 0.0)
        ahead = np.minimum(clearance + cycles * first, limit)
        growth = 0.5 * (first + base * np.exp(law.log_growth(ahead)))
        opened = clearance + cycles * growth
        reached = going & (opened >= limit)
        within = np.divide(limit - clearance, growth, out=np.zeros_like(growth), where=reached)
        ends = np.where(reached, spent + within, ends)
        clearance, spent = np.minimum(opened, limit), spent + cycles
        going &= ~reached
        base = np.where(going, base, 0.0)
    return ends
