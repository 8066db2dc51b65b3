"""The ledger's tables. This file alone says what is in one, and how an older one becomes a newer one.

`PRAGMA user_version` is the format: the number of steps of `MIGRATIONS` that a file has seen. A new file sees
all of them; an older one sees those it lacks, in one transaction, when it is opened. A step is never changed
once it was released: what comes later is a further step. A file of a newer format is refused.
"""

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

MIGRATIONS = (_FIRST, _SECOND, _THIRD)

FORMAT = len(MIGRATIONS)
