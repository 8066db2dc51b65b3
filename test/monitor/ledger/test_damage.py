"""Whatever is changed in a ledger's files, its wear is not continued as if nothing had happened."""

import os
import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from ledger_contents import contents, keep_journal

from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    ClearancePoint,
    Commissioned,
    CorrectedClearance,
    ForecastPoint,
    IdentifiedLeg,
    Measurement,
    SimulatedReference,
    VerdictEvent,
)
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.schema import create_tables, expected_definitions
from leg_wear_monitor.state import Level, State, Verdict
from leg_wear_monitor.twin.reference import POINTS, CrankProfile, LegParameters
from leg_wear_monitor.twin.torque_reference import TorqueReference

LEG = LegParameters(np.ones(1), np.ones(1))
TABLES = [name for kind, name, *_ in expected_definitions() if kind == "table"]


@pytest.fixture
def full(open_ledger, entry_at):
    """A closed ledger with a row in each of its tables."""
    ledger = open_ledger()
    ledger.note(Audit(1, "ann", "reset_wear", entry_at(1).joints[0], undoes=0))
    ledger.note(AlarmEvent(2, Alarm(kind="clearance", subject="A", level=Level.WARN, value=1.0, limit=2.0)))
    ledger.note(ClearancePoint(3, 7, "A", 3.0e-4, 4.0e-4))
    ledger.note(ForecastPoint(3, 7, "A", 1.0, 2.0, 3.0))
    ledger.note(Measurement(1, "A", "ann", 3e-4, 1e-6, 1e-5, 3, 0, 0.3, True))
    ledger.note(CorrectedClearance(1, "A", 1e-3, 4e-5, 1e-5, 7e-4, 0))
    ledger.note(Commissioned(1, ("hip",), np.zeros(1), np.zeros(3), np.eye(3)))
    ledger.note(CommissionedTorque(1, np.full(5, 3e-4), np.ones((3, 80))))
    torque = np.ones((2, 1, POINTS), np.float16)
    reference = TorqueReference(CrankProfile.steady(6.0), np.full((2, 5), 3e-4), tuple(torque), LEG)
    ledger.note(SimulatedReference(1, ("thigh",), reference))
    ledger.note(IdentifiedLeg(1, ("thigh",), LegParameters(np.array([1.02]), np.array([0.999]), 1.5)))
    nothing = {"joints": (), "why": "", "do": "", "evidence": (), "not_valid": ()}
    verdict = Verdict(state=State.HEALTHY, since_ns=3, fault_code="NONE", **nothing)
    ledger.note(VerdictEvent(4, verdict))
    ledger.keep(entry_at(2), closed=True)
    ledger.close()
    return ledger.path


def edit(path, *statements):
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA ignore_check_constraints = ON")
        for statement in statements:
            db.execute(statement)


def assert_refused(open_ledger, path, said):
    before = path.read_bytes()
    with pytest.raises(LedgerError, match=said) as caught:
        open_ledger()
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == before


def first_of(table):
    """A condition that one row of a table meets."""
    with closing(sqlite3.connect(":memory:")) as db:
        create_tables(db)
        keys = ", ".join(row[1] for row in db.execute(f"PRAGMA table_info({table})") if row[5])
    return f"({keys}) = (SELECT {keys} FROM {table} LIMIT 1)"


@pytest.mark.parametrize("table", TABLES)
def test_every_value_of_every_table_is_under_a_checksum(open_ledger, full, table, tmp_path):
    shutil.copy(full, tmp_path / "whole")
    with closing(sqlite3.connect(full)) as db:
        columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
        assert db.execute(f"SELECT count(*) FROM {table}").fetchone()[0] > 0
    for column in columns:
        shutil.copy(tmp_path / "whole", full)
        change = (
            f"CASE typeof({column}) WHEN 'blob' THEN CAST(zeroblob(length({column})) AS BLOB) "
            f"WHEN 'text' THEN {column} || 'x' ELSE {column} + 1 END"
        )
        edit(full, f"UPDATE OR REPLACE {table} SET {column} = {change} WHERE {first_of(table)}")
        if full.read_bytes() != (tmp_path / "whole").read_bytes():
            assert_refused(open_ledger, full, "is damaged")


@pytest.mark.parametrize("table", TABLES)
def test_a_row_that_is_gone_is_missed(open_ledger, full, table):
    edit(full, f"DELETE FROM {table} WHERE {first_of(table)}")
    assert_refused(open_ledger, full, "is damaged")


@pytest.mark.parametrize(
    "statements",
    [
        ["CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM span; END"],
        ["CREATE VIEW v AS SELECT * FROM run"],
        ["CREATE TABLE more (x)"],
        ["CREATE INDEX i ON span (begin_ns)"],
        ["ALTER TABLE span ADD COLUMN more INTEGER"],
        ["ALTER TABLE span RENAME TO kept", "CREATE VIEW span AS SELECT * FROM kept"],
    ],
)
def test_nothing_that_was_put_into_the_file_is_run(open_ledger, full, statements):
    edit(full, *statements)
    assert_refused(open_ledger, full, "has other tables or triggers than a ledger")


def test_a_log_of_sqlite_put_beside_it_is_refused(open_ledger, full, tmp_path):
    other = tmp_path / "other"
    shutil.copy(full, other)
    with closing(sqlite3.connect(other, isolation_level=None)) as db:
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("DELETE FROM span")
        shutil.copy(f"{other}-wal", f"{full}-wal")
    assert_refused(open_ledger, full, "wear.ledger-wal beside it belongs to another ledger; move it away")


def test_a_transaction_that_was_cut_off_is_undone(open_ledger, full, entry_at, tmp_path):
    target = tmp_path / "cut.ledger"
    keep_journal(full, tmp_path / "cut.ledger-journal", target)
    assert target.read_bytes() != full.read_bytes()
    assert contents(open_ledger(path=target).entry) == contents(entry_at(2))


def test_a_journal_of_another_time_is_refused_and_nothing_is_undone_with_it(
    open_ledger, full, entry_at, tmp_path
):
    keep_journal(full, tmp_path / "kept")
    ledger = open_ledger()
    ledger.keep(entry_at(9), closed=True)
    ledger.close()
    shutil.copy(tmp_path / "kept", f"{full}-journal")
    assert_refused(
        open_ledger, full, "with wear.ledger-journal beside it, it .* of another file or time: move it away"
    )
    full.with_name("wear.ledger-journal").unlink()
    assert contents(open_ledger().entry) == contents(entry_at(9))


def test_what_is_no_file_is_refused_at_once(open_ledger, tmp_path):
    os.mkfifo(tmp_path / "wear.ledger")
    with pytest.raises(LedgerError, match="cannot be opened: it is not a file"):
        open_ledger()
