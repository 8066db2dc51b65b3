"""Recordings: damaged, hostile, of another robot. Refused, told of, or as if whole."""

from collections.abc import Callable
from typing import Any

from campaign.case import Case
from campaign.recordings_bombs import bomb
from campaign.recordings_damaged import damaged
from campaign.recordings_stored import expected
from campaign.recordings_told import told, unlikely
from campaign.recordings_traps import trap
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config import MonitorConfig
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.twin import follower
from leg_wear_monitor.twin.load import FootLoad

SHORT, LONG = 40, 2000

# Of twenty cases: most compare every sample that comes out with those that went in.
_KINDS: tuple[Callable[[int], Case], ...] = (
    damaged, trap, damaged, bomb, damaged, trap, damaged, damaged, trap, told,
    damaged, trap, damaged, unlikely, damaged, trap, damaged, damaged, bomb, damaged,
)  # fmt: skip


def warm() -> None:
    """Compile what reads, and what replays; the tables of the leg are built once for all cases."""
    expected()
    told(0)
    _share_load()


def case(seed: int) -> Case:
    """Of twenty kinds in turn, the n-th of its kind."""
    turn, kind = divmod(seed, len(_KINDS))
    make = _KINDS[kind]
    before = sum(each is make for each in _KINDS[:kind])
    return make(turn * sum(each is make for each in _KINDS) + before)


def _share_load() -> None:
    """All cases have the same leg, and each its own process: what takes seconds to build is built once."""
    make, made = follower.FootLoad, []

    def shared(*arguments: Any) -> FootLoad:
        made.extend([] if made else [make(*arguments)])
        return made[0]

    follower.FootLoad = shared
    config = MonitorConfig()
    WearMonitor(load_mechanism(config.mechanism), config)
