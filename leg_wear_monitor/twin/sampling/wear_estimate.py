"""Wear of the gait cycles that are not followed, from the blocks before and after, and its standard error.

Each of them counts as the mean of two blocks of its own condition, the one before and the one after; until
that comes, as the one before. Blocks of a condition scatter, because the motion is chaotic and because load
and cadence vary within it: what two neighbours differ by shows how much.
"""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.sampling.condition import Condition

_BATCHES = 4  # of a block's cycles, for its scatter before there are other blocks
_ENOUGH_PAIRS = 3  # of neighbouring blocks, for the scatter between blocks
# of degrees of freedom to differences: two neighbours have a block in common
_OF_DIFFERENCES = 2.0 / 3.0
_SURE = 1.959964  # quantile of 97.5 % of a normal distribution


@attrs.frozen(eq=False)
class Block:
    """Mean of followed gait cycles of one condition.

    Attributes
    ----------
    growth_m : (n, k) array
        Growth of the mean clearances in each of its cycles.
    depth_m : (k, 2, N) array
        Mean wear depth of a cycle.
    """

    growth_m: Floats
    depth_m: Floats

    @property
    def cycles(self) -> int:
        """Number of gait cycles."""
        return len(self.growth_m)

    @property
    def mean_m(self) -> Floats:
        """Mean growth of a cycle (k,) [m]."""
        return np.asarray(self.growth_m.mean(axis=0))

    @property
    def scatter(self) -> Floats | None:
        """Variance of a cycle's relative growth (k,), from means of batches; None for a short block."""
        size = self.cycles // _BATCHES
        if size < 2:
            return None
        means = self.growth_m[-_BATCHES * size :].reshape(_BATCHES, size, -1).mean(axis=1)
        return size * _ratio(means.var(axis=0, ddof=1), np.square(self.mean_m))


@attrs.define(eq=False)
class _Stratum:
    """Gait cycles of one condition.

    Attributes
    ----------
    block : Block or None
        The last one.
    waiting : float
        Cycles since then that were not followed.
    resting : float
        Such cycles before it, as far as they rest on it.
    borrowed_m : (k, 2, N) array
        Wear that they have from another condition, while this one has no block.
    """

    block: Block | None
    waiting: float
    resting: float
    borrowed_m: Floats

    @property
    def square_m2(self) -> Floats:
        """Squares of what rests on the last block (k,), a relative variance of a cycle's growth of 1."""
        if self.block is None:
            return np.zeros(len(self.borrowed_m))
        weight = self.resting + self.waiting
        return np.asarray(weight**2 * np.square(self.block.mean_m) / self.block.cycles)


class WearEstimate:
    """Estimates the wear of gait cycles that are not followed.

    Parameters
    ----------
    shape : tuple of int
        (k, 2, N) of the wear depths.

    Attributes
    ----------
    blocks : int
        Number of blocks.
    estimated_cycles : float
        Number of gait cycles that were not followed; a part of a cycle counts as such.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape, k = shape, shape[0]
        self._strata: dict[Condition, _Stratum] = {}
        self.blocks, self.estimated_cycles = 0, 0.0
        # squares of what rested on earlier blocks, and of the cycles' own scatter, as of `_Stratum.square_m2`
        self._square_m2 = np.zeros(k)
        self._differences, self._pairs = np.zeros(k), 0
        self._scatters, self._scattered = np.zeros(k), 0
        self._variance_m2: Floats | None = np.zeros(k)

    def pass_over(self, condition: Condition, cycles: float) -> Floats:
        """Wear (k, 2, N) [m] of so many gait cycles of a condition that were not followed."""
        stratum = self._strata.setdefault(condition, _Stratum(None, 0.0, 0.0, np.zeros(self._shape)))
        stratum.waiting += cycles
        self._variance_m2 = None
        self.estimated_cycles += cycles
        block = stratum.block or self._nearest(condition)
        if block is None:
            return np.zeros(self._shape)
        self._square_m2 += cycles * np.square(block.mean_m)
        depth = cycles * block.depth_m
        if stratum.block is None:
            stratum.borrowed_m += depth
        return depth

    def end_block(self, condition: Condition, block: Block) -> Floats:
        """Correction (k, 2, N) [m] of the wear so far after a block of a condition."""
        self.blocks += 1
        self._variance_m2 = None
        stratum = self._strata.setdefault(condition, _Stratum(None, 0.0, 0.0, np.zeros(self._shape)))
        before, waiting = stratum.block, stratum.waiting
        self._learn(before, block)
        if before is None:
            correction = waiting * block.depth_m - stratum.borrowed_m
            self._strata[condition] = _Stratum(block, 0.0, waiting, np.zeros(self._shape))
            return correction
        half = 0.5 * waiting
        stratum.resting, stratum.waiting = stratum.resting + half, 0.0
        self._square_m2 += stratum.square_m2
        stratum.block, stratum.resting = block, half
        return np.asarray(half * (block.depth_m - before.depth_m))

    @property
    def variance_m2(self) -> Floats:
        """Variance (k,) of the mean clearances, as estimates of those that a whole replay would count.

        So that 95 % of them lie within 1.96 of its root either way.
        """
        if self._variance_m2 is None:  # it is asked for several times between two gait cycles
            self._variance_m2 = self._variance()
        return self._variance_m2

    def _variance(self) -> Floats:
        scatter, freedom = self._relative_variance()
        square = self._square_m2 + sum(each.square_m2 for each in self._strata.values())
        wider = (student_quantile(freedom) / _SURE) ** 2 if freedom else 1.0
        return np.asarray(wider * scatter * square + self._borrowed_m2())

    def _learn(self, before: Block | None, block: Block) -> None:
        """Learn the scatter from a block, and from its difference to the one before."""
        scatter = block.scatter
        if scatter is not None:
            self._scatters, self._scattered = self._scatters + scatter, self._scattered + 1
        if before is not None and before.scatter is not None and scatter is not None:
            middle = 0.5 * (before.mean_m + block.mean_m)
            apart = _ratio(np.square(block.mean_m - before.mean_m), np.square(middle))
            self._differences += apart / (1.0 / before.cycles + 1.0 / block.cycles)
            self._pairs += 1

    def _relative_variance(self) -> tuple[Floats, float]:
        """Variance (k,) of a single cycle's relative growth, and its degrees of freedom."""
        if self._pairs >= _ENOUGH_PAIRS:
            return self._differences / self._pairs, _OF_DIFFERENCES * self._pairs
        if self._scattered:
            return self._scatters / self._scattered, float((_BATCHES - 1) * self._scattered)
        return np.ones_like(self._scatters), 0.0

    def _borrowed_m2(self) -> Floats:
        """Squares (k,) of the growth that is counted by blocks of another condition: it may be off by all."""
        total = np.zeros(self._shape[0])
        for stratum in self._strata.values():
            if stratum.block is None:
                total += np.square(stratum.borrowed_m.sum(axis=1).mean(axis=1))
        return total

    def _nearest(self, condition: Condition) -> Block | None:
        """The block of the condition that is most like another one."""
        known = [(each.distance(condition), own.block) for each, own in self._strata.items() if own.block]
        return min(known, key=lambda one: one[0])[1] if known else None


def student_quantile(freedom: float) -> float:
    """Quantile of 97.5 % of Student's t with at least two degrees of freedom; Abramowitz, Stegun 26.7.5."""
    z, v = _SURE, freedom
    first = (z**3 + z) / 4.0
    second = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    fourth = (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z) / 92160.0
    return z + first / v + second / v**2 + third / v**3 + fourth / v**4


def _ratio(above: Floats, below: Floats) -> Floats:
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0.0)
