"""Plan of a sampled replay: after each gait cycle, whether the next one is followed."""

import numpy as np

from leg_wear_monitor.twin.sampling.condition import Condition
from leg_wear_monitor.twin.sampling.settings import SamplingSettings

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
