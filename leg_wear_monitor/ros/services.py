"""What people ask of the node by services, and what it needs to know before it does it."""

import time
from collections.abc import Callable

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.ledger.entry import JointWear

CONFIRM_S = 30.0


class Confirmation:
    """What wipes a count is asked for twice: any node in the domain can call a service once by mistake.

    Parameters
    ----------
    now_s : callable
        Time that nobody sets [s].
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._asked_s: dict[str, float] = {}

    def is_confirmed(self, what: str) -> bool:
        """Whether the same was asked for less than `CONFIRM_S` ago; if not, it is asked for now."""
        now_s = self._now_s()
        asked_s = self._asked_s.pop(what, None)
        if asked_s is not None and now_s - asked_s <= CONFIRM_S:
            return True
        self._asked_s[what] = now_s
        return False


def audit_time(now_ns: int) -> int:
    """Time for what is kept for ever [ns].

    Raises
    ------
    LegWearError
        If there is none.
    """
    if now_ns <= 0:
        raise LegWearError(
            "there is no time for the ledger: use_sim_time is set and no message came on /clock; "
            "publish /clock or start the node without use_sim_time"
        )
    return now_ns


def asked_once(joint: str, wear: JointWear) -> str:
    """What a reset would wipe, and how to mean it."""
    return (
        f"joint {joint}: not reset yet; this would set {_wear_text(wear)} to 0; "
        f"call again within {CONFIRM_S:g} s if the part was replaced"
    )


def undone(joint: str, wear: JointWear) -> str:
    """What a joint has worn after a reset was taken back."""
    return (
        f"joint {joint}: the reset is undone, {_wear_text(wear)} are counted, including those since the reset"
    )


def _wear_text(wear: JointWear) -> str:
    """Mean wear of the two surfaces together, and in how many gait cycles."""
    return f"{1e6 * float(wear.depth.sum(axis=0).mean()):.4g} um of wear from {wear.cycles} gait cycles"
