"""Check that messages contain the crank joint; otherwise report the joints they contain."""

from collections.abc import Sequence

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from leg_wear_monitor.messages.streams import JOINT_STATE
from leg_wear_monitor.ros.inputs.inbox import Arrival
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, Samples

_MOST_NAMES, _MOST_LETTERS, _MOST_BYTES = 12, 40, 100_000


class CrankNames:
    """Searches messages for the name of the crank joint.

    Parameters
    ----------
    crank_joint : str
    """

    def __init__(self, crank_joint: str) -> None:
        self._crank = crank_joint
        self._named = self._unnamed = 0
        self._example, self._report = b"", ""

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Record messages and the samples decoded from them."""
        missing = np.flatnonzero(samples["fault"] == MISSING_JOINT)
        self._unnamed += len(missing)
        if len(missing):
            self._example = arrivals[missing[-1]].raw
        joint_states = np.array([one.kind == JOINT_STATE for one in arrivals], bool)
        self._named += int(np.count_nonzero(joint_states & (samples["fault"] == NO_FAULT)))

    @property
    def some_lack_it(self) -> bool:
        """Whether a message lacked the crank since `report` was last called."""
        return self._unnamed > 0

    def report(self) -> str:
        """Report that no message names the crank, and which joints they name; empty if one names it."""
        unnamed, named, raw = self._unnamed, self._named, self._example
        self._named = self._unnamed = 0
        if named:
            self._report = ""
        elif unnamed:
            names = _names_in(raw)
            self._report = (
                f"no joint is named {self._crank!r}; there are {names}; set crank_joint to its name"
            )
        return self._report


def _names_in(raw: bytes) -> str:
    """Joint names of a message in order, as printable text."""
    if len(raw) > _MOST_BYTES:
        return "too many to name"
    names = sorted(set(deserialize_message(raw, JointState).name))
    shown = ", ".join(_printable(name) for name in names[:_MOST_NAMES])
    return f"{shown} and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else shown


def _printable(name: str) -> str:
    short = name if len(name) <= _MOST_LETTERS else name[:_MOST_LETTERS] + "..."
    return short if short.isprintable() and short else repr(short)
