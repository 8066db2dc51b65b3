"""Ledgers of the formats before: opened, checked and brought up to date; what they hold goes on."""

import sqlite3
from contextlib import closing

import attrs
import pytest

from leg_wear_monitor.monitor.ledger.entry import Audit, ForecastPoint, Measurement
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.schema import APPLICATION_ID, MIGRATIONS, migrate, run_step

pytestmark = pytest.mark.plain

MEASURED = Measurement(
    stamp_ns=1, joint="A", who="ann", clearance_m=3e-4, sigma_m=1e-6, wear_m=1e-5, cycles=3,
    replaced_ns=0, expected_below=0.3, counts=True,
)  # fmt: skip


@pytest.fixture
def former(tmp_path, binding, entry_at):
    """Makes a ledger as a version of format 1 to 3 left it, with an entry, an audit row and a measurement."""

    def make(number):
        path, entry = tmp_path / "wear.ledger", entry_at(3)
        with closing(sqlite3.connect(path, isolation_level=None)) as db:
            db.execute("PRAGMA journal_mode = WAL")
            db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            for step in MIGRATIONS[:number]:
                run_step(db, step)
            db.execute(f"PRAGMA user_version = {number}")
            db.executemany("INSERT INTO binding VALUES (?, ?)", binding.as_texts().items())
            db.execute("INSERT INTO run VALUES (1, 1, 5.0)")
            db.execute("INSERT INTO entry VALUES (1, 1, ?, ?)", (entry.stamp_ns, entry.digest()))
            for joint in entry.joints:
                values = (joint.name, joint.depth.tobytes(), joint.cycles, joint.moving_s, joint.replaced_ns)
                db.execute("INSERT INTO joint VALUES (?, ?, ?, ?, ?)", values)
            db.executemany("INSERT INTO total VALUES (?, ?)", entry.totals.items())
            for alarm in entry.alarms:
                values = (alarm.kind, alarm.subject, alarm.level, alarm.present, alarm.acknowledged, 0)
                db.execute("INSERT INTO alarm VALUES (?, ?, ?, ?, ?, ?)", values)
            db.executemany("INSERT INTO span VALUES (1, 0, ?, ?)", entry.spans)
            depth = entry.joints[0].depth.tobytes()
            db.execute("INSERT INTO audit VALUES (1, 9, 'ann', 'reset_wear', 'A', 7, ?)", (depth,))
            if number > 1:
                db.execute(
                    "INSERT INTO measurement VALUES (1, 1, 'A', 'ann', 3e-4, 1e-6, 1e-5, 3, 0, 0.3, 1)"
                )
        return path

    return make


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_ledger_of_a_former_format_is_migrated_and_goes_on(open_ledger, former, entry_at, number):
    former(number)
    found = open_ledger()
    assert found.entry.digest() == entry_at(3).digest()
    assert found.counted_in(0).tolist() == found.counted_ns.tolist() == [[0, 3 * 10**9]]
    assert (found.epoch, found.boot_id, found.cut_off_s) == (0, "", None)
    reset = found.last_reset("A")
    assert (reset.stamp_ns, reset.who, reset.joint) == (9, "ann", None)  # not all of the joint was kept
    earlier = (MEASURED,) if number > 1 else ()
    assert found.measurements == earlier
    found.note(MEASURED)
    found.note(ForecastPoint(5, 7, "A", 1.0, 2.0, 3.0))
    found.record()
    found.close()
    again = open_ledger()
    assert again.measurements == (*earlier, MEASURED)
    assert again.entry.digest() == entry_at(3).digest()
    assert again.cut_off_s is None


def test_what_a_former_format_has_checksums_of_is_checked(open_ledger, former):
    path = former(3)
    with closing(sqlite3.connect(path)) as db, db:
        db.execute("UPDATE span SET end_ns = end_ns + 1")
    with pytest.raises(LedgerError, match="is damaged: its checksum is not that of its content"):
        open_ledger()


# --- what format 4 keeps beside ---


def test_a_measurement_that_is_withdrawn_is_kept_and_told_as_withdrawn(open_ledger):
    ledger = open_ledger()
    ledger.note(MEASURED)
    ledger.record()
    ledger.close()
    ledger = open_ledger()
    (found,) = ledger.measurements
    assert not found.is_withdrawn
    assert ledger.withdraw(found.id, 77, "bob").is_withdrawn
    with pytest.raises(LedgerError, match="is withdrawn already"):
        ledger.withdraw(found.id, 78, "bob")
    with pytest.raises(LedgerError, match="has no measurement 9, it has 1"):
        ledger.withdraw(9, 78, "bob")
    ledger.record()
    ledger.close()
    (found,) = open_ledger().measurements
    assert (found.withdrawn_ns, found.withdrawn_by, found.counts) == (77, "bob", True)


def test_a_reset_can_be_read_whole_until_it_is_undone(open_ledger, entry_at):
    ledger = open_ledger()
    assert ledger.last_reset("A") is None
    was = entry_at(2).joints
    for stamp, joint in ((1, was[0]), (2, was[1]), (3, entry_at(5).joints[0])):
        ledger.note(Audit(stamp, "ann", "reset_wear", joint))
    ledger.keep(entry_at(6))
    last = ledger.last_reset("A")
    assert (last.stamp_ns, last.joint.cycles, last.joint.moving_s) == (3, 5, 4.5)
    assert last.joint.depth.tobytes() == entry_at(5).joints[0].depth.tobytes()
    ledger.note(Audit(4, "ann", "undo_reset", entry_at(6).joints[0], undoes=last.id))
    ledger.keep(entry_at(7))
    first = ledger.last_reset("A")
    assert (first.stamp_ns, first.joint.replaced_ns) == (1, was[0].replaced_ns)
    assert ledger.last_reset("B").joint.replaced_ns == was[1].replaced_ns == 1


def test_spans_are_kept_by_epochs_of_the_clock(open_ledger, entry_at):
    ledger = open_ledger()
    ledger.epoch, ledger.boot_id = 3, "7f-2"
    spans = ((5, 9), (1, 7), (10, 12))
    ledger.keep(attrs.evolve(entry_at(1), spans=spans, span_epochs=(2, 3, 3)), closed=True)
    ledger.close()
    found = open_ledger()
    assert (found.entry.spans, found.entry.span_epochs) == (spans, (2, 3, 3))
    assert found.counted_in(2).tolist() == [[5, 9]]
    assert found.counted_in(3).tolist() == [[1, 7], [10, 12]]
    assert found.counted_in(0).shape == (0, 2)
    assert (found.epoch, found.boot_id) == (3, "7f-2")
    assert (found.last_run.epoch, found.last_run.boot_id, found.last_run.closed) == (3, "7f-2", True)


def test_sampling_errors_of_format_8_stay_with_their_joints() -> None:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        for step in MIGRATIONS[:8]:
            run_step(db, step)
        for name in ("A", "G"):
            db.execute("INSERT INTO joint VALUES (3, ?, x'00', 7, 6.5, 0)", (name,))
        totals = {"cycles": 7.0, "sampling_variance_G_m2": 4e-12, "estimated_cycles": 5.0}
        db.executemany("INSERT INTO total VALUES (?, ?)", totals.items())
        migrate(db, 8)
        assert db.execute("SELECT name, sampling_m2 FROM joint").fetchall() == [("A", 0.0), ("G", 4e-12)]
        assert dict(db.execute("SELECT * FROM total")) == {"cycles": 7.0, "estimated_cycles": 5.0}
