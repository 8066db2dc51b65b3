"""Which gait cycles are followed, and what those between are estimated to wear."""

import math
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.sample import SamplingSettings
from leg_wear_monitor.twin.statistics import TorqueProfile

# Conditions: classes of gait cycles with about the same cadence and load.


# wear a cycle grows with the second to fourth power of the cadence: within a class it differs by a tenth
_CADENCE_STEP = 0.04
_KEPT = 0.75  # steps from the middle of a class up to which a cycle still belongs to that of the cycle before

_LEAST_PHASES = 32  # with a torque, for a load


class Condition(NamedTuple):
    """Class of a gait cycle: direction, steps of the logarithm of the cadence, and of the load.

    ``load`` is None where the torque does not show one.
    """

    direction: int
    cadence: int
    load: int | None

    def distance(self, other: "Condition") -> float:
        """How unlike another condition is, in steps; a reversal counts as many."""
        load = 0 if self.load is None or other.load is None else abs(self.load - other.load)
        turned = 100.0 if self.direction != other.direction else 0.0
        return turned + abs(self.cadence - other.cadence) + load


def condition_of(cadence_rpm: float, load_steps: float, before: Condition | None = None) -> Condition:
    """Condition of a gait cycle.

    Parameters
    ----------
    cadence_rpm : float
        Negative backward.
    load_steps : float
        As of `measured_load`, in steps; NaN if not known.
    before : Condition, optional
        That of the cycle before, which is kept near the border of two classes.
    """
    direction = 1 if cadence_rpm > 0.0 else -1
    near = before if before is not None and before.direction == direction else None
    cadence = _step(math.log(abs(cadence_rpm)) / _CADENCE_STEP, near.cadence if near else None)
    load = None if math.isnan(load_steps) else _step(load_steps, near.load if near else None)
    return Condition(direction, cadence, load)


def _step(value: float, before: int | None) -> int:
    return before if before is not None and abs(value - before) <= _KEPT else round(value)


def measured_load(profile: TorqueProfile) -> float:
    """Part of a cycle's measured torque that acts as a load at the foot [N]; NaN if not known.

    It contains what the leg itself needs at this cadence, so it compares gait cycles of one cadence only. It
    rests on measured values alone: cycles that are only tracked have it as well.
    """
    known = profile.number > 0.0
    if np.count_nonzero(known) < _LEAST_PHASES:
        return math.nan
    measured = profile.measured_nm[known] / profile.number[known]
    lever = profile.lever_m[known] / profile.number[known]
    lever = lever - lever.mean()
    squares = float(lever @ lever)
    return float(measured @ lever) / squares if squares > 0.0 else math.nan


# Plan of a sampled replay: after each gait cycle, whether the next one is followed.


_RECENT = 4  # windows after which a condition that comes again is followed anew


class SamplingPlan:
    """One block in each window of gait cycles, at a random place in it; further ones where something changes.

    A place follows from the stamp at which its window begins: a recording has the same blocks in each
    replay, and no period of the gait can fall in step with them.

    Parameters
    ----------
    settings : SamplingSettings
    """

    def __init__(self, settings: SamplingSettings) -> None:
        self._settings = settings
        self._block_left = self._settle_left = self._position = self._cycles = 0
        self._offset = -1  # of the block in the present window; none in the first, which begins with one
        self._is_pulled = False
        self._followed: dict[Condition, int] = {}
        self._strange: Condition | None = None
        self.restart()

    def restart(self) -> None:
        """Follow from here on: the leg has been set in motion, and its first cycles settle."""
        self._settle_left = self._settings.settle_cycles
        self._block_left = max(self._block_left, self._settings.block_cycles)
        self._is_pulled = False

    def pull(self) -> None:
        """Follow a block from the next gait cycle on."""
        self._is_pulled = True

    @property
    def is_settling(self) -> bool:
        """Whether the present gait cycle is one that settles; before the first, the next one."""
        return self._settle_left > 0

    def note_block(self, condition: Condition, cycles: int) -> None:
        """Note so many followed gait cycles of a condition; a few are not enough to know it."""
        if 2 * cycles >= self._settings.block_cycles:
            self._followed[condition] = self._cycles

    def follows_next(self, condition: Condition | None, stamp_ns: int, was_followed: bool) -> bool:
        """Whether the next gait cycle is followed.

        Parameters
        ----------
        condition : Condition or None
            Of the cycle that has ended; None if it was no whole one.
        stamp_ns : int
            Its end.
        was_followed : bool
        """
        self._pass(stamp_ns, was_followed)
        if condition is not None and self._is_new(condition, was_followed):
            self._is_pulled = True
            self._followed[condition] = self._cycles  # even if its block turns out to be of another one
        if self._is_pulled or self._position == self._offset:
            if not was_followed:
                self._settle_left = self._settings.settle_cycles
            self._block_left, self._is_pulled = self._settings.block_cycles, False
        return self._settle_left > 0 or self._block_left > 0

    def _pass(self, stamp_ns: int, was_followed: bool) -> None:
        """Pass a gait cycle."""
        if was_followed and self._settle_left > 0:
            self._settle_left -= 1
        elif was_followed:
            self._block_left -= 1
        self._cycles += 1
        self._position += 1
        if self._position >= self._settings.window_cycles:
            free = self._settings.window_cycles - self._settings.followed_cycles
            self._position = 0
            self._offset = int(np.random.default_rng(abs(stamp_ns)).integers(0, free + 1))

    def _is_new(self, condition: Condition, was_followed: bool) -> bool:
        """Whether a condition has lasted for two cycles, and has not been followed for long."""
        last = self._followed.get(condition)
        recent = _RECENT * self._settings.window_cycles
        if was_followed or (last is not None and self._cycles - last <= recent):
            self._strange = None
            return False
        before, self._strange = self._strange, condition
        return before == condition


# Wear of the gait cycles that are not followed, from the blocks before and after, and its standard error.
#
# Each of them counts as the mean of two blocks of its own condition, the one before and the one after; until
# that comes, as the one before. Blocks of a condition scatter, because the motion is chaotic and because load
# and cadence vary within it: what two neighbours differ by shows how much.


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


# State of a sampled replay: its plan, the wear estimate, and the block that is being followed.


@attrs.define(eq=False)
class SampledState:
    """State of a sampled replay.

    Attributes
    ----------
    plan : SamplingPlan
    wear : WearEstimate
    depth : (k, 2, N) array
        Wear depths at the begin of the present gait cycle [m].
    moved_ns : int
        Time in motion until then.
    cycle_s : float
        Time in motion of the last whole gait cycle; NaN before.
    condition : Condition or None
        Of that cycle.
    left_ns : int
        By how much the crank's passage where the leg was left came after the leg's own time.
    passed : int
        Gait cycles since the leg was left.
    followed : int
        Gait cycles that were followed and counted.
    growing : dict of Condition to (list of (k,) arrays, (k, 2, N) array)
        The present block: growth of each cycle and wear of all, by condition [m].
    """

    plan: SamplingPlan
    wear: WearEstimate
    depth: Floats
    moved_ns: int = 0
    cycle_s: float = np.nan
    condition: Condition | None = None
    left_ns: int = 0
    passed: int = 0
    followed: int = 0
    growing: dict[Condition, tuple[list[Floats], Floats]] = attrs.field(factory=dict)

    def add(self, condition: Condition, growth_m: Floats, depth_m: Floats) -> None:
        """Add a followed gait cycle to the present block: growth (k,), and wear (k, 2, N) [m]."""
        growths, depth = self.growing.setdefault(condition, ([], np.zeros_like(depth_m)))
        growths.append(np.asarray(growth_m))
        depth += depth_m

    def end_block(self) -> Floats:
        """End the present block; returns the correction of the wear so far (k, 2, N) [m]."""
        correction = np.zeros_like(self.depth)
        for condition, (growths, depth) in self.growing.items():
            block = Block(np.array(growths), depth / len(growths))
            correction += self.wear.end_block(condition, block)
            self.plan.note_block(condition, block.cycles)
        self.growing = {}
        return correction
