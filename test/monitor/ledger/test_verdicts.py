"""Verdicts in the ledger, and ledgers of the format before it, with the entries of their log."""

import json
import sqlite3
from contextlib import closing

import attrs
import numpy as np
import pytest

from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.ledger import file, ledger, recovery, schema, store
from leg_wear_monitor.monitor.ledger.entry import IdentifiedLeg, SimulatedReference, VerdictEvent
from leg_wear_monitor.monitor.ledger.rows import write_entry
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters

pytestmark = pytest.mark.plain

# what a ledger of format 4 does not ask for
LATER = (
    "read_commissioned_torques",
    "read_corrections",
    "read_identified_leg",
    "read_measurements",
    "read_simulated_references",
)

EVENT = VerdictEvent(
    stamp_ns=7,
    state="inspect",
    fault_code="CLEARANCE_CHANGED_G",
    joints='["G"]',
    since_ns=5,
    why="the drive torque shows a clearance",
    to_do="rock joint G",
    evidence='[{"name": "clearance G", "value": 1e-3, "limit": null, "unit": "m"}]',
    not_valid='["forecast"]',
)


def test_a_verdict_is_a_row(open_ledger, entry_at):
    ledger = open_ledger()
    ledger.note(EVENT)
    ledger.keep(entry_at(1), closed=True)
    ledger.close()
    assert rows(ledger.path) == [{"id": 1, **attrs.asdict(EVENT)}]
    assert json.loads(rows(ledger.path)[0]["evidence"])[0]["limit"] is None


def test_an_identified_leg_is_read_as_written_and_the_last_is_in_force(open_ledger, entry_at):
    ledger = open_ledger()
    assert ledger.parameters is None
    for stamp_ns, mass in ((5, 1.1), (7, 0.9)):
        ledger.note(
            IdentifiedLeg(
                stamp_ns, ("thigh", "foot"), (mass, 1.02), (0.998, 1.001), 2.0 * mass, 0.5 * mass, 0.1 * mass
            )
        )
    ledger.keep(entry_at(1), closed=True)
    ledger.close()
    assert open_ledger().parameters == IdentifiedLeg(
        7, ("thigh", "foot"), (0.9, 1.02), (0.998, 1.001), 1.8, 0.45, 0.1 * 0.9
    )


def test_a_simulated_reference_is_read_as_written_and_the_last_is_in_force(open_ledger, entry_at, leg):
    shipped = shipped_references(leg)[0]
    factors = 1.0 + 0.01 * np.arange(len(leg.bodies))
    other = attrs.evolve(
        shipped,
        profile=attrs.evolve(shipped.profile, sine=np.linspace(0.0, 0.01, len(shipped.profile.sine))),
        parameters=LegParameters(factors, 2.0 - factors, 1.7, 2.0e-3, 0.08),
    )
    ledger = open_ledger()
    assert ledger.references == []
    for stamp_ns, reference in ((5, shipped), (7, other)):
        ledger.note(SimulatedReference(stamp_ns, tuple(leg.bodies), reference))
    ledger.keep(entry_at(1), closed=True)
    ledger.close()
    (found,) = open_ledger().references  # of the same cadence
    assert (found.stamp_ns, found.bodies) == (7, tuple(leg.bodies))
    assert found.reference.parameters == other.parameters
    assert found.reference.profile.departure(other.profile) == 0.0
    np.testing.assert_array_equal(found.reference.clearance_m, other.clearance_m)
    for one, same in zip(found.reference.torque_nm, other.torque_nm, strict=True):
        np.testing.assert_array_equal(one, same)


def rows(path):
    with closing(sqlite3.connect(path)) as db:
        db.row_factory = sqlite3.Row
        return [dict(row) for row in db.execute("SELECT * FROM verdict")]


class OfFormat4:
    """A database whose joints have no variance by sampled replays yet, alarms no cause, and runs no loads."""

    def __init__(self, db):
        self._execute, self._executemany = db.execute, db.executemany

    def execute(self, sql, *values):
        return None if "FROM load" in sql else self._execute(sql, *values)

    def executemany(self, sql, rows):
        if "INTO load" in sql:
            return None
        if "INTO joint" in sql:
            sql, rows = "INSERT INTO joint VALUES (?, ?, ?, ?, ?, ?)", [row[:6] for row in rows]
        if "INTO alarm " in sql:
            sql, rows = "INSERT INTO alarm VALUES (?, ?, ?, ?, ?, ?, ?, ?)", [row[:8] for row in rows]
        return self._executemany(sql, rows)


@pytest.fixture
def in_format_4(monkeypatch):
    """Calls of the ledger as a version of format 4 makes them, as long as this context lasts."""
    with monkeypatch.context() as then:
        then.setattr(schema, "MIGRATIONS", schema.MIGRATIONS[:4])
        for module in (schema, file, recovery):
            then.setattr(module, "FORMAT", 4)
        for later in LATER:
            then.setattr(ledger, later, lambda _: None)
        for module in (store, recovery):
            then.setattr(module, "write_entry", lambda db, *given: write_entry(OfFormat4(db), *given))
        schema.expected_definitions.cache_clear()
        yield then
    schema.expected_definitions.cache_clear()


@pytest.mark.parametrize("closed", [True, False])
def test_a_ledger_of_format_4_is_migrated_with_the_entries_of_its_log(
    open_ledger, entry_at, in_format_4, closed
):
    ledger = open_ledger()
    ledger.keep(entry_at(1))
    for second in (2, 3):
        ledger.keep(entry_at(second), whole=False)
    if closed:
        ledger.keep(entry_at(4), closed=True)
    ledger.close()  # otherwise as after a kill: the last entries are in the log alone
    last = ledger._store._last
    assert (last.stamp_ns, version(ledger.path)) == (entry_at(4 if closed else 3).stamp_ns, 4)
    in_format_4.undo()
    schema.expected_definitions.cache_clear()
    found = open_ledger()
    assert found.entry.digest() == last.digest()
    assert (found.cut_off_s is None) == closed
    assert found.loss == ""
    found.note(EVENT)
    found.keep(entry_at(6), closed=True)
    found.close()
    assert version(ledger.path) == schema.FORMAT == 17
    assert len(rows(ledger.path)) == 1
    assert open_ledger().entry.digest() == entry_at(6).digest()


def test_a_kill_right_after_the_migration_loses_no_entry(open_ledger, entry_at, binding, in_format_4):
    ledger = open_ledger()
    ledger.keep(entry_at(1))
    ledger.keep(entry_at(2), whole=False)
    ledger.close()
    last = ledger._store._last
    in_format_4.undo()
    schema.expected_definitions.cache_clear()
    with closing(file.connect(ledger.path, binding)) as db:
        migrated = recovery.migrated(db, recovery.recover(db, ledger.path))
    assert version(ledger.path) == schema.FORMAT
    assert not migrated.is_newer
    again = open_ledger()
    assert (again.entry.digest(), again.loss) == (last.digest(), "")


def version(path):
    with closing(sqlite3.connect(path)) as db:
        return db.execute("PRAGMA user_version").fetchone()[0]
