"""Recordings: damaged, hostile, of another robot. Refused, reported, or as if whole."""

from collections.abc import Callable

from campaign.case import Case
from campaign.recordings_damaged import damaged
from campaign.recordings_printed import printed, unlikely
from campaign.recordings_stored import expected
from campaign.recordings_traps import trap
from campaign.warm_twin import keep_twin

SHORT, LONG = 40, 2000

# Of twenty cases: most compare every sample that comes out with those that went in.
_KINDS: tuple[Callable[[int], Case], ...] = (
    damaged, trap, damaged, trap, damaged, trap, damaged, damaged, trap, printed,
    damaged, trap, damaged, unlikely, damaged, trap, damaged, damaged, trap, damaged,
)  # fmt: skip


def warm() -> None:
    """Compile what reads, and what replays; the tables of the leg are built once for all cases."""
    keep_twin()
    expected()
    printed(0)


def case(seed: int) -> Case:
    """Of twenty kinds in turn, the n-th of its kind."""
    turn, kind = divmod(seed, len(_KINDS))
    make = _KINDS[kind]
    before = sum(each is make for each in _KINDS[:kind])
    return make(turn * sum(each is make for each in _KINDS) + before)
