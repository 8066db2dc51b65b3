"""State of a sampled replay: its plan, the wear estimate, and the block that is being followed."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.sampling.condition import Condition
from leg_wear_monitor.twin.sampling.plan import SamplingPlan
from leg_wear_monitor.twin.sampling.wear_estimate import Block, WearEstimate


@attrs.define(eq=False)
class _Growing:
    """The cycles of one condition in the present block."""

    growth_m: list[Floats]
    depth_m: Floats


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
    growing : dict of Condition to _Growing
        The present block.
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
    growing: dict[Condition, _Growing] = attrs.field(factory=dict)

    def add(self, condition: Condition, growth_m: Floats, depth_m: Floats) -> None:
        """Add a followed gait cycle to the present block: growth (k,), and wear (k, 2, N) [m]."""
        own = self.growing.setdefault(condition, _Growing([], np.zeros_like(depth_m)))
        own.growth_m.append(np.asarray(growth_m))
        own.depth_m += depth_m

    def end_block(self) -> Floats:
        """End the present block; returns the correction of the wear so far (k, 2, N) [m]."""
        correction = np.zeros_like(self.depth)
        for condition, own in self.growing.items():
            block = Block(np.array(own.growth_m), own.depth_m / len(own.growth_m))
            correction += self.wear.end_block(condition, block)
            self.plan.note_block(condition, block.cycles)
        self.growing = {}
        return correction
