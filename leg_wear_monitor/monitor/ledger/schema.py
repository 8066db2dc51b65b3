"""The ledger's tables and their migrations; no other file defines them.

`PRAGMA user_version` is the format: the number of steps of `MIGRATIONS` that were applied to a file. A new
file is created by all steps; to an older file the missing steps are applied in one transaction when it is
opened. A released step is never changed: later changes are further steps. A file of a newer format is
refused.
"""

import sqlite3
from contextlib import closing
from functools import cache

APPLICATION_ID = 0x4C574C31  # "LWL1"

_FIRST = """
-- what the wear belongs to: hardware_id, mechanism, fingerprint, sectors, wear_acceleration
CREATE TABLE binding (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;

-- a start of the monitor; closed is 1 once it ended in order, interval_s the longest time between its entries
CREATE TABLE run (id INTEGER PRIMARY KEY, closed INTEGER NOT NULL, interval_s REAL NOT NULL) STRICT;

-- the one entry in force: what joint, total, alarm and this run's spans hold is of this instant
CREATE TABLE entry (
    id INTEGER PRIMARY KEY CHECK (id = 1), run INTEGER NOT NULL, stamp_ns INTEGER NOT NULL,
    digest BLOB NOT NULL
) STRICT;

-- depth: float64, little endian, (2, sectors) of bushing and journal [m]; the rest since the part was new
CREATE TABLE joint (
    name TEXT PRIMARY KEY, depth BLOB NOT NULL, cycles INTEGER NOT NULL, moving_s REAL NOT NULL,
    replaced_ns INTEGER NOT NULL
) STRICT;

-- counters over all runs
CREATE TABLE total (name TEXT PRIMARY KEY, value REAL NOT NULL) STRICT;

-- time whose wear is in the surfaces
CREATE TABLE span (
    run INTEGER NOT NULL, part INTEGER NOT NULL, begin_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL,
    PRIMARY KEY (run, part)
) STRICT;

-- alarms that are not OK: they stay latched over a new start
CREATE TABLE alarm (
    kind TEXT NOT NULL, subject TEXT NOT NULL, level INTEGER NOT NULL, present INTEGER NOT NULL,
    acknowledged INTEGER NOT NULL, raised_ns INTEGER NOT NULL, PRIMARY KEY (kind, subject)
) STRICT;

-- changes of alarms: shown level, acknowledgement, value and limit of that time
CREATE TABLE alarm_history (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, kind TEXT NOT NULL, subject TEXT NOT NULL,
    level INTEGER NOT NULL, acknowledged INTEGER NOT NULL, value REAL, limit_value REAL
) STRICT;

-- who did what to the wear; depth as it was before a part was replaced
CREATE TABLE audit (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, who TEXT NOT NULL, what TEXT NOT NULL, joint TEXT,
    cycles INTEGER, depth BLOB
) STRICT;

-- clearances now and then
CREATE TABLE history (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycle INTEGER NOT NULL, joint TEXT NOT NULL,
    clearance_m REAL NOT NULL, clearance_max_m REAL NOT NULL
) STRICT;
"""

_SECOND = """
-- clearances measured by hand: of which part (replaced_ns as in joint), what the twin had counted for it,
-- with what probability a smaller one was expected, and whether the forecast believes it
CREATE TABLE measurement (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, who TEXT NOT NULL,
    clearance_m REAL NOT NULL, sigma_m REAL NOT NULL, wear_m REAL NOT NULL, cycles INTEGER NOT NULL,
    replaced_ns INTEGER NOT NULL, expected_below REAL NOT NULL, counts INTEGER NOT NULL
) STRICT;

-- forecasts now and then: gait cycles to the limit, counted from cycle
CREATE TABLE forecast (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycle INTEGER NOT NULL, joint TEXT NOT NULL,
    p10_cycles REAL NOT NULL, p50_cycles REAL NOT NULL, p90_cycles REAL NOT NULL
) STRICT;
"""

_THIRD = """
-- errors of further encoders; the last row is in force. encoders: a line each; errors: float64, little
-- endian: centres (m), their mean (1 + 2 m) and its covariance
CREATE TABLE commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, encoders TEXT NOT NULL, errors BLOB NOT NULL,
    digest BLOB NOT NULL
) STRICT;
"""

# Tables are created again, not altered: their stored definition then equals this text and can be compared.
_FOURTH = """
CREATE TEMP TABLE former AS SELECT * FROM run;
DROP TABLE run;

-- a start of the monitor; closed is 1 once it ended in order, interval_s the longest time between entries,
-- epoch the one of its clock at its end, boot_id the computer's, '' if not known
CREATE TABLE run (
    id INTEGER PRIMARY KEY, closed INTEGER NOT NULL, interval_s REAL NOT NULL,
    epoch INTEGER NOT NULL DEFAULT 0, boot_id TEXT NOT NULL DEFAULT ''
) STRICT;
INSERT INTO run SELECT id, closed, interval_s, 0, '' FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM span;
DROP TABLE span;

-- time whose wear is in the surfaces, by the clock of an epoch
CREATE TABLE span (
    run INTEGER NOT NULL, part INTEGER NOT NULL, begin_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL,
    epoch INTEGER NOT NULL DEFAULT 0, PRIMARY KEY (run, part)
) STRICT;
INSERT INTO span SELECT run, part, begin_ns, end_ns, 0 FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM measurement;
DROP TABLE measurement;

-- clearances measured by hand: of which part (replaced_ns as in joint), what the twin had counted for it,
-- with what probability a smaller one was expected, whether the forecast believes it, and when and by whom it
-- was withdrawn, 0 and '' if it was not
CREATE TABLE measurement (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, who TEXT NOT NULL,
    clearance_m REAL NOT NULL, sigma_m REAL NOT NULL, wear_m REAL NOT NULL, cycles INTEGER NOT NULL,
    replaced_ns INTEGER NOT NULL, expected_below REAL NOT NULL, counts INTEGER NOT NULL,
    withdrawn_ns INTEGER NOT NULL DEFAULT 0, withdrawn_by TEXT NOT NULL DEFAULT ''
) STRICT;
INSERT INTO measurement SELECT id, stamp_ns, joint, who, clearance_m, sigma_m, wear_m, cycles, replaced_ns,
    expected_below, counts, 0, '' FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM audit;
DROP TABLE audit;

-- who did what to the wear; the joint is as it was before (of rows of older formats without moving_s and
-- replaced_ns), undoes is the row that was undone
CREATE TABLE audit (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, who TEXT NOT NULL, what TEXT NOT NULL, joint TEXT,
    cycles INTEGER, depth BLOB, moving_s REAL, replaced_ns INTEGER, undoes INTEGER
) STRICT;
INSERT INTO audit SELECT id, stamp_ns, who, what, joint, cycles, depth, NULL, NULL, NULL FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM commissioning;
DROP TABLE commissioning;

-- errors of further encoders; the last row is in force. encoders: a line each; errors: float64, little
-- endian: centres (m), their mean (1 + 2 m) and its covariance
CREATE TABLE commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, encoders TEXT NOT NULL, errors BLOB NOT NULL
) STRICT;
INSERT INTO commissioning SELECT id, stamp_ns, encoders, errors FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM joint;
DROP TABLE joint;

-- depth: float64, little endian, (2, sectors) of bushing and journal [m]; the rest since the part was new.
-- Rows of the head in force alone; they come before those of the last one go, so that they take the pages of
-- the one before that, which are free: no page that holds anything is written over
CREATE TABLE joint (
    head INTEGER NOT NULL, name TEXT NOT NULL, depth BLOB NOT NULL, cycles INTEGER NOT NULL,
    moving_s REAL NOT NULL, replaced_ns INTEGER NOT NULL, PRIMARY KEY (head, name)
) STRICT;
INSERT INTO joint SELECT 0, name, depth, cycles, moving_s, replaced_ns FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM alarm;
DROP TABLE alarm;

-- alarms that are not OK: they stay latched over a new start; worst and limit as far as they are known
CREATE TABLE alarm (
    kind TEXT NOT NULL, subject TEXT NOT NULL, level INTEGER NOT NULL, present INTEGER NOT NULL,
    acknowledged INTEGER NOT NULL, raised_ns INTEGER NOT NULL, worst REAL, limit_value REAL,
    PRIMARY KEY (kind, subject)
) STRICT;
INSERT INTO alarm SELECT kind, subject, level, present, acknowledged, raised_ns, NULL, NULL FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM entry;
DROP TABLE entry;

-- the one entry that the tables hold: joint, total, alarm and its run's spans are of this instant; what came
-- after it is in the log beside the file
CREATE TABLE entry (
    id INTEGER PRIMARY KEY CHECK (id = 1), run INTEGER NOT NULL, stamp_ns INTEGER NOT NULL
) STRICT;
INSERT INTO entry SELECT id, run, stamp_ns FROM former;
DROP TABLE former;

-- a checksum over all rows of each table; of one that only grows up to its row of id last
CREATE TABLE seal (name TEXT PRIMARY KEY, last INTEGER NOT NULL, digest BLOB NOT NULL) STRICT;

-- the last transaction: the how many-th it was, and a checksum over seals, tables' definitions and the
-- checksum before, which is that of the log's last record or of the head before
CREATE TABLE head (
    id INTEGER PRIMARY KEY CHECK (id = 1), number INTEGER NOT NULL, previous BLOB NOT NULL,
    digest BLOB NOT NULL
) STRICT;
"""

_FIFTH = """
-- changes of the verdict: state and fault_code are stable names; joints, evidence (name, value, limit, unit)
-- and not_valid (figures that do not hold meanwhile) are JSON arrays
CREATE TABLE verdict (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, state TEXT NOT NULL, fault_code TEXT NOT NULL,
    joints TEXT NOT NULL, since_ns INTEGER NOT NULL, why TEXT NOT NULL, to_do TEXT NOT NULL,
    evidence TEXT NOT NULL, not_valid TEXT NOT NULL
) STRICT;

-- signatures of the drive torque while the clearances were known; the last row is in force. Both are float64,
-- little endian: counted clearances of the clearance joints [m], and the signature of each gait cycle
CREATE TABLE torque_commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycles INTEGER NOT NULL, clearance_m BLOB NOT NULL,
    signatures BLOB NOT NULL
) STRICT;
"""

_SIXTH = """
-- masses and lengths that the drive torque shows, as factors on those of the mechanism file; the rows of the
-- last stamp are in force
CREATE TABLE body (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, name TEXT NOT NULL, mass REAL NOT NULL,
    length REAL NOT NULL
) STRICT;
"""

_SEVENTH = """
-- friction in the joints that the drive torque shows, as a factor on that of the mechanism file; it belongs
-- to the rows of body with the same stamp
CREATE TABLE friction (id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, factor REAL NOT NULL) STRICT;
"""

_EIGHTH = """
-- the torque reference in force, if it was simulated for this leg: speed of its crank and ripple (2,
-- harmonics), clearances (legs, k), bodies (a line each) and their factors on masses and lengths of the
-- mechanism file, the factor on its friction, and drive torques [N m] of the expected leg and of the wider
-- ones (cycles, points each); float64 and, of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY CHECK (id = 1), stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, expected_torque_nm BLOB NOT NULL,
    torque_nm BLOB NOT NULL
) STRICT;
"""

_NINTH = """
-- counted clearances that were replaced by what the drive torque shows: of which part (replaced_ns as in
-- joint), the clearance from then on, and the wear that was counted for it before and is from then on
CREATE TABLE correction (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, clearance_m REAL NOT NULL,
    sigma_m REAL NOT NULL, before_m REAL NOT NULL, wear_m REAL NOT NULL, replaced_ns INTEGER NOT NULL
) STRICT;

CREATE TEMP TABLE former AS SELECT * FROM joint;
DROP TABLE joint;

-- depth: float64, little endian, (2, sectors) of bushing and journal [m]; the rest since the part was new;
-- sampling_m2 is the variance of the mean depth because sampled replays did not follow all gait cycles.
-- Rows of the head in force alone; they come before those of the last one go, so that they take the pages of
-- the one before that, which are free: no page that holds anything is written over
CREATE TABLE joint (
    head INTEGER NOT NULL, name TEXT NOT NULL, depth BLOB NOT NULL, cycles INTEGER NOT NULL,
    moving_s REAL NOT NULL, replaced_ns INTEGER NOT NULL, sampling_m2 REAL NOT NULL DEFAULT 0,
    PRIMARY KEY (head, name)
) STRICT;
INSERT INTO joint SELECT head, name, depth, cycles, moving_s, replaced_ns, coalesce(
    (SELECT value FROM total WHERE total.name = 'sampling_variance_' || former.name || '_m2'), 0
) FROM former;
DROP TABLE former;
DELETE FROM total WHERE name GLOB 'sampling_variance_*_m2';

CREATE TEMP TABLE former AS SELECT * FROM audit;
DROP TABLE audit;

-- who did what to the wear; the joint is as it was before (of rows of older formats without moving_s,
-- replaced_ns and sampling_m2), undoes is the row that was undone
CREATE TABLE audit (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, who TEXT NOT NULL, what TEXT NOT NULL, joint TEXT,
    cycles INTEGER, depth BLOB, moving_s REAL, replaced_ns INTEGER, undoes INTEGER, sampling_m2 REAL
) STRICT;
INSERT INTO audit SELECT id, stamp_ns, who, what, joint, cycles, depth, moving_s, replaced_ns, undoes, NULL
    FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM measurement;
DROP TABLE measurement;

-- clearances measured by hand: of which part (replaced_ns as in joint), what the twin had counted for it and
-- the standard deviation of that by sampled replays, with what probability a smaller one was expected,
-- whether the forecast believes it, and when and by whom it was withdrawn, 0 and '' if it was not
CREATE TABLE measurement (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, joint TEXT NOT NULL, who TEXT NOT NULL,
    clearance_m REAL NOT NULL, sigma_m REAL NOT NULL, wear_m REAL NOT NULL, cycles INTEGER NOT NULL,
    replaced_ns INTEGER NOT NULL, expected_below REAL NOT NULL, counts INTEGER NOT NULL,
    withdrawn_ns INTEGER NOT NULL DEFAULT 0, withdrawn_by TEXT NOT NULL DEFAULT '',
    wear_sigma_m REAL NOT NULL DEFAULT 0
) STRICT;
INSERT INTO measurement SELECT id, stamp_ns, joint, who, clearance_m, sigma_m, wear_m, cycles, replaced_ns,
    expected_below, counts, withdrawn_ns, withdrawn_by, 0 FROM former;
DROP TABLE former;
"""

_TENTH = """
CREATE TEMP TABLE former AS SELECT * FROM alarm;
DROP TABLE alarm;

-- alarms that are not OK: they stay latched over a new start; worst and limit as far as they are known, with
-- the standard deviation of worst and its source or cause, '' if it has none
CREATE TABLE alarm (
    kind TEXT NOT NULL, subject TEXT NOT NULL, level INTEGER NOT NULL, present INTEGER NOT NULL,
    acknowledged INTEGER NOT NULL, raised_ns INTEGER NOT NULL, worst REAL, limit_value REAL, sigma REAL,
    cause TEXT NOT NULL DEFAULT '', PRIMARY KEY (kind, subject)
) STRICT;
INSERT INTO alarm SELECT kind, subject, level, present, acknowledged, raised_ns, worst, limit_value, NULL, ''
    FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM torque_commissioning;
DROP TABLE torque_commissioning;

-- signatures of the drive torque while the clearances were known; the last row is in force. All are float64,
-- little endian: counted clearances of the clearance joints [m], the signature of each gait cycle, and the
-- standard deviations of the clearances [m], above 0 where a correction made them; then the delay and the
-- time constant of the torque sensor by them
CREATE TABLE torque_commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycles INTEGER NOT NULL, clearance_m BLOB NOT NULL,
    signatures BLOB NOT NULL, sigma_m BLOB NOT NULL, delay_s REAL NOT NULL, time_constant_s REAL NOT NULL
) STRICT;
INSERT INTO torque_commissioning SELECT id, stamp_ns, cycles, clearance_m, signatures,
    zeroblob(length(clearance_m)), 0, 0 FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM torque_reference;
DROP TABLE torque_reference;

-- the torque reference in force, if it was simulated for this leg (id 1), and one whose simulation was not
-- finished (id 2), whose torques are those of the first of its legs: speed of its crank and ripple (2,
-- harmonics), clearances (legs, k), bodies (a line each) and their factors on masses and lengths of the
-- mechanism file, the factor on its friction, and drive torques [N m] of the expected leg and of the other
-- ones (cycles, points each; half as many cycles); float64 and, of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY CHECK (id IN (1, 2)), stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, expected_torque_nm BLOB NOT NULL,
    torque_nm BLOB NOT NULL
) STRICT;
INSERT INTO torque_reference SELECT * FROM former;
DROP TABLE former;
"""

_ELEVENTH = """
CREATE TEMP TABLE former AS SELECT * FROM torque_commissioning;
DROP TABLE torque_commissioning;

-- signatures of the drive torque while the clearances were known; the last row is in force. All are float64,
-- little endian: counted clearances of the clearance joints [m], the signature of each gait cycle, and the
-- standard deviations of the clearances [m], above 0 where a correction made them; then the delay and the
-- time constant of the torque sensor by them, and the mean speed of the crank, 0 where it is not known
CREATE TABLE torque_commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycles INTEGER NOT NULL, clearance_m BLOB NOT NULL,
    signatures BLOB NOT NULL, sigma_m BLOB NOT NULL, delay_s REAL NOT NULL, time_constant_s REAL NOT NULL,
    speed_radps REAL NOT NULL
) STRICT;
INSERT INTO torque_commissioning SELECT id, stamp_ns, cycles, clearance_m, signatures, sigma_m, delay_s,
    time_constant_s, 0 FROM former;
DROP TABLE former;
"""

_TWELFTH = """
CREATE TEMP TABLE former AS SELECT * FROM torque_reference;
DROP TABLE torque_reference;

-- torque references that were simulated for this leg, one for each cadence (is_whole 1), and one whose
-- simulation was not finished (0), whose torques are those of the first of its legs: speed of its crank
-- [rad/s] and ripple (2, harmonics), clearances (legs, k), bodies (a line each) and their factors on masses
-- and lengths of the mechanism file, the factor on its friction, and drive torques [N m] of the expected leg
-- and of the other ones (cycles, points each; half as many cycles); float64 and, of torques, float16, little
-- endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY, is_whole INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, expected_torque_nm BLOB NOT NULL,
    torque_nm BLOB NOT NULL
) STRICT;
INSERT INTO torque_reference SELECT id, id = 1, stamp_ns, speed_radps, ripple_rad, clearance_m, legs, bodies,
    mass, length, friction, expected_torque_nm, torque_nm FROM former;
DROP TABLE former;
"""

_THIRTEENTH = """
CREATE TEMP TABLE former AS SELECT * FROM torque_commissioning;
DROP TABLE torque_commissioning;

-- signatures of the drive torque while the clearances were known; the last row is in force. All are float64,
-- little endian: counted clearances of the clearance joints [m], the signature of each gait cycle, and the
-- standard deviations of the clearances [m], above 0 where a correction made them; then the delay, the time
-- constant and the load friction of the drive by them, and the mean speed of the crank, 0 where not known
CREATE TABLE torque_commissioning (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, cycles INTEGER NOT NULL, clearance_m BLOB NOT NULL,
    signatures BLOB NOT NULL, sigma_m BLOB NOT NULL, delay_s REAL NOT NULL, time_constant_s REAL NOT NULL,
    load_friction REAL NOT NULL, speed_radps REAL NOT NULL
) STRICT;
INSERT INTO torque_commissioning SELECT id, stamp_ns, cycles, clearance_m, signatures, sigma_m, delay_s,
    time_constant_s, 0, speed_radps FROM former;
DROP TABLE former;
"""

_FOURTEENTH = """
-- compliance between the measured crank angle and the crank that the drive torque shows; it belongs to the
-- rows of body with the same stamp
CREATE TABLE drive (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, compliance_rad_per_nm REAL NOT NULL
) STRICT;

CREATE TEMP TABLE former AS SELECT * FROM torque_reference;
DROP TABLE torque_reference;

-- torque references that were simulated for this leg, one for each cadence (is_whole 1), and one whose
-- simulation was not finished (0), whose torques are those of the first of its legs: speed of its crank
-- [rad/s] and ripple (2, harmonics), clearances (legs, k), bodies (a line each) and their factors on masses
-- and lengths of the mechanism file, the factor on its friction, the compliance of its drive, 0 if it is
-- rigid, and drive torques [N m] of the expected leg and of the other ones (cycles, points each; half as many
-- cycles); float64 and, of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY, is_whole INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    expected_torque_nm BLOB NOT NULL, torque_nm BLOB NOT NULL
) STRICT;
INSERT INTO torque_reference SELECT id, is_whole, stamp_ns, speed_radps, ripple_rad, clearance_m, legs,
    bodies, mass, length, friction, 0, expected_torque_nm, torque_nm FROM former;
DROP TABLE former;
"""

_FIFTEENTH = """
CREATE TEMP TABLE former AS SELECT * FROM drive;
DROP TABLE drive;

-- compliance between the measured crank angle and the crank that the drive torque shows, and the damping of
-- the crank on it over the critical one; they belong to the rows of body with the same stamp
CREATE TABLE drive (
    id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    damping_ratio REAL NOT NULL
) STRICT;
INSERT INTO drive SELECT id, stamp_ns, compliance_rad_per_nm, 0.05 FROM former;
DROP TABLE former;

CREATE TEMP TABLE former AS SELECT * FROM torque_reference;
DROP TABLE torque_reference;

-- torque references that were simulated for this leg, one for each cadence (is_whole 1), and one whose
-- simulation was not finished (0), whose torques are those of the first of its legs: speed of its crank
-- [rad/s] and ripple (2, harmonics), clearances (legs, k), bodies (a line each) and their factors on masses
-- and lengths of the mechanism file, the factor on its friction, the compliance of its drive, 0 if it is
-- rigid, and the damping on it, and drive torques [N m] of the expected leg and of the other ones (cycles,
-- points each; half as many cycles); float64 and, of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY, is_whole INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    damping_ratio REAL NOT NULL, expected_torque_nm BLOB NOT NULL, torque_nm BLOB NOT NULL
) STRICT;
INSERT INTO torque_reference SELECT id, is_whole, stamp_ns, speed_radps, ripple_rad, clearance_m, legs,
    bodies, mass, length, friction, compliance_rad_per_nm, 0.05, expected_torque_nm, torque_nm FROM former;
DROP TABLE former;
"""

_SIXTEENTH = """
-- force of the ground on the toe that the drive torque shows (n, 2) [N], at equal steps of the crank angle
-- from 0; float64, little endian; it belongs to the rows of body with the same stamp
CREATE TABLE ground_load (id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, force_n BLOB NOT NULL) STRICT;

CREATE TEMP TABLE former AS SELECT * FROM torque_reference;
DROP TABLE torque_reference;

-- torque references that were simulated for this leg, one for each cadence (is_whole 1), and one whose
-- simulation was not finished (0), whose torques are those of the first of its legs: speed of its crank
-- [rad/s] and ripple (2, harmonics), clearances (legs, k), bodies (a line each) and their factors on masses
-- and lengths of the mechanism file, the factor on its friction, the compliance of its drive, 0 if it is
-- rigid, and the damping on it, the force of the ground (n, 2) [N], empty without one, and drive torques
-- [N m] of the expected leg and of the other ones (cycles, points each; half as many cycles); float64 and,
-- of torques, float16, little endian
CREATE TABLE torque_reference (
    id INTEGER PRIMARY KEY, is_whole INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, speed_radps REAL NOT NULL,
    ripple_rad BLOB NOT NULL, clearance_m BLOB NOT NULL, legs INTEGER NOT NULL, bodies TEXT NOT NULL,
    mass BLOB NOT NULL, length BLOB NOT NULL, friction REAL NOT NULL, compliance_rad_per_nm REAL NOT NULL,
    damping_ratio REAL NOT NULL, load_n BLOB NOT NULL, expected_torque_nm BLOB NOT NULL,
    torque_nm BLOB NOT NULL
) STRICT;
INSERT INTO torque_reference SELECT id, is_whole, stamp_ns, speed_radps, ripple_rad, clearance_m, legs,
    bodies, mass, length, friction, compliance_rad_per_nm, damping_ratio,
    zeroblob(0), expected_torque_nm, torque_nm FROM former;
DROP TABLE former;
"""

_SEVENTEENTH = """
-- foot loads that acted in a run: gait cycles and time in motion, and mean and standard deviation of the
-- largest vertical force of a cycle, by that force to the nearest 100 N
CREATE TABLE load (
    run INTEGER NOT NULL, about_n INTEGER NOT NULL, cycles INTEGER NOT NULL, moving_s REAL NOT NULL,
    mean_n REAL NOT NULL, sigma_n REAL NOT NULL, PRIMARY KEY (run, about_n)
) STRICT;
"""

MIGRATIONS = (
    _FIRST, _SECOND, _THIRD, _FOURTH, _FIFTH, _SIXTH, _SEVENTH, _EIGHTH, _NINTH, _TENTH, _ELEVENTH, _TWELFTH,
    _THIRTEENTH, _FOURTEENTH, _FIFTEENTH, _SIXTEENTH, _SEVENTEENTH,
)  # fmt: skip

FORMAT = len(MIGRATIONS)
SEALED_FROM = 4  # first format with checksums over the whole content

GROWING = (  # append only
    "alarm_history", "audit", "body", "commissioning", "correction", "drive", "forecast", "friction",
    "ground_load", "history", "torque_commissioning", "verdict",
)  # fmt: skip
CHANGING = (
    "alarm", "binding", "entry", "joint", "load", "measurement", "run", "span", "torque_reference",
    "total",
)  # fmt: skip

Definitions = list[tuple[str, str, str, str | None]]


def migrate(db: sqlite3.Connection, found: int) -> None:
    """Migrate a file to the present format; to be called within a transaction."""
    for step in MIGRATIONS[found:]:
        run_step(db, step)
    db.execute(f"PRAGMA user_version = {FORMAT}")


def run_step(db: sqlite3.Connection, step: str) -> None:
    """Execute the statements of a step, without ending the transaction."""
    for statement in step.split(";\n"):
        if statement.strip():
            db.execute(statement)


def definitions(db: sqlite3.Connection) -> Definitions:
    """All definitions in a file: tables and indexes, and added triggers and views."""
    return db.execute("SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY type, name").fetchall()


@cache
def expected_definitions(number: int) -> tuple[tuple[str, str, str, str | None], ...]:
    """Expected definitions in a file of a format."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        for step in MIGRATIONS[:number]:
            run_step(db, step)
        return tuple(definitions(db))
