"""The recordings of a leg: which of them are new, and one line about each that was replayed."""

import json
import os
from collections.abc import Iterable
from enum import Enum
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.errors import system_asked
from leg_wear_monitor.fleet.description import FleetLeg
from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.recordings.bag import find_files
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.reader import Recording

FILE = "recordings.jsonl"


class Outcome(Enum):
    """Result of a recording."""

    COUNTED = "counted"
    ALREADY_COUNTED = "already_counted"
    """The ledger had the wear of all its time from other recordings."""
    NO_GAIT = "no_gait"
    """No gait cycle in it fits the leg; no wear is modelled."""
    UNREADABLE = "unreadable"


@attrs.frozen(kw_only=True)
class ReadRecording:
    """A recording that was replayed, or could not be read.

    Attributes
    ----------
    file : str
        Its path, relative to the description if it is below it.
    size, changed_ns : int
        Bytes of its files, and the time of their last change. If they differ, the recording is read again.
    settings : str
        Digest of the settings of its leg. If it differs, a recording whose wear is not in the ledger is read
        again.
    outcome : str
        Value of an `Outcome`.
    begin_ns, end_ns : int
        First and last stamp [ns].
    cycles : int
        Gait cycles whose wear was modelled.
    last_cycle_ns : int
        End of the last such gait cycle [ns]. The ledger contains this stamp if the replay was completed.
    is_partial : bool
        True if recorded data are lost or may be wrong.
    findings : tuple of str
        The first findings of the replay.
    """

    file: str
    size: int
    changed_ns: int
    settings: str
    outcome: str
    begin_ns: int = 0
    end_ns: int = 0
    cycles: int = 0
    last_cycle_ns: int = 0
    is_partial: bool = False
    findings: tuple[str, ...] = ()

    @property
    def is_counted(self) -> bool:
        """True if the ledger contains the wear of this recording, read from it."""
        return self.outcome == Outcome.COUNTED.value

    @property
    def fault(self) -> str:
        """One line for the operator if the recording has a fault; empty otherwise."""
        if self.is_counted and not self.is_partial:
            return ""
        words = "added in part" if self.is_counted else self.outcome.replace("_", " ")
        return "; ".join([f"{self.file}: {words}", *self.findings[:1]])


def read_lines(directory: Path) -> dict[str, ReadRecording]:
    """The last line about each recording, by its file; damaged or incomplete lines are ignored.

    Without a line, its recording is replayed once more. The ledger then knows which time it already contains.
    """
    found: dict[str, ReadRecording] = {}
    path = directory / FILE
    for line in path.read_bytes().splitlines() if path.exists() else ():
        try:
            values = json.loads(line)
            one = ReadRecording(**values | {"findings": tuple(values["findings"])})
        except (ValueError, TypeError, KeyError):
            continue
        found[one.file] = one
    return found


def add_line(directory: Path, one: ReadRecording) -> None:
    """Append the line of a recording, and write it to the disk.

    Raises
    ------
    ConfigError
        If the disk cannot be written.
    """
    path = directory / FILE
    with system_asked(path, "cannot be written"), path.open("ab") as file:
        # the leading newline ends an incomplete line of a killed process
        file.write(b"\n" + json.dumps(part_document(one)).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def state_of(path: Path) -> tuple[int, int]:
    """Bytes of a recording's files, and the time of their last change [ns]; zeros if there are none."""
    try:
        states = [file.path.stat() for file in find_files([path])]
    except (RecordingError, OSError):
        return 0, 0
    return sum(each.st_size for each in states), max(each.st_mtime_ns for each in states)


def is_known(path: Path, line: ReadRecording | None, leg: FleetLeg, counted_ns: Ints) -> bool:
    """True if a recording need not be read again.

    The line of a recording is written before its wear is in the ledger. So a line that says ``counted`` holds
    only if the ledger contains the end of its last gait cycle.

    Parameters
    ----------
    path : pathlib.Path
    line : ReadRecording or None
        Its last line.
    leg : FleetLeg
    counted_ns : (n, 2) array
        Time spans in the ledger [ns].
    """
    if line is None or (line.size, line.changed_ns) != state_of(path):
        return False
    if line.is_counted:
        begin, end = counted_ns.T
        return bool(((begin <= line.last_cycle_ns) & (line.last_cycle_ns <= end)).any())
    return line.outcome == Outcome.ALREADY_COUNTED.value or line.settings == leg.settings


def in_order(paths: Iterable[Path], leg: FleetLeg) -> list[Path]:
    """Recordings by their first stamp; one that cannot be read comes first, and its replay says why."""
    found = list(paths)
    if len(found) < 2:
        return found
    return sorted(found, key=lambda path: (_first_stamp_ns(path, leg), str(path)))


def _first_stamp_ns(path: Path, leg: FleetLeg) -> int:
    """First valid stamp; 0 if there is none."""
    topics: dict[str, Any] = {"joint_states": leg.joint_states, "drive_torque": leg.drive_torque}
    try:
        with Recording([path], leg.config, **topics) as recording:
            for block in recording.blocks():
                stamps = block.samples["stamp_ns"][block.samples["fault"] == 0]
                if len(stamps):
                    return int(stamps[0])
    except RecordingError:
        return 0
    return 0
