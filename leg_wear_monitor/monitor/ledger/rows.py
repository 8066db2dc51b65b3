"""Records as plain rows: one table per class, one column per field.

Numbers and texts are columns of these types. An array is a BLOB in numpy's NPY format, and everything else,
such as a record within a record, is JSON; arrays in it are NPY in base64. A number that is not known is NULL.
"""

import base64
import io
import json
import sqlite3
import zlib
from collections.abc import Iterable
from typing import Any, TypeVar, get_origin

import attrs
import numpy as np
from cattrs.preconf.json import make_converter

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
    ForecastPoint,
    IdentifiedLeg,
    JointWear,
    Measurement,
    Run,
    SimulatedReference,
    VerdictEvent,
)
from leg_wear_monitor.twin.reference import UNLIKE
from leg_wear_monitor.twin.torque_reference import CADENCES

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
    ForecastPoint: "forecast",
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


# --- tables, cells ---


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
    if isinstance(kind, type) and issubclass(kind, int):  # flags and levels as well
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


# --- entries and events ---


def write_run(db: sqlite3.Connection, run: Run) -> None:
    """Write the row of a run again."""
    add(db, run, run.number)


def write_entry(db: sqlite3.Connection, run: int, entry: Entry) -> None:
    """Replace the last entry; its spans and loads are in the row of its run."""
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
    return Entry(stamp_ns, read(db, JointWear), totals, read(db, Alarm), run.spans, run.loads)


def _checksum(db: sqlite3.Connection, stamp_ns: int, run: int) -> int:
    """CRC-32 of the rows of the last entry: SQLite does not notice a changed value."""
    sources = ("total", *(TABLES[kind] for kind in _IN_FORCE), f"run WHERE id = {run}")
    rows = [db.execute(f"SELECT * FROM {source} ORDER BY 1").fetchall() for source in sources]
    return zlib.crc32(repr((stamp_ns, rows)).encode())


def write_event(db: sqlite3.Connection, event: Event) -> None:
    """Append an event; to be called within a transaction.

    A measurement that already has a row is a withdrawn one: its row says so from then on. A reset, and its
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
        # the deviations of unknown clearances grow with them; a different correction has different ones
        if found and not np.allclose(one.sigma_m, found[0].sigma_m, rtol=0.1, atol=0.0):
            break
        if not any(_is_alike(one.speed, other.speed) for other in found):
            found.append(one)
    return found[:CADENCES]
