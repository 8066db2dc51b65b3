"""Entries and events as rows of the ledger's tables, and back."""

import sqlite3

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.monitor.alarms import Alarm, Level
from leg_wear_monitor.monitor.ledger_entry import (
    AlarmEvent,
    Audit,
    ClearancePoint,
    Commissioned,
    Entry,
    Event,
    ForecastPoint,
    JointWear,
    Measurement,
)


def write_entry(db: sqlite3.Connection, run: int, entry: Entry) -> None:
    """Replace the entry in force; to be called within a transaction."""
    db.execute("INSERT OR REPLACE INTO entry VALUES (1, ?, ?, ?)", (run, entry.stamp_ns, entry.digest()))
    db.executemany(
        "INSERT OR REPLACE INTO joint VALUES (?, ?, ?, ?, ?)",
        [(j.name, _depth_bytes(j), j.cycles, j.moving_s, j.replaced_ns) for j in entry.joints],
    )
    db.executemany("INSERT OR REPLACE INTO total VALUES (?, ?)", entry.totals.items())
    db.execute("DELETE FROM alarm")
    db.executemany(
        "INSERT INTO alarm VALUES (?, ?, ?, ?, ?, ?)",
        [
            (a.kind, a.subject, int(a.level), int(a.present), int(a.acknowledged), a.raised_ns)
            for a in entry.alarms
        ],
    )
    db.executemany(
        "INSERT OR REPLACE INTO span VALUES (?, ?, ?, ?)",
        [(run, part, *span) for part, span in enumerate(entry.spans)],
    )


def write_event(db: sqlite3.Connection, event: Event) -> None:
    """Append an event; to be called within a transaction."""
    match event:
        case AlarmEvent(stamp_ns, a):
            db.execute(
                "INSERT INTO alarm_history "
                "(stamp_ns, kind, subject, level, acknowledged, value, limit_value) "
                "VALUES (?, ?, ?, ?, ?, ?, ?)",
                (stamp_ns, a.kind, a.subject, int(a.level), int(a.acknowledged), a.value, a.limit),
            )
        case ClearancePoint(stamp_ns, cycle, joint, clearance_m, clearance_max_m):
            db.execute(
                "INSERT INTO history (stamp_ns, cycle, joint, clearance_m, clearance_max_m) "
                "VALUES (?, ?, ?, ?, ?)",
                (stamp_ns, cycle, joint, clearance_m, clearance_max_m),
            )
        case Measurement() | ForecastPoint():
            _append(db, event)
        case Commissioned(stamp_ns, encoders, centre_rad, mean, covariance):
            errors = np.concatenate([centre_rad, mean, covariance.ravel()])
            db.execute(
                "INSERT INTO commissioning (stamp_ns, encoders, errors, digest) VALUES (?, ?, ?, ?)",
                (stamp_ns, "\n".join(encoders), errors.astype("<f8").tobytes(), event.digest()),
            )
        case Audit(stamp_ns, who, what, was):
            before = (was.name, was.cycles, _depth_bytes(was)) if was else (None, None, None)
            db.execute(
                "INSERT INTO audit (stamp_ns, who, what, joint, cycles, depth) VALUES (?, ?, ?, ?, ?, ?)",
                (stamp_ns, who, what, *before),
            )


def _append(db: sqlite3.Connection, event: Measurement | ForecastPoint) -> None:
    """A row of the table whose columns are the event's fields."""
    table = "measurement" if isinstance(event, Measurement) else "forecast"
    values = attrs.asdict(event)
    places = ", ".join("?" * len(values))
    db.execute(f"INSERT INTO {table} ({', '.join(values)}) VALUES ({places})", tuple(values.values()))


def read_measurements(db: sqlite3.Connection) -> tuple[Measurement, ...]:
    """All measured clearances, in the order in which they were noted."""
    names = [field.name for field in attrs.fields(Measurement)]
    rows = db.execute(f"SELECT {', '.join(names)} FROM measurement ORDER BY id")
    return tuple(Measurement(**dict(zip(names, (*row[:-1], bool(row[-1])), strict=True))) for row in rows)


def read_commissioned(db: sqlite3.Connection) -> Commissioned | None:
    """Errors of further encoders as they are held, None if none were commissioned.

    Raises
    ------
    ValueError
        If their checksum is not that of what the table holds.
    """
    columns = "stamp_ns, encoders, errors, digest"
    row = db.execute(f"SELECT {columns} FROM commissioning ORDER BY id DESC LIMIT 1").fetchone()
    if row is None:
        return None
    encoders, errors = tuple(row[1].split("\n")), np.frombuffer(row[2], "<f8").astype(float)
    m = len(encoders)
    p = 1 + 2 * m
    found = Commissioned(row[0], encoders, errors[:m], errors[m : m + p], errors[m + p :].reshape(p, p))
    if found.digest() != row[3]:
        raise ValueError("the checksum of its encoders' errors is not that of its content")
    return found


def read_entry(db: sqlite3.Connection) -> Entry | None:
    """The entry in force, None in a new ledger.

    Raises
    ------
    ValueError
        If its checksum is not that of what the tables hold.
    """
    found = db.execute("SELECT run, stamp_ns, digest FROM entry").fetchone()
    if found is None:
        return None
    run, stamp_ns, digest = found
    spans = db.execute("SELECT begin_ns, end_ns FROM span WHERE run = ? ORDER BY part", (run,))
    entry = Entry(
        stamp_ns=stamp_ns,
        joints=tuple(_joint(*row) for row in db.execute("SELECT * FROM joint ORDER BY name")),
        totals=dict(db.execute("SELECT name, value FROM total")),
        alarms=tuple(_alarm(*row) for row in db.execute("SELECT * FROM alarm")),
        spans=tuple(spans.fetchall()),
    )
    if entry.digest() != digest:
        raise ValueError("its checksum is not that of its content")
    return entry


def read_spans(db: sqlite3.Connection) -> Ints:
    """Begin and end (n, 2) [ns] of all time whose wear is counted, in order of time."""
    spans = db.execute("SELECT begin_ns, end_ns FROM span ORDER BY begin_ns").fetchall()
    return np.array(spans, dtype=np.int64).reshape(-1, 2)


def read_last_run(db: sqlite3.Connection) -> tuple[int, bool, float]:
    """Number of the last run (0 if there was none), whether it was closed, its longest interval [s]."""
    last = db.execute("SELECT id, closed, interval_s FROM run ORDER BY id DESC LIMIT 1").fetchone()
    return (0, True, 0.0) if last is None else (int(last[0]), bool(last[1]), float(last[2]))


def _depth_bytes(joint: JointWear) -> bytes:
    return np.ascontiguousarray(joint.depth, dtype="<f8").tobytes()


def _joint(name: str, depth: bytes, cycles: int, moving_s: float, replaced_ns: int) -> JointWear:
    return JointWear(name, np.frombuffer(depth, "<f8").reshape(2, -1).copy(), cycles, moving_s, replaced_ns)


def _alarm(kind: str, subject: str, level: int, present: int, acknowledged: int, raised_ns: int) -> Alarm:
    return Alarm(
        kind=kind,
        subject=subject,
        level=Level(level),
        present=Level(present),
        acknowledged=bool(acknowledged),
        raised_ns=raised_ns,
    )
