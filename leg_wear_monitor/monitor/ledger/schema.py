"""The ledger's tables, which no other file defines, and the seal: one checksum over all their rows.

SQLite has no checksums over its pages. The seal is the sum of the checksums of all rows, so a transaction
brings it up to date from the rows that it changes, however long the history is. It protects against damage
and mix-ups, not against somebody who computes it again.
"""

import hashlib
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import cache
from typing import Any

APPLICATION_ID = 0x4C574D31  # "LWM1"
UNRELEASED_ID = 0x4C574C31  # of the formats before the first release, which had their own numbers
FORMAT = 1  # PRAGMA user_version

TABLES = """
-- what the wear belongs to: hardware_id, mechanism, fingerprint, joints, sectors, wear_acceleration
CREATE TABLE binding (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;

-- a start of the monitor; closed is 1 once it ended in order and no loss of an earlier one was left to be
-- acknowledged, interval_s the longest time between entries, epoch the one of its clock at its end, boot_id
-- the computer's, '' if not known
CREATE TABLE run (
    id INTEGER PRIMARY KEY, closed INTEGER NOT NULL, interval_s REAL NOT NULL, epoch INTEGER NOT NULL,
    boot_id TEXT NOT NULL
) STRICT;

-- the one entry in force: joint, total, alarm and its run's spans and loads are of this instant
CREATE TABLE entry (
    id INTEGER PRIMARY KEY CHECK (id = 1), run INTEGER NOT NULL, stamp_ns INTEGER NOT NULL
) STRICT;

-- mean wear depths of the surfaces; the rest since the part was new; wear_coefficient_per_pa, of bushing and
-- journal together, is that with which the last of it was counted, 0 if it is not known
CREATE TABLE joint (
    name TEXT PRIMARY KEY, bushing_m REAL NOT NULL, journal_m REAL NOT NULL, cycles INTEGER NOT NULL,
    moving_s REAL NOT NULL, replaced_ns INTEGER NOT NULL, wear_coefficient_per_pa REAL NOT NULL
) STRICT, WITHOUT ROWID;

-- wear depths around the surfaces as they were last written, at most a minute of motion before the entry:
-- float64, little endian, (2, sectors) of bushing and journal [m]; the means in joint are the later ones
CREATE TABLE surface (name TEXT PRIMARY KEY, depth BLOB NOT NULL) STRICT;

-- counters over all runs, and values in force, such as the limit of each clearance (clearance_limit_A_m)
CREATE TABLE total (name TEXT PRIMARY KEY, value REAL NOT NULL) STRICT, WITHOUT ROWID;

-- time whose wear is in the surfaces, by the clock of an epoch
CREATE TABLE span (
    run INTEGER NOT NULL, part INTEGER NOT NULL, begin_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL,
    epoch INTEGER NOT NULL, PRIMARY KEY (run, part)
) STRICT, WITHOUT ROWID;

-- foot loads that acted in a run: gait cycles and time in motion, and mean and standard deviation of the
-- largest vertical force of a cycle, by that force to the nearest 100 N
CREATE TABLE load (
    run INTEGER NOT NULL, about_n INTEGER NOT NULL, cycles INTEGER NOT NULL, moving_s REAL NOT NULL,
    mean_n REAL NOT NULL, sigma_n REAL NOT NULL, PRIMARY KEY (run, about_n)
) STRICT, WITHOUT ROWID;

-- alarms that are not OK: they stay latched over a new start; worst (of estimates and measurements of a
-- clearance, the last) and limit as far as they are known, with the standard deviation of worst and its
-- source or cause, '' if it has none
CREATE TABLE alarm (
    kind TEXT NOT NULL, subject TEXT NOT NULL, level INTEGER NOT NULL, present INTEGER NOT NULL,
    acknowledged INTEGER NOT NULL, raised_ns INTEGER NOT NULL, worst REAL, limit_value REAL, sigma REAL,
    cause TEXT NOT NULL, PRIMARY KEY (kind, subject)
) STRICT, WITHOUT ROWID;

-- changes of alarms: shown level, acknowledgement, value and limit of that time
CREATE TABLE alarm_history (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, kind TEXT NOT NULL, subject TEXT NOT NULL,
    level INTEGER NOT NULL, acknowledged INTEGER NOT NULL, value REAL, limit_value REAL
) STRICT;

-- who did what to the wear; the joint is as it was before, undoes is the row that was undone
CREATE TABLE audit (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, who TEXT NOT NULL, what TEXT NOT NULL, joint TEXT,
    depth BLOB, cycles INTEGER, moving_s REAL, replaced_ns INTEGER, wear_coefficient_per_pa REAL,
    undoes INTEGER
) STRICT;

-- clearances now and then
CREATE TABLE history (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycle INTEGER NOT NULL, joint TEXT NOT NULL,
    clearance_m REAL NOT NULL, clearance_max_m REAL NOT NULL
) STRICT;

-- forecasts now and then: gait cycles to the limit, counted from cycle
CREATE TABLE forecast (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycle INTEGER NOT NULL, joint TEXT NOT NULL,
    p10_cycles REAL NOT NULL, p50_cycles REAL NOT NULL, p90_cycles REAL NOT NULL
) STRICT;

-- changes of the verdict: state and fault_code are stable names; joints, evidence (name, value, limit, unit)
-- and not_valid (figures that do not hold meanwhile) are JSON arrays
CREATE TABLE verdict (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, state TEXT NOT NULL, fault_code TEXT NOT NULL,
    joints TEXT NOT NULL, since_ns INTEGER NOT NULL, why TEXT NOT NULL, to_do TEXT NOT NULL,
    evidence TEXT NOT NULL, not_valid TEXT NOT NULL
) STRICT;

-- clearances measured by hand: of which part (replaced_ns as in joint), what the twin had counted for it,
-- with what probability a smaller one was expected, whether the forecast believes it, and when and by whom it
-- was withdrawn, 0 and '' if it was not
CREATE TABLE measurement (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, who TEXT NOT NULL,
    clearance_m REAL NOT NULL, sigma_m REAL NOT NULL, wear_m REAL NOT NULL, cycles INTEGER NOT NULL,
    replaced_ns INTEGER NOT NULL, expected_below REAL NOT NULL, counts INTEGER NOT NULL,
    withdrawn_ns INTEGER NOT NULL, withdrawn_by TEXT NOT NULL
) STRICT;

-- counted clearances that were replaced by what the drive torque shows: of which part (replaced_ns as in
-- joint), the clearance from then on, and the wear that was counted for it before and is from then on
CREATE TABLE correction (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, clearance_m REAL NOT NULL,
    sigma_m REAL NOT NULL, before_m REAL NOT NULL, wear_m REAL NOT NULL, replaced_ns INTEGER NOT NULL
) STRICT;

-- errors of further encoders; the last row is in force. encoders: a line each; errors: float64, little
-- endian: centres (m), their mean (1 + 2 m) and its covariance
CREATE TABLE commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, encoders TEXT NOT NULL, errors BLOB NOT NULL
) STRICT;

-- signatures of the drive torque while the clearances were known; the last row of each cadence is in force,
-- and a reset or its undoing deletes all. All are float64, little endian: counted clearances of the
-- clearance joints [m], the signature of each gait cycle, and the standard deviations of the clearances [m],
-- above 0 where a correction made them; then the drive by them (delay, time constant, load friction, second
-- order of the low-pass, averaging), the mean speed of the crank, 0 where not known, the temperature of the
-- drive as far as it was measured, and the sensor: its period, how many of its samples were averaged into
-- one, and whether these are instants. A row with is_before 1 is before the correction of the next row, with
-- what its signatures had in addition to those of the model; one with 2 is of a leg that stays changed, until
-- a baseline of its cadence follows
CREATE TABLE torque_commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycles INTEGER NOT NULL, clearance_m BLOB NOT NULL,
    signatures BLOB NOT NULL, sigma_m BLOB NOT NULL, delay_s REAL NOT NULL, time_constant_s REAL NOT NULL,
    load_friction REAL NOT NULL, second_order REAL NOT NULL, mean_s REAL NOT NULL,
    speed_radps REAL NOT NULL, temperature_c REAL, period_s REAL, averaged INTEGER NOT NULL,
    is_instant INTEGER NOT NULL, is_before INTEGER NOT NULL
) STRICT;

-- the leg that the drive torque shows; the last row is in force. bodies: a line each, with factors on masses
-- and lengths of the mechanism file (float64, little endian); the factor on its friction; the compliance
-- between the measured crank angle and the crank, 0 if it is rigid, and the damping of the crank on it over
-- the critical one; the force of the ground on the toe (n, 2) [N] at equal steps of the crank angle from 0,
-- and the standard deviation of its size as a fraction of it
CREATE TABLE identified_leg (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, bodies TEXT NOT NULL, mass BLOB NOT NULL,
    length BLOB NOT NULL, friction REAL NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    damping_ratio REAL NOT NULL, load_n BLOB NOT NULL, load_sigma REAL NOT NULL
) STRICT;

-- torque references that were simulated for this leg, one for each cadence (is_whole 1), and one whose
-- simulation was not finished (0), whose torques are those of the first of its legs: the leg as in
-- identified_leg, speed of its crank [rad/s] and ripple (2, harmonics), clearances (legs, k), and drive
-- torques [N m] of the expected leg and of the other ones (cycles, points each; half as many cycles);
-- float64 and, of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, bodies TEXT NOT NULL, mass BLOB NOT NULL,
    length BLOB NOT NULL, friction REAL NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    damping_ratio REAL NOT NULL, load_n BLOB NOT NULL, load_sigma REAL NOT NULL,
    is_whole INTEGER NOT NULL, speed_radps REAL NOT NULL,
    legs INTEGER NOT NULL, ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL,
    expected_torque_nm BLOB NOT NULL, torque_nm BLOB NOT NULL
) STRICT;

-- the sum of the checksums of all rows of the other tables
CREATE TABLE seal (id INTEGER PRIMARY KEY CHECK (id = 1), checksum BLOB NOT NULL) STRICT;
"""

_MODULUS: int = 2**256
_Values = Iterable[Any]


def create_tables(db: sqlite3.Connection) -> None:
    """Create the tables, empty, and their seal; to be called within a transaction."""
    for statement in TABLES.split(";\n"):
        if statement.strip():
            db.execute(statement)
    db.execute("INSERT INTO seal VALUES (1, ?)", (_as_blob(0),))
    db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    db.execute(f"PRAGMA user_version = {FORMAT}")


def definitions(db: sqlite3.Connection) -> tuple[tuple[str, str, str, str | None], ...]:
    """All definitions in a file: tables and indexes, and added triggers and views."""
    rows = db.execute("SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY type, name")
    return tuple(rows.fetchall())


@cache
def expected_definitions() -> tuple[tuple[str, str, str, str | None], ...]:
    """Definitions in a ledger's file."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        create_tables(db)
        return definitions(db)


def verify(db: sqlite3.Connection) -> None:
    """Compare all rows with the seal.

    Raises
    ------
    ValueError
        If they are not those that were written.
    """
    names = [name for kind, name, *_ in expected_definitions() if kind == "table" and name != "seal"]
    checksum = _as_blob(sum(_checksum(db, name, "TRUE", ()) for name in names))
    if db.execute("SELECT * FROM seal").fetchall() != [(1, checksum)]:
        raise ValueError("the checksum over all its rows is not that of their content")


@contextmanager
def sealed(
    db: sqlite3.Connection, table: str, where: str = "TRUE", parameters: _Values = ()
) -> Iterator[None]:
    """Bring the seal up to date with changes of rows that a condition selects before or after them."""
    before = _checksum(db, table, where, parameters)
    yield
    change = _checksum(db, table, where, parameters) - before
    (kept,) = db.execute("SELECT checksum FROM seal").fetchone()
    db.execute("UPDATE seal SET checksum = ?", (_as_blob(int.from_bytes(kept) + change),))


def add(db: sqlite3.Connection, table: str, values: Mapping[str, Any]) -> None:
    """Add a row to a table whose key is ``id``."""
    (last,) = db.execute(f"SELECT coalesce(max(id), 0) FROM {table}").fetchone()
    places = ", ".join("?" * len(values))
    with sealed(db, table, "id > ?", (last,)):
        db.execute(f"INSERT INTO {table} ({', '.join(values)}) VALUES ({places})", tuple(values.values()))


def replace(
    db: sqlite3.Connection,
    table: str,
    rows: Iterable[tuple[Any, ...]],
    where: str = "TRUE",
    parameters: _Values = (),
) -> None:
    """Replace the rows of a table that a condition selects; those that stay equal are not written."""
    keys = [name for _, name, *_, key in db.execute(f"PRAGMA table_info({table})") if key]
    is_of_key = " AND ".join(f"{key} = ?" for key in keys)
    wanted = list(rows)
    with sealed(db, table, where, parameters):
        kept = db.execute(f"SELECT * FROM {table} WHERE {where}", tuple(parameters)).fetchall()
        gone, new = set(kept).difference(wanted), set(wanted).difference(kept)
        for row in kept:
            if row in gone:
                db.execute(f"DELETE FROM {table} WHERE {is_of_key}", row[: len(keys)])
        for row in wanted:
            if row in new:
                db.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)


def _checksum(db: sqlite3.Connection, table: str, where: str, parameters: _Values) -> int:
    """Sum of the checksums of rows."""
    rows = db.execute(f"SELECT * FROM {table} WHERE {where}", tuple(parameters))
    return sum(int.from_bytes(hashlib.sha256(repr((table, *row)).encode()).digest()) for row in rows)


def _as_blob(checksum: int) -> bytes:
    return (checksum % _MODULUS).to_bytes(32)
