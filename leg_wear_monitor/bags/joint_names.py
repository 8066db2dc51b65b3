"""Check that a recording's messages contain the crank joint; otherwise report the joints they contain."""

import struct
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import Finding, RecordingError, Severity
from leg_wear_monitor.bags.topics import listed
from leg_wear_monitor.messages.cdr import ENCAPSULATION
from leg_wear_monitor.messages.streams import JOINT_STATE
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, NOT_FINITE, ZERO_STAMP, Samples

_MOST = 1000
_NAMED = (NO_FAULT, NOT_FINITE, ZERO_STAMP)


@attrs.define
class _Counts:
    """Numbers of a file's messages with and without the crank; joint names of those without it."""

    found: int = 0
    missing: int = 0
    names: set[str] = attrs.Factory(set)


class JointNames:
    """Searches the messages of each file for the crank joint.

    Parameters
    ----------
    crank_joint : str
    """

    def __init__(self, crank_joint: str) -> None:
        self._crank = crank_joint
        self._files: dict[Path, _Counts] = {}

    def add_samples(
        self, path: Path, data: NDArray[np.uint8], messages: NDArray[np.void], samples: Samples
    ) -> None:
        """Count messages of a file, using the samples decoded from them."""
        counts = self._files.setdefault(path, _Counts())
        cranks = messages["type"] == JOINT_STATE
        counts.found += int(np.count_nonzero(cranks & np.isin(samples["fault"], _NAMED)))
        missing = np.flatnonzero(samples["fault"] == MISSING_JOINT)
        counts.missing += len(missing)
        if len(missing) and len(counts.names) < _MOST:
            message = messages[missing[0]]
            counts.names |= set(names_in(data[message["begin"] : message["end"]].tobytes())[:_MOST])

    def findings(self) -> list[Finding]:
        """Findings after all messages have been read.

        Raises
        ------
        RecordingError
            If messages contain joints but never the crank, or if one file lacks the crank and another has it.
        """
        found = sum(counts.found for counts in self._files.values())
        findings = []
        for path, counts in self._files.items():
            if not counts.missing:
                continue
            text = f"is not among the joints of {counts.missing} messages, they have {listed(counts.names)}"
            if not counts.found:
                remedy = "set the crank with --crank-joint (crank_joint in the parameters)"
                if found:
                    remedy = "the other files have it: give the recordings of one leg at a time"
                raise RecordingError(str(path), self._crank, f"{text}; {remedy}")
            text = f"joint {self._crank} {text}; {counts.found} have it"
            findings.append(Finding(path, text, Severity.NOTE))
        return findings


def names_in(raw: bytes) -> list[str]:
    """Joint names in a sensor_msgs/JointState message that has been decoded successfully."""
    order = "<" if raw[1] else ">"
    body, names = raw[ENCAPSULATION:], []
    _, at = _text(body, 8, order)
    count, at = _count(body, at, order)
    for _ in range(count):
        text, at = _text(body, at, order)
        names.append(text.rstrip(b"\0").decode("utf-8", "replace"))
    return names


def _count(body: bytes, at: int, order: str) -> tuple[int, int]:
    at += -at % 4
    return struct.unpack_from(f"{order}I", body, at)[0], at + 4


def _text(body: bytes, at: int, order: str) -> tuple[bytes, int]:
    size, at = _count(body, at, order)
    return body[at : at + size], at + size
