"""Settings of a sampled replay."""

import math

import attrs

from leg_wear_monitor.errors import LegWearError


@attrs.frozen(kw_only=True)
class SamplingSettings:
    """Settings of a sampled replay.

    Attributes
    ----------
    fraction : float
        Fraction of the gait cycles that is followed in a steady gait, those after a jump included.
    block_cycles : int
        Gait cycles in a row that are followed and counted. In longer ones neighbouring cycles repeat what is
        known already; in shorter ones the settling takes too much.
    settle_cycles : int
        Gait cycles after a jump that are followed, but not counted: `docs/appendix/benchmarks.md`.
    """

    fraction: float
    block_cycles: int = 20
    settle_cycles: int = 2

    def __attrs_post_init__(self) -> None:
        if not (math.isfinite(self.fraction) and 0.0 < self.fraction <= 1.0):
            raise LegWearError(f"sample: {self.fraction} is not a fraction above 0, up to 1")
        if self.block_cycles < 1 or self.settle_cycles < 0:
            raise LegWearError("block_cycles: expected at least 1, and settle_cycles at least 0")

    @property
    def followed_cycles(self) -> int:
        """Gait cycles that are followed for a block."""
        return self.settle_cycles + self.block_cycles

    @property
    def window_cycles(self) -> int:
        """Gait cycles of which one block is followed."""
        return max(self.followed_cycles, round(self.followed_cycles / self.fraction))
