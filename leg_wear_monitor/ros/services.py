"""Helpers of the operator services: confirmation, audit time, reply texts."""

import time
from collections.abc import Callable

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.ledger.entry import JointWear
from leg_wear_monitor.monitor.resets import wear_words

CONFIRM_S = 30.0


class Confirmation:
    """Two-step confirmation of a wear reset: any node in the domain can call a service once by mistake.

    Parameters
    ----------
    now_s : callable
        Returns the time of a monotonic clock [s].
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._asked_s: dict[str, float] = {}

    def is_confirmed(self, what: str) -> bool:
        """Whether the same request came less than `CONFIRM_S` ago; if not, register it as the first."""
        now_s = self._now_s()
        asked_s = self._asked_s.pop(what, None)
        if asked_s is not None and now_s - asked_s <= CONFIRM_S:
            return True
        self._asked_s[what] = now_s
        return False


def audit_time(now_ns: int) -> int:
    """Time for permanent audit records [ns].

    Raises
    ------
    LegWearError
        If no valid time is available.
    """
    if now_ns <= 0:
        raise LegWearError(
            "there is no time for the ledger: use_sim_time is set and no message came on /clock; "
            "publish /clock or start the node without use_sim_time"
        )
    return now_ns


def asked_once(joint: str, wear: JointWear) -> str:
    """Reply to a first reset request: the wear that a reset would delete, and how to confirm."""
    return (
        f"joint {joint}: not reset yet; this would set {wear_words(wear)} to 0; "
        f"call again within {CONFIRM_S:g} s if the part was replaced"
    )


def undone(joint: str, wear: JointWear) -> str:
    """Reply to an undone reset: the joint's wear, including the wear since the reset."""
    return (
        f"joint {joint}: the reset is undone, {wear_words(wear)} are counted, including those since the reset"
    )
