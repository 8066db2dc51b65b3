"""Directory of a fleet: files of each leg, written whole or not at all, one update at a time, tables."""

import fcntl
import hashlib
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import ConfigError, LegWearError, printable, system_asked
from leg_wear_monitor.files import remove_parts, write_whole
from leg_wear_monitor.monitor.ledger.file import last_changes_of, measurements_of
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, JOINT_COLUMNS, History

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult


# Lines of the files of a fleet, which are written whole or not at all.


def append_line(path: Path, line: str) -> None:
    """Append a line to a file, and write it to the disk; a line that was cut off before is removed.

    Raises
    ------
    ConfigError
        If the disk does not take it.
    """
    with system_asked(path, "cannot be written"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a+b") as file:
            file.truncate(_whole_bytes(path))
            file.write(line.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())


def _whole_bytes(path: Path) -> int:
    """Bytes up to the end of the last whole line."""
    step = 4096
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END)
        while end:
            begin = max(0, end - step)
            file.seek(begin)
            at = file.read(end - begin).rfind(b"\n")
            if at >= 0:
                return begin + at + 1
            end = begin
    return 0


# Files of one leg of a fleet.
#
# legs/ID/ledger            the ledger
# legs/ID/recordings.jsonl  a line a recording: what was found in it; JSON
# legs/ID/summary.json      result of the recording that was counted last, as `replay --out` writes it
# legs/ID/pending.json      the recording whose result is about to be in the ledger
# legs/ID/files.json        known files: size, time of change, key and begin of the recording
# legs/ID/log               a line a recording, for people
# priors/ID.json            what its forecast uses of the measured clearances of the fleet
# cycles/leg=ID/KEY.parquet table of the gait cycles of a recording


Line = dict[str, Any]
"""What is kept of one recording."""


class Outcome(Enum):
    """What became of a recording."""

    COUNTED = "counted"
    ALREADY_COUNTED = "already_counted"
    """All of its time was in the ledger, from other recordings."""
    NO_GAIT = "no_gait"
    """No gait cycle in it fits the leg; nothing is counted."""
    UNREADABLE = "unreadable"
    """Nothing in it can be read; nothing is counted."""

    @property
    def is_final(self) -> bool:
        """Whether other settings of the leg would change nothing."""
        return self in (Outcome.COUNTED, Outcome.ALREADY_COUNTED)


class LegDirectory:
    """Files of one leg.

    Parameters
    ----------
    out : pathlib.Path
        Directory of the fleet.
    leg : str
        Its id.
    """

    def __init__(self, out: Path, leg: str) -> None:
        self.path = out / "legs" / leg
        self.priors = out / "priors" / f"{leg}.json"
        self.ledger = self.path / "ledger"
        self.records = self.path / "recordings.jsonl"
        self.log = self.path / "log"
        self.summary = self.path / "summary.json"
        self.cycles = out / "cycles" / f"leg={leg}"
        self._pending, self._files = self.path / "pending.json", self.path / "files.json"

    def table(self, key: str) -> Path:
        """File of the gait cycles of a recording."""
        return self.cycles / f"{key}.parquet"

    def tables(self) -> list[Path]:
        """Files of the gait cycles of all counted recordings, in the order of time."""
        lines = sorted(self.last_lines(), key=lambda line: (line["begin_ns"], line["key"]))
        return [self.table(line["key"]) for line in lines if line["outcome"] == "counted"]

    def lines(self) -> Iterator[Line]:
        """Records of all recordings so far, in the order in which they were counted.

        Raises
        ------
        ConfigError
            If the file is damaged.
        """
        if not self.records.exists():
            return
        with self.records.open("rb") as file:
            for number, line in enumerate(file, 1):
                if line.endswith(b"\n"):  # otherwise it was cut off, and its recording is still pending
                    yield _object(line, f"{self.records}: line {number}")

    def last_lines(self) -> list[Line]:
        """The last record of each recording, in the order in which these were written.

        What could not be read at first and was counted later stands where it was counted, as in the ledger.
        """
        last: dict[str, Line] = {}
        for line in self.lines():
            last.pop(line["key"], None)
            last[line["key"]] = line
        return list(last.values())

    def last_counted(self) -> Line | None:
        """Record of the recording that was counted last, as it is now; None before the first."""
        return next((line for line in reversed(self.last_lines()) if line["outcome"] == "counted"), None)

    def knowledge(self) -> str:
        """Digest of what a record rests on besides walking: what was done to the ledger, and what is learned.

        That is measured clearances, replaced parts, acknowledged alarms; and the verdict after these.
        """
        learned = self.priors.read_bytes() if self.priors.exists() else b""
        done = f"{measurements_of(self.ledger)}\0{last_changes_of(self.ledger)}\0"
        return hashlib.sha256(done.encode() + learned).hexdigest()[:20]

    def add(self, line: Line, words: str) -> None:
        """Add the record of a recording, and its line in the log; it is no longer pending."""
        append_line(self.records, json.dumps(line, allow_nan=False))
        append_line(self.log, printable(words))
        self._pending.unlink(missing_ok=True)

    def renew(self, line: Line) -> None:
        """Replace the record of a recording; its line in the log stays."""
        append_line(self.records, json.dumps(line, allow_nan=False))

    def note(self, lines: Sequence[str]) -> None:
        """Add lines to the log, unless it has them."""
        known = set(self.log.read_text().splitlines()) if lines and self.log.exists() else set()
        for line in map(printable, lines):
            if line not in known:
                append_line(self.log, line)

    def remove_parts(self) -> None:
        """Remove parts of files that a killed update left."""
        remove_parts(self.path, "*.json")
        remove_parts(self.cycles, "*.parquet")

    def pending(self) -> Line | None:
        """Record of the recording that may or may not be in the ledger; None if there is none."""
        return json_object(self._pending) if self._pending.exists() else None

    def expect(self, line: Line) -> None:
        """Write a record down before its recording is in the ledger."""
        write_whole(self._pending, json.dumps(line, allow_nan=False).encode())

    def forget_pending(self) -> None:
        """Remove the record of a recording that is in `lines` already."""
        self._pending.unlink(missing_ok=True)

    def files(self) -> Line:
        """Known files by path; empty if nothing usable is there, since it can be found again."""
        try:
            return json_object(self._files)
        except ConfigError:
            return {}

    def keep_files(self, files: Mapping[str, Any]) -> None:
        """Replace the known files."""
        write_whole(self._files, json.dumps(files).encode())


def json_object(path: Path) -> Line:
    """The JSON object in a file.

    Raises
    ------
    ConfigError
        If it cannot be read, or is none.
    """
    with system_asked(path, "cannot be read"):
        return _object(path.read_bytes(), str(path))


def _object(content: bytes, source: str) -> Line:
    try:
        value = json.loads(content)
    except ValueError as error:
        raise ConfigError(source, "", "is damaged: it is not JSON") from error
    if not isinstance(value, dict):
        raise ConfigError(source, "", "is damaged: it is no JSON object")
    return value


# One update of a fleet at a time.


@contextmanager
def locked(out: Path, *, waits: bool = False) -> Iterator[None]:
    """Lock a directory; the system releases the lock of a process that is killed.

    Parameters
    ----------
    out : pathlib.Path
        Of a fleet, or of a leg.
    waits : bool
        Whether to wait for another process.

    Raises
    ------
    ConfigError
        If another process updates it, or it cannot be written to.
    """
    with system_asked(out, "cannot be written"):
        out.mkdir(parents=True, exist_ok=True)
        file = (out / ".lock").open("ab")
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except OSError as error:
            raise ConfigError(
                str(out), "", "is being updated by another process; wait for its end"
            ) from error
        yield


# Parquet and CSV files through pyarrow.


def arrow() -> Any:
    """The module pyarrow, with its readers and writers of files.

    Raises
    ------
    LegWearError
        If it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.csv
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        text = "a fleet's tables need pyarrow, which is not installed; pip install 'leg_wear_monitor[fleet]'"
        raise LegWearError(text) from error
    return pyarrow


def write_parquet(path: Path, columns: Mapping[str, Any]) -> None:
    """Write columns as a Parquet file, whole or not at all; equal columns give equal files."""
    write_table(path, arrow().table(dict(columns)))


def write_table(path: Path, table: Any) -> None:
    """Write a table of pyarrow, whole or not at all, in the format that the name ends in."""
    pyarrow, buffer = arrow(), io.BytesIO()
    if path.suffix == ".csv":
        pyarrow.csv.write_csv(table, buffer)
    else:
        pyarrow.parquet.write_table(table, buffer, compression="zstd", compression_level=9)
    write_whole(path, buffer.getvalue())


def read_tables(files: Iterable[tuple[str, Path]]) -> Any:
    """Rows of Parquet files as one table of pyarrow, with the leg of each row as its first column.

    Parameters
    ----------
    files : iterable
        Leg and path of each file. A column that a file does not have is null in its rows.

    Raises
    ------
    ConfigError
        If a file cannot be read.
    """
    pyarrow, tables = arrow(), []
    for leg, path in files:
        try:
            table = pyarrow.parquet.ParquetFile(path).read()
        except (OSError, pyarrow.ArrowException) as error:
            fault = f"cannot be read: {' '.join(str(error).split())[:200]}"
            raise ConfigError(str(path), "", fault) from error
        legs = pyarrow.array([leg] * len(table), pyarrow.string())
        tables.append(table.add_column(0, "leg", legs))
    if not tables:
        return pyarrow.table({"leg": pyarrow.array([], pyarrow.string())})
    return pyarrow.concat_tables(tables, promote_options="default")


# How much of a clearance is used up.


_Values = TypeVar("_Values", float, NDArray[np.float64])


def used_fraction(clearance_m: _Values, new_m: float, limit_m: float) -> _Values:
    """Fraction of the clearance from new to limit that is used up; above 1 beyond the limit."""
    return (clearance_m - new_m) / (limit_m - new_m)


def used_of(joint: Line) -> float:
    """That fraction of a `JointClearance` as a record has it, by the believed clearance.

    Where nothing is valid, by what measurements of the gait show, or else by counting.
    """
    known = (joint.get("believed_m"), joint["seen_m"], joint["counted_m"])
    clearance_m = next(each for each in known if each is not None)
    used: float = used_fraction(clearance_m, joint["new_m"], joint["limit_m"])
    return used


# Table of the gait cycles of a recording: a row a minute, or a row a gait cycle.


Columns = dict[str, NDArray[Any]]

_MINUTE_NS = 60 * 10**9
_LAST = ("cycle", "clearance_m", "clearance_max_m", "growth_m_per_cycle")
_SUM = ("moving_s", "bridged_s", "impacts")
_MAX = ("peak_force_n",)
_EXACT = ("cycle", "clearance_m", "clearance_max_m", "growth_m_per_cycle")  # others as 32 bits
_WHOLE = ("cycle", "impacts")


def cycle_columns(result: "ReplayResult", row: str) -> Columns:
    """Columns of the table of a replay; a joint's value after a dot: ``clearance_m.A``.

    Parameters
    ----------
    result : ReplayResult
    row : str
        ``minute``: of the gait cycles that end in a minute, the last counter, clearance and growth; the
        sum of times and impacts; the maximum of peak forces; the mean of the rest. ``cycle``: each gait
        cycle.
    """
    history, monitor = result.history, result.monitor
    begins = _begins(history.stamp_ns, row)
    ends = np.append(begins[1:], len(history)) - 1 if len(history) else begins
    columns: Columns = {
        "stamp_ns": history.stamp_ns[ends],
        "cycles": np.diff(np.append(begins, len(history))).astype(np.int32),
    }
    for name in CYCLE_COLUMNS:
        columns[name] = _reduced(name, history.column(name), begins, ends)
    for name in JOINT_COLUMNS:
        values = history.joint_column(name)
        for k, joint in enumerate(history.clearance_joints):
            columns[f"{name}.{joint}"] = _reduced(name, values[:, k], begins, ends)
    return columns | _used(history, monitor.mechanism, monitor.clearance_limits_m, ends)


def _used(history: History, mechanism: Any, limits_m: Any, ends: NDArray[np.int64]) -> Columns:
    """Fraction of the clearance from new to limit that is used up, by joint."""
    clearance = history.joint_column("clearance_m")[ends]
    columns: Columns = {}
    for k, joint in enumerate(history.clearance_joints):
        new = mechanism.clearances[joint].radial_clearance
        used = used_fraction(clearance[:, k], new, limits_m[k])
        columns[f"used_fraction.{joint}"] = used.astype(np.float32)
    return columns


def _begins(stamp_ns: NDArray[np.int64], row: str) -> NDArray[np.int64]:
    """Index of the first gait cycle of each row."""
    if row == "cycle" or not len(stamp_ns):
        return np.arange(len(stamp_ns))
    minute = stamp_ns // _MINUTE_NS
    return np.concatenate([[0], np.flatnonzero(np.diff(minute)) + 1])


def _reduced(
    name: str, values: NDArray[np.float64], begins: NDArray[np.int64], ends: NDArray[np.int64]
) -> NDArray[Any]:
    """Values of the rows of a column, NaN where none is known."""
    if not len(values) or name in _LAST:
        reduced = values[ends]
    elif name in _SUM:
        reduced = np.add.reduceat(np.nan_to_num(values), begins)  # of cycles that were followed
    elif name in _MAX:
        reduced = np.fmax.reduceat(values, begins)
    else:
        is_known = np.isfinite(values)
        count = np.add.reduceat(is_known.astype(float), begins)
        with np.errstate(invalid="ignore"):
            reduced = np.add.reduceat(np.where(is_known, values, 0.0), begins) / count
    if name in _WHOLE:
        return np.asarray(reduced.astype(np.int64))
    return np.asarray(reduced if name in _EXACT else reduced.astype(np.float32))


# Tables of the recordings of a fleet: verdicts, lives, and the recordings themselves.


Legs = Iterable[tuple[str, str, LegDirectory]]
"""Id, lot and files of each leg."""

_WHERE = {"leg": "string", "lot": "string", "key": "string"}

RECORDINGS = {
    **_WHERE, "file": "string", "outcome": "string", "begin_ns": "int64", "end_ns": "int64",
    "duration_s": "float64", "cycles": "int64", "unmonitored_s": "float64", "already_counted": "int64",
    "is_partial": "bool_", "is_late": "bool_", "findings": "string",
}  # fmt: skip
VERDICTS = {
    **_WHERE, "stamp_ns": "int64", "state": "string", "fault_code": "string", "joints": "string",
    "since_ns": "int64", "why": "string", "do": "string", "not_valid": "string",
}  # fmt: skip
LIVES = {
    **_WHERE, "stamp_ns": "int64", "joint": "string",
    "believed_m": "float64", "believed_sigma_m": "float64", "believed_by": "string", "status": "string",
    "counted_m": "float64", "seen_m": "float64", "seen_sigma_m": "float64", "seen_by": "string",
    "new_m": "float64", "limit_m": "float64", "used_fraction": "float64",
    "p10_h": "float64", "p50_h": "float64", "p90_h": "float64",
}  # fmt: skip


def table_of(name: str, legs: Legs) -> Any:
    """Table ``recordings``, ``verdicts`` or ``lives``; the recordings of a leg in the order of counting."""
    (columns, rows), pyarrow = _TABLES[name], arrow()
    schema = pyarrow.schema([(name, getattr(pyarrow, kind)()) for name, kind in columns.items()])
    found = []
    for leg, lot, directory in legs:
        for line in directory.last_lines():
            where = {"leg": leg, "lot": lot, "key": line["key"]}
            found += [where | row for row in rows(line)]
    return pyarrow.Table.from_pylist(found, schema=schema)


def _recording(line: Line) -> Iterator[Line]:
    """The row of a recording."""
    lost = line["lost"] or {}
    given = {name: line[name] for name in RECORDINGS if name in line}
    counts = {name: lost.get(name) for name in ("unmonitored_s", "already_counted")}
    yield given | counts | {"findings": "; ".join(line["findings"])}


def _verdict(line: Line) -> Iterator[Line]:
    """The row of the verdict at the end of a counted recording."""
    verdict = line["verdict"]
    if verdict:
        texts = {name: ",".join(verdict[name]) for name in ("joints", "not_valid")}
        yield {"stamp_ns": line["end_ns"], **{k: verdict[k] for k in VERDICTS if k in verdict}, **texts}


def _lives(line: Line) -> Iterator[Line]:
    """At the end of a counted recording, a row for each joint, and for the whole ``leg``."""
    for joint in (*line["clearances"], "leg") if line["verdict"] else ():
        clearance = line["clearances"].get(joint) or {}
        row = {"stamp_ns": line["end_ns"], "joint": joint, **clearance, **(line["life"].get(joint) or {})}
        if clearance:
            row["used_fraction"] = used_of(clearance)
            row["seen_by"] = ",".join(clearance["seen_by"])
        yield row


_TABLES: dict[str, tuple[dict[str, str], Callable[[Line], Iterator[Line]]]] = {
    "recordings": (RECORDINGS, _recording),
    "verdicts": (VERDICTS, _verdict),
    "lives": (LIVES, _lives),
}
