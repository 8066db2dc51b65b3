"""Finds the recordings of a leg: what they contain tells them apart, not their names."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.bags.bag import find_files
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg

_KEY_DIGITS = 20


@attrs.frozen
class Found:
    """A recording of a leg.

    Attributes
    ----------
    path : pathlib.Path
    size : int
        Bytes of its files.
    changed_ns : int
        Time of the last change of its files.
    key : str
        Digest of the content of its files.
    begin_ns : int
        First stamp in it [ns]; 0 if it cannot be read.
    fault : str
        Why it cannot be read; empty if it can.
    """

    path: Path
    size: int
    changed_ns: int
    key: str
    begin_ns: int = 0
    fault: str = ""


def files_of(path: Path) -> list[Path]:
    """Files of a recording.

    Raises
    ------
    RecordingError
        If it is none.
    """
    return [file.path for file in find_files([path])[0]]


def state_of(path: Path) -> tuple[int, int]:
    """Bytes of a recording's files, and the time of their last change [ns]; zeros if there are none."""
    try:
        states = [file.stat() for file in files_of(path)]
    except (RecordingError, OSError):
        return 0, 0
    return sum(each.st_size for each in states), max(each.st_mtime_ns for each in states)


def known(path: Path, files: Mapping[str, Any]) -> Found | None:
    """A recording as the index of a leg has it; None if it is not there, or was changed since."""
    entry = files.get(str(path))
    if entry is None or (entry["size"], entry["changed_ns"]) != state_of(path):
        return None
    return Found(path, **entry)


def look(path: Path, leg: FleetLeg) -> Found:
    """Read what identifies a recording: all of its bytes, and its first stamp."""
    size, changed_ns = state_of(path)
    try:
        files = files_of(path)
        key = _digest(files)
    except (RecordingError, OSError) as error:
        why = error.strerror if isinstance(error, OSError) else error.fault
        return Found(path, size, changed_ns, _text_key(str(path)), fault=f"cannot be read: {why}")
    begin_ns, fault = begin_of(path, leg)
    return Found(path, size, changed_ns, key, begin_ns, fault)


def begin_of(path: Path, leg: FleetLeg) -> tuple[int, str]:
    """First valid stamp in a recording [ns], 0 if there is none; why it cannot be read, empty if it can."""
    try:
        return _first_stamp_ns(path, leg), ""
    except RecordingError as error:
        return 0, ": ".join(filter(None, (error.key, error.fault)))


def entry_of(found: Found) -> dict[str, Any]:
    """A recording for the index of its leg."""
    return attrs.asdict(found, filter=lambda attribute, _: attribute.name != "path")


def _first_stamp_ns(path: Path, leg: FleetLeg) -> int:
    """First valid stamp; 0 if there is none."""
    topics = {"joint_states": leg.joint_states, "drive_torque": leg.drive_torque}
    with Recording([path], leg.config, **topics) as recording:  # type: ignore[arg-type]
        for block in recording.blocks():
            stamps = block.samples["stamp_ns"][block.samples["fault"] == 0]
            if len(stamps):
                return int(stamps[0])
    return 0


def _digest(files: list[Path]) -> str:
    """Digest of the content of files, in their order."""
    total = hashlib.sha256()
    for path in files:
        with path.open("rb") as file:
            total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()[:_KEY_DIGITS]


def _text_key(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:_KEY_DIGITS]


def scan(leg: FleetLeg, files: Mapping[str, Any]) -> list[Found]:
    """All recordings of a leg; read are those that its index does not have as they are now.

    Parameters
    ----------
    leg : FleetLeg
    files : mapping
        The index, `LegDirectory.files`.
    """
    return [known(path, files) or look(path, leg) for path in leg.recordings]
