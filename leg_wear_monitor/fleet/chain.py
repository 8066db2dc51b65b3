"""The recordings of a leg: found, queued, counted, and what is kept of each."""

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import attrs

from leg_wear_monitor.bags.bag import find_files
from leg_wear_monitor.bags.findings import RecordingError, reading
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.errors import LegWearError, printable
from leg_wear_monitor.files import write_whole
from leg_wear_monitor.fleet.description import FleetLeg
from leg_wear_monitor.fleet.directory import (
    LegDirectory,
    Line,
    Outcome,
    cycle_columns,
    locked,
    write_parquet,
)
from leg_wear_monitor.playback.replay import replay
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.workers import package_digest

# What is kept of one recording of a leg.


_MOST_FINDINGS = 20
_AGAIN = "tried again at the next update"


_UNREAD: Line = {
    "key": "",  # digest of its content
    "file": "",  # its name when it was counted
    "outcome": "",  # value of an `Outcome`
    "settings": "",  # digest of the leg's settings; what was not counted is tried again with others, and
    # what the system could not read at every update: that has none, and is not kept
    "begin_ns": 0,  # first and last stamp; 0 if there are none
    "end_ns": 0,
    "duration_s": 0.0,  # time between them
    "cycles": 0,  # gait cycles that were counted from it
    "is_partial": False,  # whether recorded data are lost or may be wrong
    "is_late": False,  # whether a later recording had been counted before it
    "findings": [],  # faults and remarks; the first twenty
    "lost": None,  # samples and time that were not used; null if nothing was replayed
    "verdict": None,  # `Verdict` at its end; null unless it was counted
    "clearances": {},  # `JointClearance` by joint
    "life": {},  # `LifeHours` of each joint, and of the ``leg``
    "basis": None,  # `ForecastBasis` of its forecast; null without one
    "knows": "",  # `LegDirectory.knowledge` in it; with another one, the forecast is made again
}
"""The line of a recording of which nothing is known."""


def line_of(result: ReplayResult, about: Line, is_late: bool) -> Line:
    """Line of a replayed recording; `ReplayResult.findings` must be complete.

    Parameters
    ----------
    result : ReplayResult
    about : dict
        Key, file and settings.
    is_late : bool
    """
    monitor, texts = result.monitor, [printable(one.text) for one in result.findings]
    outcome, counted = Outcome.COUNTED, dict[str, Any]()
    if result.is_unusable:
        outcome = Outcome.NO_GAIT
        texts.insert(0, f"no gait cycle fits this leg: {printable(result.evidence.missing())}")
    elif monitor.is_all_counted:
        outcome = Outcome.ALREADY_COUNTED
        texts.insert(
            0, "all of its time is that of recordings before it; if it is another walk, its clock is wrong"
        )
    else:
        state, basis = monitor.state, monitor.forecast_basis
        counted = {
            "cycles": len(result.history),
            "verdict": state.verdict,
            "clearances": state.clearances if result.history.last else {},
            "life": state.life,
            "basis": basis if basis and math.isfinite(basis.cycle_s) else None,
        }
    read = {
        "outcome": outcome,
        "begin_ns": result.begin_ns,
        "end_ns": result.end_ns,
        "duration_s": result.duration_s,
        "is_partial": result.is_partial,
        "is_late": is_late,
        "findings": texts[:_MOST_FINDINGS],
        "lost": monitor.lost,
    }
    return dict(part_document(_UNREAD | about | read | counted))


class Job(NamedTuple):
    """A call for a worker, by a name; costly ones begin first."""

    key: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...]
    cost: float = 1.0

    def run(self) -> Any:
        """Result of the call."""
        return self.call(*self.arguments)


# Finds the recordings of a leg: what they contain tells them apart, not their names.


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
    settings : str
        Digest of the leg's settings that it was read with.
    is_passing : bool
        Whether the fault is not in the recording: nothing is kept of it, and each update tries it again.
    """

    path: Path
    size: int
    changed_ns: int
    key: str
    begin_ns: int = 0
    fault: str = ""
    settings: str = ""
    is_passing: bool = False


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


def known(path: Path, leg: FleetLeg, files: Mapping[str, Any]) -> Found | None:
    """A recording as the index of a leg has it; None if it is not there, or was read with other settings.

    None as well if it was changed since.
    """
    found = _unchanged(path, files)
    return found if found and found.settings == leg.settings else None


def _unchanged(path: Path, files: Mapping[str, Any]) -> Found | None:
    """A recording as the index has it, whatever the settings; None if it was changed since."""
    entry = files.get(str(path))
    if entry is None or (entry["size"], entry["changed_ns"]) != state_of(path):
        return None
    return Found(path, **entry)


def look(path: Path, leg: FleetLeg, files: Mapping[str, Any]) -> Found:
    """Read what identifies a recording: its first stamp, and all of its bytes unless the index has them."""
    size, changed_ns = state_of(path)
    name = str(path).encode("utf-8", "surrogateescape")
    key, begin_ns, fault, is_passing = hashlib.sha256(name).hexdigest()[:_KEY_DIGITS], 0, "", False
    same = _unchanged(path, files)
    try:
        key = same.key if same and not same.fault else _digest(files_of(path))
        begin_ns = _first_stamp_ns(path, leg)
    except RecordingError as error:
        fault, is_passing = _fault(error), error.is_passing
    return Found(path, size, changed_ns, key, begin_ns, fault, leg.settings, is_passing)


def begin_of(path: Path, leg: FleetLeg) -> tuple[int, str]:
    """First valid stamp in a recording [ns], 0 if there is none; why it cannot be read, empty if it can."""
    try:
        return _first_stamp_ns(path, leg), ""
    except RecordingError as error:
        return 0, _fault(error)


def _fault(error: RecordingError) -> str:
    """Why a recording cannot be read, without its name."""
    return ": ".join(filter(None, (error.key, error.fault)))


def entry_of(found: Found) -> dict[str, Any]:
    """A recording for the index of its leg."""
    return attrs.asdict(found, filter=lambda attribute, _: attribute.name not in ("path", "is_passing"))


def _first_stamp_ns(path: Path, leg: FleetLeg) -> int:
    """First valid stamp; 0 if there is none."""
    with Recording(
        [path],
        leg.config,
        memory_mb=leg.memory_mb,
        joint_states=leg.joint_states,
        drive_torque=leg.drive_torque,
    ) as recording:
        for block in recording.blocks():
            stamps = block.samples["stamp_ns"][block.samples["fault"] == 0]
            if len(stamps):
                return int(stamps[0])
    return 0


def _digest(files: list[Path]) -> str:
    """Digest of the content of files, in their order."""
    total = hashlib.sha256()
    for path in files:
        with reading([path]), path.open("rb") as file:
            total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()[:_KEY_DIGITS]


def scan(leg: FleetLeg, files: Mapping[str, Any]) -> list[Found]:
    """All recordings of a leg; read are those that its index does not have as they are now.

    Parameters
    ----------
    leg : FleetLeg
    files : mapping
        The index, `LegDirectory.files`.
    """
    return [known(path, leg, files) or look(path, leg, files) for path in leg.recordings]


# The line of a recording in a leg's log.


def words_of(line: Line) -> str:
    """What became of a recording, on one line."""
    parts = [line["file"] + ": " + line["outcome"].replace("_", " ")]
    if line["outcome"] == Outcome.COUNTED.value:
        verdict = line["verdict"]
        parts[0] += f", {line['cycles']} gait cycles, verdict {verdict['state'].replace('_', ' ')}"
        parts[0] += f" ({verdict['fault_code']})"
    if line["is_late"]:
        parts.append("a later recording was counted before it")
    if line["is_partial"]:
        parts.append("parts of it are lost")
    return "; ".join([*parts, *line["findings"]])


# Counts one recording of a leg: its wear into the ledger, its gait cycles into a table, what was found.


def count_or_fault(leg: FleetLeg, out: Path, found: Found, last_ns: int, code: str) -> Line | str:
    """Record of a recording, or why the leg cannot go on; see `count_recording`.

    ``code`` is the `package_digest` of who asks.
    """
    if package_digest() != code:
        return "a worker has another version of leg_wear_monitor; install the same one everywhere"
    try:
        return count_recording(leg, out, found, last_ns)
    except LegWearError as error:
        return str(error)


def count_recording(leg: FleetLeg, out: Path, found: Found, last_ns: int) -> Line:
    """Count a recording, so that a kill at any instant costs nothing but time.

    Its table and its record are written before its wear is in the ledger, the record as pending. If the
    process is killed after that, the next replay finds all of it in the ledger, and the pending record holds;
    if before, it is counted again, and replaces both. A worker of a killed update may go on for some seconds:
    it is waited for, and what it has counted is not counted again.

    Parameters
    ----------
    leg : FleetLeg
    out : pathlib.Path
        Directory of the fleet.
    found : Found
    last_ns : int
        Last stamp that was counted before [ns].

    Returns
    -------
    dict
        Its record, a plain object.

    Raises
    ------
    ConfigError, LedgerError
        If the leg's parameters or its ledger are unusable.
    """
    directory = LegDirectory(out, leg.id)
    with locked(directory.path, waits=True):
        done = next((line for line in directory.lines() if _is_done(line, found)), None)
        return done or _counted(leg, directory, found, last_ns)


def _is_done(line: Line, found: Found) -> bool:
    return line["key"] == found.key and Outcome(line["outcome"]).is_final


def _counted(leg: FleetLeg, directory: LegDirectory, found: Found, last_ns: int) -> Line:
    """Count a recording into a leg that is locked."""
    about = {"key": found.key, "file": leg.shown(found.path), "settings": leg.settings}
    try:
        if found.fault:
            raise RecordingError("", "", found.fault)
        line = _replayed(leg, directory, found, about, last_ns)
    except RecordingError as error:
        line = _UNREAD | about | {"outcome": Outcome.UNREADABLE.value, "is_partial": True}
        line["findings"] = [printable(_fault(error))]
        if error.is_passing:
            line |= {"settings": "", "is_partial": False, "findings": [*line["findings"], _AGAIN]}
            directory.note([words_of(line)])
            return line
    directory.add(line, words_of(line))
    return line


def _replayed(leg: FleetLeg, directory: LegDirectory, found: Found, about: Line, last_ns: int) -> Line:
    """Replay a recording into the ledger; its line."""
    pending, lines = directory.pending(), list[Line]()

    def finish(result: ReplayResult) -> None:
        line = line_of(result, about, found.begin_ns < last_ns)
        lines.append(line)
        if line["outcome"] == Outcome.COUNTED.value:
            write_parquet(directory.table(found.key), cycle_columns(result, leg.row))
            write_whole(directory.summary, result.summary().to_json().encode())
            directory.expect(line)

    replay(
        found.path,
        leg.used_config,
        ledger=directory.ledger,
        node=leg.node,
        joint_states=leg.joint_states,
        drive_torque=leg.drive_torque,
        memory_mb=leg.memory_mb,
        sample=leg.sample,
        finish=finish,
    )
    (line,) = lines
    is_done = line["outcome"] == Outcome.ALREADY_COUNTED.value
    if is_done and pending and pending["key"] == found.key:
        return pending
    # with the changes of the replay itself, which are in the ledger by now
    return line | {"knows": directory.knowledge()} if line["verdict"] else line


# The recordings of a leg that are to be counted, and the state of the work on them.


@attrs.define(eq=False)
class Chain:
    """A leg in an update.

    Attributes
    ----------
    leg : FleetLeg
    out : pathlib.Path
        Directory of the fleet.
    waiting : list of Found
        Recordings that are to be counted, the next one last.
    found : list of Found
        All of its recordings, in the order of time.
    new : list of dict
        Records of this update.
    copies : list of str
        Lines about copies that were not known before.
    refused : list of str
        Recordings that this update leaves out: another leg has them, or the system could not read them.
    is_renewed : bool
        Whether its forecast was made again, because something was measured.
    has_new_settings : bool
        Whether its settings are others than those of its last forecast.
    fault : str
        Why the leg could not go on; empty if it could.
    """

    leg: FleetLeg
    out: Path
    waiting: list[Found] = attrs.Factory(list)
    found: list[Found] = attrs.Factory(list)
    new: list[Line] = attrs.Factory(list)
    copies: list[str] = attrs.Factory(list)
    refused: list[str] = attrs.Factory(list)
    is_renewed: bool = False
    has_new_settings: bool = False
    fault: str = ""
    _settled: set[str] = attrs.Factory(set)
    _pending: str = ""
    _last_ns: int = 0

    @property
    def directory(self) -> LegDirectory:
        """Files of the leg."""
        return LegDirectory(self.out, self.leg.id)

    @property
    def waiting_bytes(self) -> int:
        """Bytes of the recordings that are to be counted."""
        return sum(each.size for each in self.waiting)

    def begin(self) -> Job | None:
        """Read what is known of the leg; the job that reads unknown recordings, None if there are none."""
        lines = list(self.directory.lines())
        self.directory.remove_parts()
        if any(line["outcome"] == "counted" for line in lines) and not self.directory.ledger.exists():
            self.fault = f"{self.directory.ledger} is missing: put a copy of it back"
            return None
        for line in lines:
            if Outcome(line["outcome"]).is_final or line["settings"] == self.leg.settings:
                self._settled.add(line["key"])
            self._last_ns = max(self._last_ns, line["end_ns"])
            if line["outcome"] == Outcome.COUNTED.value:
                self.has_new_settings = line["settings"] != self.leg.settings
        pending = self.directory.pending()
        if pending and pending["key"] in self._settled:
            self.directory.forget_pending()
        elif pending:
            self._pending = pending["key"]
        files = self.directory.files()
        found = [known(path, self.leg, files) for path in self.leg.recordings]
        self.found = [each for each in found if each is not None]
        if len(self.found) == len(found):
            return None
        return Job(f"scan-{self.leg.id}", scan, (self.leg, files), float(len(found) - len(self.found)))

    def take(self, found: Iterable[Found]) -> None:
        """Take the recordings that were read; what of them can be read is known from now on."""
        before, found = {each.path for each in self.found}, list(found)
        for each in found:
            if each.is_passing:
                words = f"{self.leg.shown(each.path)}: {Outcome.UNREADABLE.value}; {each.fault}; {_AGAIN}"
                self.refused.append(words)
        self.found = [each for each in found if not each.is_passing]
        first: dict[str, Found] = {}
        for each in sorted(self.found, key=lambda one: (one.path not in before, str(one.path))):
            if first.setdefault(each.key, each) is not each and each.path not in before:
                original = self.leg.shown(first[each.key].path)
                self.copies.append(f"{self.leg.shown(each.path)}: is a copy of {original}, counted once")
        # before they are known: a kill in between must not lose a line
        self.directory.note([*self.refused, *self.copies])
        self.directory.keep_files({str(each.path): entry_of(each) for each in self.found if each.size})

    def plan(self) -> None:
        """Queue what is not counted yet: what is pending, then in the order of time, each content once."""
        self.found.sort(key=lambda each: (each.key != self._pending, each.begin_ns, each.key, str(each.path)))
        queue: dict[str, Found] = {}
        for each in self.found:
            if each.key not in self._settled and not self.fault:
                queue.setdefault(each.key, each)
        self.waiting = list(reversed(queue.values()))

    def refuse(self, key: str, why: str) -> None:
        """Do not count a recording in this update."""
        self.refused += [f"{self.leg.shown(each.path)}: {why}" for each in self.waiting if each.key == key]
        self.waiting = [each for each in self.waiting if each.key != key]

    def next_job(self) -> Job | None:
        """The job that counts the next recording; None if the leg is up to date or cannot go on."""
        if not self.waiting or self.fault:
            return None
        found = self.waiting[-1]
        leg = attrs.evolve(self.leg, recordings=())
        arguments = (leg, self.out, found, self._last_ns, package_digest())
        return Job(f"count-{leg.id}-{found.key}", count_or_fault, arguments, float(self.waiting_bytes))

    def done(self, result: Line | str) -> None:
        """Take the result of `next_job`."""
        if isinstance(result, str):
            self.fault = result
            return
        self.waiting.pop()
        if not result["settings"]:
            self.refused.append(words_of(result))
            return
        self.new.append(result)
        self._last_ns = max(self._last_ns, result["end_ns"])
