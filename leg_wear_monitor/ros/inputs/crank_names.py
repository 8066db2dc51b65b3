"""Check that messages contain the crank joint; otherwise report the joints they contain."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.bags.joint_names import names_in
from leg_wear_monitor.errors import printable
from leg_wear_monitor.messages.streams import JOINT_STATE
from leg_wear_monitor.ros.inputs.inbox import Arrival
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, Samples

_MOST_NAMES, _MOST_LETTERS, _MOST_BYTES = 12, 40, 100_000
_MOST_PUBLISHERS, _OF_A_BLOCK = 8, 20


class CrankNames:
    """Searches messages for the name of the crank joint.

    Several nodes may publish joints of one robot on one topic: messages without the crank are a fault only
    if none has it.

    Parameters
    ----------
    crank_joint : str
    """

    def __init__(self, crank_joint: str) -> None:
        self._crank = crank_joint
        self._named = 0
        self._others: dict[tuple[str, ...], int] = {}
        self._unnamed: set[tuple[str, ...]] = set()
        self._report = ""

    def note(self, arrivals: Sequence[Arrival], samples: Samples, now_ns: int) -> None:
        """Record messages and the samples decoded from them, at a time [ns] of the monotonic clock."""
        for i in np.flatnonzero(samples["fault"] == MISSING_JOINT).tolist()[-_OF_A_BLOCK:]:
            names = _names(arrivals[i].raw)
            if names in self._others or len(self._others) < _MOST_PUBLISHERS:
                self._others[names] = now_ns
                self._unnamed.add(names)
        joint_states = np.array([one.kind == JOINT_STATE for one in arrivals], bool)
        self._named += int(np.count_nonzero(joint_states & (samples["fault"] == NO_FAULT)))

    def others(self, since_ns: int) -> int:
        """Number of different lists of joints without the crank that came since a time."""
        return sum(at_ns >= since_ns for at_ns in self._others.values())

    def report(self) -> str:
        """Report that no message names the crank, and which joints they name; empty if one names it."""
        named, unnamed = self._named, self._unnamed
        self._named, self._unnamed = 0, set()
        if named:
            self._report = ""
        elif unnamed:
            names = sorted({name for joints in unnamed for name in joints})
            self._report = (
                f"no joint is named {self._crank!r}; there are {_listed(names)}; set crank_joint to its name"
            )
        return self._report


def _names(raw: bytes) -> tuple[str, ...]:
    """Joint names of a message; none of a message with too many."""
    return tuple(names_in(raw)) if len(raw) <= _MOST_BYTES else ()


def _listed(names: Sequence[str]) -> str:
    """Names as printable text."""
    shown = ", ".join(printable(name, _MOST_LETTERS) for name in names[:_MOST_NAMES])
    if not names:
        return "too many to name"
    return f"{shown} and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else shown
