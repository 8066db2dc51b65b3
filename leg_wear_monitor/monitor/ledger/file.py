"""The ledger's file, an SQLite database: created whole, checked before use, written in transactions."""

import base64
import io
import json
import os
import shutil
import sqlite3
import tempfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, TypeVar, get_origin
from urllib.parse import quote

import attrs
import numpy as np
from cattrs.preconf.json import make_converter

from leg_wear_monitor.errors import LegWearError, one_line
from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.files import finite_or_none, or_nan
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    ClearancePoint,
    Commissioned,
    CorrectedClearance,
    Entry,
    Event,
    IdentifiedLeg,
    JointWear,
    Measurement,
    Run,
    SimulatedReference,
    VerdictEvent,
)
from leg_wear_monitor.twin.reference import UNLIKE
from leg_wear_monitor.twin.references import CADENCES

FORMAT = 1  # PRAGMA user_version
_APPLICATION_ID = 0x4C574D31  # "LWM1"

_Record = TypeVar("_Record", bound=attrs.AttrsInstance)

TABLES: dict[type[attrs.AttrsInstance], str] = {
    Run: "run",
    JointWear: "joint",
    Alarm: "alarm",
    AlarmEvent: "alarm_history",
    Audit: "audit",
    ClearancePoint: "history",
    Measurement: "measurement",
    CorrectedClearance: "correction",
    VerdictEvent: "verdict",
    Commissioned: "commissioning",
    CommissionedTorque: "torque_commissioning",
    IdentifiedLeg: "identified_leg",
    SimulatedReference: "torque_reference",
}
"""Table of each class of records."""

_IN_FORCE = (JointWear, Alarm)
"""Classes whose rows are part of the last entry; the others only grow."""

PLAIN_TABLES = {
    "binding": "key TEXT PRIMARY KEY, value TEXT NOT NULL",
    "entry": "stamp_ns INTEGER NOT NULL, run INTEGER NOT NULL, checksum INTEGER NOT NULL",
    "total": "name TEXT PRIMARY KEY, value REAL NOT NULL",
}
"""Tables without a class: the leg that the wear belongs to, the last entry, and its counters."""


# Records as plain rows: one table per class, one column per field.
#
# Numbers and texts are columns of these types. An array is a BLOB in numpy's NPY format. Everything else,
# such as a record within a record, is JSON; arrays in it are NPY in base64. An unknown number is NULL.


def _is_array(kind: Any) -> bool:
    return get_origin(kind) is np.ndarray or kind is np.ndarray


def _npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array, allow_pickle=False)
    return file.getvalue()


def _array(content: bytes) -> Any:
    return np.load(io.BytesIO(content), allow_pickle=False)


_json = make_converter(detailed_validation=False)
_json.register_unstructure_hook_func(_is_array, lambda array: base64.b64encode(_npy(array)).decode())
_json.register_structure_hook_func(_is_array, lambda text, _: _array(base64.b64decode(text)))
_json.register_unstructure_hook(float, finite_or_none)
_json.register_structure_hook(float, lambda value, _: or_nan(value))


def _columns(kind: type[attrs.AttrsInstance]) -> dict[str, Any]:
    """Names and types of the fields of a class, without the number of its row."""
    attrs.resolve_types(kind)
    return {field.name: field.type for field in attrs.fields(kind) if field.name != "id"}


def column_type(kind: Any) -> str:
    """Type of the column of a field."""
    if _is_array(kind):
        return "BLOB"
    if isinstance(kind, type) and issubclass(kind, int):  # INTEGER is for flags and levels as well
        return "INTEGER"
    return "REAL" if kind is float else "TEXT"


def definitions() -> dict[str, str]:
    """Columns of each table."""
    return PLAIN_TABLES | {
        table: "id INTEGER PRIMARY KEY, "
        + ", ".join(f'"{name}" {column_type(of)}' for name, of in _columns(kind).items())
        for kind, table in TABLES.items()
    }


def create_tables(db: sqlite3.Connection) -> None:
    """Create the tables, empty; to be called within a transaction."""
    for table, columns in definitions().items():
        db.execute(f"CREATE TABLE {table} ({columns}) STRICT")
    db.execute(f"PRAGMA application_id = {_APPLICATION_ID}")
    db.execute(f"PRAGMA user_version = {FORMAT}")


def _cell(value: Any, kind: Any) -> Any:
    if _is_array(kind):
        return _npy(value)
    if kind is float:
        return finite_or_none(value)
    if value is None or kind is str:
        return value
    return (
        int(value)
        if column_type(kind) == "INTEGER"
        else json.dumps(_json.unstructure(value, kind), allow_nan=False)
    )


def _value(cell: Any, kind: Any) -> Any:
    if kind is float:
        return or_nan(cell)
    if cell is None or kind in (str, int):
        return cell
    if _is_array(kind):
        return _array(cell)
    return kind(cell) if column_type(kind) == "INTEGER" else _json.structure(json.loads(cell), kind)


def add(db: sqlite3.Connection, record: attrs.AttrsInstance, row: int | None = None) -> None:
    """Add a record as a row, or replace a row."""
    columns = _columns(type(record))
    cells = [_cell(getattr(record, name), kind) for name, kind in columns.items()]
    places = ", ".join("?" * (len(cells) + 1))
    db.execute(f"INSERT OR REPLACE INTO {TABLES[type(record)]} VALUES ({places})", (row, *cells))


def read(db: sqlite3.Connection, kind: type[_Record]) -> tuple[_Record, ...]:
    """All records of a class, in the order in which they were written."""
    columns, has_id = _columns(kind), "id" in attrs.fields_dict(kind)
    found = []
    for number, *cells in db.execute(f"SELECT * FROM {TABLES[kind]} ORDER BY id"):
        pairs = zip(columns.items(), cells, strict=True)
        values = {name: _value(cell, of) for (name, of), cell in pairs}
        found.append(kind(**values, **({"id": number} if has_id else {})))
    return tuple(found)


# Entries and events.


def write_run(db: sqlite3.Connection, run: Run) -> None:
    """Write the row of a run again."""
    add(db, run, run.number)


def write_entry(db: sqlite3.Connection, run: int, entry: Entry) -> None:
    """Replace the last entry; its spans are in the row of its run."""
    db.executemany("INSERT OR REPLACE INTO total VALUES (?, ?)", entry.totals.items())
    for kind in _IN_FORCE:
        db.execute(f"DELETE FROM {TABLES[kind]}")
    records: tuple[attrs.AttrsInstance, ...] = (*entry.joints, *entry.alarms)
    for record in records:
        add(db, record)
    db.execute("DELETE FROM entry")
    row = (entry.stamp_ns, run)
    db.execute("INSERT INTO entry VALUES (?, ?, ?)", (*row, _checksum(db, *row)))


def read_entry(db: sqlite3.Connection, runs: Iterable[Run]) -> Entry | None:
    """The last entry; None in a new ledger.

    Raises
    ------
    ValueError
        If its rows are not the written ones.
    """
    row = db.execute("SELECT stamp_ns, run, checksum FROM entry").fetchone()
    if row is None:
        return None
    stamp_ns, number, checksum = row
    if checksum != _checksum(db, stamp_ns, number):
        raise ValueError("the checksum of the last entry does not fit its content")
    (run,) = (each for each in runs if each.number == number)
    totals = dict(db.execute("SELECT name, value FROM total"))
    return Entry(stamp_ns, read(db, JointWear), totals, read(db, Alarm), run.spans)


def _checksum(db: sqlite3.Connection, stamp_ns: int, run: int) -> int:
    """CRC-32 of the rows of the last entry: SQLite does not notice a changed value."""
    sources = ("total", *(TABLES[kind] for kind in _IN_FORCE), f"run WHERE id = {run}")
    rows = [db.execute(f"SELECT * FROM {source} ORDER BY 1").fetchall() for source in sources]
    return zlib.crc32(repr((stamp_ns, rows)).encode())


def write_event(db: sqlite3.Connection, event: Event) -> None:
    """Append an event; to be called within a transaction.

    If a measurement already has a row, it was withdrawn, and the row is updated. A reset, and its
    undoing, delete the signatures of the drive torque, because they belong to different clearances. The
    stamps cannot order them: stamps of recordings come from a different clock than the operator's.
    """
    match event:
        case Measurement(id=row) if row:
            add(db, event, row)
            return
        case Audit(what="reset_wear" | "undo_reset"):
            db.execute(f"DELETE FROM {TABLES[CommissionedTorque]}")
        case SimulatedReference():
            kept = _beside(read(db, SimulatedReference), event)
            db.execute(f"DELETE FROM {TABLES[SimulatedReference]}")
            for one in kept:
                add(db, one)
    add(db, event)


def _beside(stored: Iterable[SimulatedReference], new: SimulatedReference) -> list[SimulatedReference]:
    """References that stay together with a new one.

    A whole reference replaces the reference of its cadence. An unfinished reference stays until the next one.
    """
    whole = [one for one in stored if one.reference.is_whole]
    if not new.reference.is_whole:
        return whole
    speed = new.reference.profile.speed
    others = [one for one in whole if not _is_alike(one.reference.profile.speed, speed)]
    return others[1 - CADENCES :]


def _is_alike(speed: float, other: float) -> bool:
    """True if two mean speeds of the crank [rad/s] belong to the same cadence."""
    return abs(speed - other) <= UNLIKE * abs(other)


def commissioned_torques(stored: Iterable[CommissionedTorque]) -> list[CommissionedTorque]:
    """Signatures of the drive torque of the present parts: the last ones of each cadence, newest first.

    Those before a correction have different standard deviations.
    """
    found: list[CommissionedTorque] = []
    for one in reversed(tuple(stored)):
        # the deviations of unknown clearances grow with the corrections, which differ from case to case
        if found and not np.allclose(one.sigma_m, found[0].sigma_m, rtol=0.1, atol=0.0):
            break
        if not any(_is_alike(one.speed, other.speed) for other in found):
            found.append(one)
    return found[:CADENCES]


# The file: created whole, locked by one process, checked before use.


REMEDY = "move it away to begin with new parts, or put a copy of it back"  # ends messages about damage

_MODE = 0o640  # mode of new files, reduced by the umask
# Damage shows as an error of SQLite, or as a value that cannot be read.
_DAMAGE = (sqlite3.Error, ValueError, TypeError, LookupError, EOFError)
_NOT_WRITABLE = (
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_CANTOPEN,
)


class LedgerError(LegWearError):
    """A ledger cannot be used."""


def connect(path: Path, binding: Mapping[str, str]) -> sqlite3.Connection:
    """Open or create a ledger, and lock it until the connection is closed.

    Parameters
    ----------
    path : pathlib.Path
    binding : mapping of str to str
        The leg that the ledger must belong to.

    Raises
    ------
    LedgerError
        If the file is damaged, not a ledger, of a different leg, in use, or cannot be written.
    """
    if not os.path.lexists(path):
        _create(path, binding)
    if not path.is_file():
        raise LedgerError(f"{path}: cannot be opened: it is not a file")
    with damage_refused(path):
        db = _connect(path, "rw")
    try:
        with damage_refused(path):
            _lock_and_check(db, path, binding)
    except BaseException:
        db.close()
        raise
    return db


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """A transaction: data written within the context are on the disk at its end, or not at all."""
    db.execute("BEGIN EXCLUSIVE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise


@contextmanager
def damage_refused(path: Path) -> Iterator[None]:
    """Report in one line why a file is unusable."""
    try:
        yield
    except _DAMAGE as error:
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
        if code == sqlite3.SQLITE_BUSY:
            fault = "is in use by another monitor. End that monitor, or set a different ledger.path"
        elif code in _NOT_WRITABLE:
            fault = f"cannot be written: {one_line(error)}. Expected a writable disk"
        else:
            fault = f"is damaged or not a ledger: {one_line(error)}; {REMEDY}"
        raise LedgerError(f"{path}: {fault}") from error


def hardware_id_of(path: Path) -> str:
    """Hardware id that a ledger belongs to; empty if it cannot be read: `connect` then says why."""
    if not path.is_file():
        return ""
    try:
        with closing(_connect(path, "ro")) as db:
            row = db.execute("SELECT value FROM binding WHERE key = 'hardware_id'").fetchone()
    except sqlite3.Error:
        return ""
    return str(row[0]) if row else ""


@contextmanager
def copy_of(path: str | Path) -> Iterator[Path]:
    """Copy a ledger into a temporary directory, to try a change, or to read it while a monitor has it locked.

    The yielded path has no file if there is no ledger.

    Raises
    ------
    LedgerError
        If the ledger cannot be read. A LedgerError about the copy is raised again, about the ledger itself.
    """
    original = Path(path)
    with tempfile.TemporaryDirectory(prefix="leg_wear_") as place:
        copy = Path(place) / original.name
        try:
            for ending in ("", "-journal"):  # the journal undoes an interrupted transaction
                source = original.with_name(original.name + ending)
                if source.exists():
                    shutil.copyfile(source, copy.with_name(copy.name + ending))
        except OSError as error:
            raise LedgerError(f"{original}: cannot be read: {error.strerror}") from error
        try:
            yield copy
        except LedgerError as error:
            raise LedgerError(str(error).replace(str(copy), str(original))) from error


def _create(path: Path, binding: Mapping[str, str]) -> None:
    """Create a ledger without wear; even if this is cut off, the path has no ledger or a complete one."""
    new = path.with_name(f"{path.name}.new")
    try:
        new.unlink(missing_ok=True)
        os.close(os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _MODE))
        with closing(_connect(new, "rw")) as db, transaction(db):
            create_tables(db)
            db.executemany("INSERT INTO binding VALUES (?, ?)", binding.items())
        new.rename(path)
    except (sqlite3.Error, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else one_line(error)
        raise LedgerError(f"{path}: cannot be created: {reason}. Expected a writable place") from error


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Connection to a file that is not checked; ``mode``, such as ``ro``, is an SQLite URI's."""
    db = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=0.5,  # seconds to wait for a lock of a different process
        isolation_level=None,  # transactions begin where this module begins them
        # the node's executor may call from a different thread than the one that opened it, never from two at
        # once
        check_same_thread=False,
    )
    db.execute("PRAGMA synchronous = EXTRA")  # a transaction survives a power cut once it has ended
    # The lock lasts until the connection is closed; after a kill, the system releases it.
    db.execute("PRAGMA locking_mode = EXCLUSIVE")
    return db


def _lock_and_check(db: sqlite3.Connection, path: Path, binding: Mapping[str, str]) -> None:
    """Lock a file, and check that it is sound, has this version's tables, and is of this leg."""
    with transaction(db):  # the lock outlasts it, see `_connect`
        if _tables(db) != _expected_tables() or db.execute("PRAGMA user_version").fetchone() != (FORMAT,):
            raise LedgerError(
                f"{path}: is not a ledger of format {FORMAT}, the only one that this version knows; use the "
                "version that wrote it, or move it away to begin with new parts"
            )
        faults = [fault for (fault,) in db.execute("PRAGMA integrity_check")]
        if faults != ["ok"]:
            raise ValueError(faults[0])
        _check_binding(db, path, binding)


def _tables(db: sqlite3.Connection) -> tuple[tuple[str, str], ...]:
    """Names and definitions of everything in a file, triggers and views included."""
    return tuple(db.execute("SELECT name, sql FROM sqlite_master ORDER BY name"))


def _expected_tables() -> tuple[tuple[str, str], ...]:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        create_tables(db)
        return _tables(db)


def _check_binding(db: sqlite3.Connection, path: Path, binding: Mapping[str, str]) -> None:
    """Refuse the ledger of a different leg, or with other parameters of this leg."""
    found = dict(db.execute("SELECT key, value FROM binding"))
    for key, ours in binding.items():
        if found.get(key) != ours:
            what = f"{path}: belongs to {key.replace('_', ' ')} {found.get(key)}, not {ours}; "
            if key == "hardware_id":
                what += f"if it is the ledger of this leg, set {key}: {found.get(key)}, otherwise "
            raise LedgerError(
                what
                + "set ledger.path to a different file for this leg, or the parameters back to the former leg"
            )
