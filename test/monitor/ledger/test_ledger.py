"""The ledger: what is kept is what was given; what cannot be continued is refused and left as it is."""

import os
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
from ledger_contents import contents, cut_off, rows_of

from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    ClearancePoint,
    Commissioned,
    CorrectedClearance,
    Entry,
    IdentifiedLeg,
    JointWear,
    Measurement,
    SimulatedReference,
    VerdictEvent,
    binding_of,
    fingerprint,
)
from leg_wear_monitor.monitor.ledger.file import FORMAT, LedgerError, read
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict
from leg_wear_monitor.twin.reference import POINTS, CrankProfile, LegParameters
from leg_wear_monitor.twin.references import CYCLES, TorqueReference

SECOND = 10**9


@pytest.fixture(scope="session")
def binding() -> dict[str, str]:
    """What the test ledgers are of."""
    return {
        "hardware_id": "leg-7",
        "mechanism": "bionic_leg",
        "fingerprint": "00ff",
        "joints": "A, B",
        "wear_acceleration": "1.0",
        "sectors": "720",
    }


@pytest.fixture(scope="session")
def entry_at() -> Callable[[int], Entry]:
    """An entry after so many seconds, other at every one."""

    def entry(second: int) -> Entry:
        depth = np.random.default_rng(second).random((2, 2, 720)) * 1.0e-6
        return Entry(
            stamp_ns=second * SECOND,
            joints=tuple(
                JointWear(name, depth[k], second, 0.9 * second, k) for k, name in enumerate(("A", "B"))
            ),
            totals={"cycles": float(second), "moving_s": 0.9 * second},
            alarms=(Alarm(kind="clearance", subject="A", level=Level.WARN, acknowledged=second % 2 == 1),),
            spans=((0, second * SECOND, 0),),
        )

    return entry


@pytest.fixture
def open_ledger(tmp_path: Path, binding: dict[str, str]) -> Iterator[Callable[..., Ledger]]:
    """Open the ledger of this test; whatever is open at its end is closed."""
    opened = []

    def open_(binding: dict[str, str] = binding, path: Path = tmp_path / "wear.ledger") -> Ledger:
        ledger = Ledger(path, binding, interval_s=5.0)
        opened.append(ledger)
        return ledger

    yield open_
    for ledger in opened:
        ledger.close()


@pytest.fixture
def reopened(open_ledger: Callable[..., Ledger], entry_at: Callable[[int], Entry]) -> Callable[..., Ledger]:
    """The ledger of this test after a run that noted something, kept an entry and ended in order."""

    def again(*notes: Any) -> Ledger:
        ledger = open_ledger()
        for note in notes:
            ledger.note(note)
        ledger.keep(entry_at(1), closed=True)
        ledger.close()
        return open_ledger()

    return again


def test_what_is_kept_is_there_again(open_ledger, entry_at):
    ledger = open_ledger()
    assert (ledger.entry, ledger.cut_off_s, ledger.kept_ns, ledger.fault) == (None, None, 0, "")
    for second in (1, 2, 3):
        assert ledger.keep(entry_at(second))
    ledger.close()
    found = open_ledger()
    assert contents(found.entry) == contents(entry_at(3))
    (alarm,) = found.entry.alarms
    assert (alarm.name, alarm.level, alarm.acknowledged) == ("clearance A", Level.WARN, True)
    assert found.counted_ns.tolist() == [[0, 3 * SECOND]]


def test_a_run_that_was_cut_off_says_how_much_may_be_lost(open_ledger, entry_at):
    for second, longest in ((2, 5.0), (9, 6.3)):
        ledger = open_ledger()
        ledger.keep(entry_at(2))
        ledger.keep(entry_at(second))
        ledger.close()
        found = open_ledger()
        assert found.cut_off_s == pytest.approx(longest)  # what was intended, or longer if it has been longer
        found.close()


def test_a_run_without_an_entry_and_one_before_events_alone_are_cut_off_too(open_ledger, entry_at):
    open_ledger().close()
    ledger = open_ledger()
    assert ledger.cut_off_s == 5.0
    ledger.keep(entry_at(2))
    ledger.close()
    between = open_ledger()
    between.note(ClearancePoint(5, 7, "A", 3.0e-4, 4.0e-4))
    between.abandon()
    assert open_ledger().cut_off_s is not None


def test_history_and_audit_trail_are_appended_once(open_ledger, entry_at, tmp_path):
    ledger = open_ledger()
    for second in (1, 2):
        entry = entry_at(second)
        ledger.note(Audit(second, "ann", "reset_wear", entry.joints[0]))
        ledger.note(AlarmEvent(second, Alarm(kind="cadence")))
        ledger.note(ClearancePoint(second, 7, "A", 3.0e-4, 4.0e-4))
        ledger.keep(entry)
    ledger.keep(entry_at(3))
    ledger.close()
    rows = partial(rows_of, tmp_path / "wear.ledger")
    audit = rows("SELECT stamp_ns, who, what, joint ->> 'name', joint ->> 'cycles' FROM audit")
    alarms = rows("SELECT stamp_ns, alarm ->> 'kind', alarm ->> 'value' FROM alarm_history")
    points = rows("SELECT stamp_ns, cycle, joint, clearance_m FROM history")
    assert audit == [(s, "ann", "reset_wear", "A", s) for s in (1, 2)]
    assert alarms == [(s, "cadence", None) for s in (1, 2)]  # a NaN is null
    assert points == [(s, 7, "A", 3.0e-4) for s in (1, 2)]


OTHERS = {
    "hardware_id": "leg-8",
    "fingerprint": "ff00",
    "wear_acceleration": "100.0",
    "joints": "A, G",
    "sectors": "360",
}


@pytest.mark.parametrize("name", OTHERS)
def test_the_wear_of_something_else_is_refused(open_ledger, reopened, binding, name):
    ledger = reopened()
    ledger.close()
    before = ledger.path.read_bytes()
    with pytest.raises(LedgerError) as caught:
        open_ledger(binding | {name: OTHERS[name]})
    said = f"{name.replace('_', ' ')} {binding[name]}, not {OTHERS[name]}"
    for part in [str(ledger.path), "ledger.path", said]:
        assert part in str(caught.value)
    assert ledger.path.read_bytes() == before


def not_a_ledger(path):
    with closing(sqlite3.connect(path)) as db:
        db.execute("CREATE TABLE joint (name)")


def newer(path):
    Ledger(path, {}, 5.0).close()
    with closing(sqlite3.connect(path)) as db:
        db.execute(f"PRAGMA user_version = {FORMAT + 1}")


def older(path):
    newer(path)
    with closing(sqlite3.connect(path)) as db:
        db.execute("ALTER TABLE joint ADD COLUMN bushing_m REAL")
        db.execute(f"PRAGMA user_version = {FORMAT}")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (older, "is not a ledger of format 1, .* move it away to begin with new parts"),
        (Path.touch, "is not a ledger of format 1"),
        (lambda path: path.write_text("bodies: {}\n" * 1000), "damaged or not a ledger"),
        (Path.mkdir, "cannot be opened"),
        (not_a_ledger, "is not a ledger of format 1"),
        (os.mkfifo, "cannot be opened: it is not a file"),
        (newer, "is not a ledger of format 1"),
    ],
)
def test_what_is_no_ledger_is_refused_and_left_alone(open_ledger, tmp_path, make, said):
    path = tmp_path / "wear.ledger"
    make(path)
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir() if each.is_file()}
    with pytest.raises(LedgerError, match=said) as caught:
        open_ledger()
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir() if each.is_file()} == before


def test_a_place_that_cannot_be_written_is_refused(open_ledger, tmp_path):
    with pytest.raises(LedgerError, match=r"cannot be created: .*Expected a writable place"):
        open_ledger(path=tmp_path / "nowhere" / "wear.ledger")


def test_two_monitors_cannot_keep_one_ledger(open_ledger, tmp_path, binding):
    open_ledger()
    code = (
        "from leg_wear_monitor.monitor.ledger.ledger import Ledger, LedgerError\n"
        "try:\n"
        f"    Ledger({str(tmp_path / 'wear.ledger')!r}, {binding!r}, 5.0)\n"
        "except LedgerError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "is in use by another monitor" in done.stdout


def test_no_damage_goes_unnoticed(open_ledger, entry_at, tmp_path):
    """Bytes flipped and files cut off at many places: refused in one line, or the wear is what it was."""
    ledger = open_ledger()
    ledger.keep(entry_at(1), closed=True)
    ledger.close()
    whole = ledger.path.read_bytes()
    random = np.random.default_rng(3)
    refused = 0
    for trial in range(120):
        broken = bytearray(whole)
        if trial % 4 == 0:
            del broken[random.integers(len(whole)) :]
        else:
            broken[random.integers(len(whole))] ^= 1 << random.integers(8)
        path = tmp_path / f"{trial}.ledger"
        path.write_bytes(broken)
        try:
            found = open_ledger(path=path)
            assert contents(found.entry) == contents(entry_at(1))
            found.close()
        except LedgerError as error:
            refused += 1
            assert "\n" not in str(error)
            assert str(error).startswith(f"{path}: ")
            assert path.read_bytes() == broken
    assert refused > 40  # the rest of the file is not in use


def test_a_full_disk_is_reported_and_the_next_entry_has_what_waited(open_ledger, entry_at):
    ledger = open_ledger()
    ledger.keep(entry_at(1))
    pages = ledger._db.execute("PRAGMA page_count").fetchone()[0]
    ledger._db.execute(f"PRAGMA max_page_count = {pages}")
    for _ in range(20):
        ledger.note(Audit(2, "ann", "reset_wear", entry_at(2).joints[0]))
    assert not ledger.keep(entry_at(2))
    assert "full" in ledger.fault
    assert ledger.kept_ns == 1 * SECOND
    ledger.close()
    found = open_ledger()
    assert (contents(found.entry), found.cut_off_s) == (contents(entry_at(1)), 5.0)
    found._db.execute("PRAGMA query_only = ON")  # as a file system that became read-only
    found.note(Audit(3, "ann", "new_epoch"))
    assert not found.keep(entry_at(3))
    assert "readonly" in found.fault
    found._db.execute("PRAGMA query_only = OFF")
    assert found.keep(entry_at(4))
    assert (found.fault, found.kept_ns) == ("", 4 * SECOND)
    found.close()
    assert [audit.stamp_ns for audit in open_ledger().audits] == [3]


def test_a_ledger_moved_away_while_in_use_is_said(open_ledger, entry_at, tmp_path):
    ledger = open_ledger()
    ledger.path.rename(tmp_path / "elsewhere")
    assert not ledger.keep(entry_at(1))
    assert "moved away" in ledger.fault
    assert not ledger.path.exists()  # no second ledger begins
    (tmp_path / "elsewhere").rename(ledger.path)
    assert ledger.keep(entry_at(2))


def test_a_half_made_ledger_is_no_ledger(open_ledger, tmp_path):
    """A kill while the first one is made leaves a file of another name."""
    (tmp_path / "wear.ledger.new").write_bytes(b"half")
    assert open_ledger().entry is None
    assert not (tmp_path / "wear.ledger.new").exists()


SAME = [
    {"clearance_joints": ["J", "I", "G", "B", "A"]},
    {"wear_coefficients_per_pa": [1.0e-13]},
    {"cadence.commanded_rpm": 30.0},
    {"limits.clearance_m": 1.0e-3},
]
OTHER = [
    {"clearances_m": [2.0e-4]},
    {"clearance_joints": ["A"]},
    {"hardware_id": "other"},
    {"wear_acceleration": 2.0},
    {"mechanism": "jansen_leg", "clearance_joints": ["A", "B"]},
]


def binding_for(values):
    config = config_from(values)
    return binding_of(fitted(load_mechanism(config.mechanism), config), config)


@pytest.mark.parametrize(("values", "is_same"), [*((v, True) for v in SAME), *((v, False) for v in OTHER)])
def test_the_ledger_is_kept_unless_it_is_another_part(values, is_same):
    assert (binding_for(values) == binding_for({})) == is_same


def test_a_leg_with_another_mass_is_another_leg(leg):
    foot = attrs.evolve(leg.bodies["foot"], mass=1.3)
    heavier = attrs.evolve(leg, bodies=leg.bodies | {"foot": foot})
    renamed = attrs.evolve(leg, name="mine", source="mine.yaml")
    assert fingerprint(heavier) != fingerprint(leg)
    assert fingerprint(renamed) == fingerprint(leg)


@pytest.mark.parametrize("wider_m", [6e-4, 3e-4])
def test_a_reference_or_an_identification_that_is_not_whole_is_kept_until_it_is(
    reopened, wider_m: float
) -> None:
    leg, known = LegParameters(np.ones(1), np.ones(1)), np.array([[3e-4], [wider_m], [wider_m]])
    expected, wider = (np.full((each, POINTS), 1.5, np.float16) for each in (2 * CYCLES, CYCLES))
    whole = TorqueReference(CrankProfile.steady(6.0), known, (expected, wider, wider), leg)
    part = attrs.evolve(whole, torque_nm=whole.torque_nm[:2])
    for kept, has_part in ((part, True), (whole, False)):
        found = reopened(SimulatedReference(1, ("thigh",), kept))
        (one,) = (kept.reference for kept in found.references)
        assert one.is_whole != has_part
        assert [torque.shape for torque in one.torque_nm] == [torque.shape for torque in kept.torque_nm]
        np.testing.assert_array_equal(one.clearance_m, whole.clearance_m)
        found.close()


def test_references_and_baselines_are_kept_for_each_cadence(reopened) -> None:
    """Those of the same cadence replace each other, and a correction ends the baselines of all."""
    leg, few = LegParameters(np.ones(1), np.ones(1)), np.ones((2 * CYCLES, POINTS), np.float16)
    made = []
    for stamp_ns, speed in enumerate((6.0, 4.5, 7.5, 4.51), 10):
        profile = CrankProfile.steady(speed)
        one = TorqueReference(profile, np.full((2, 5), 3e-4), (few, few[:CYCLES]), leg)
        made.append(SimulatedReference(stamp_ns, ("thigh",), one))
        warm = {"temperature_c": 41.5} if speed == 7.5 else {}  # not measured at the others
        warm |= {"period_s": 0.001, "together": 5, "is_instant": True} if speed == 7.5 else {}
        made.append(CommissionedTorque(stamp_ns, np.full(5, 3e-4), np.ones((4, 6)), speed=speed, **warm))
    found = reopened(*made)
    assert [one.reference.profile.speed for one in found.references] == [4.51, 7.5, 6.0]
    assert [one.speed for one in found.commissioned_torques] == [4.51, 7.5, 6.0]
    np.testing.assert_equal([one.temperature_c for one in found.commissioned_torques], [np.nan, 41.5, np.nan])
    sensors = [(one.period_s, one.together, one.is_instant) for one in found.commissioned_torques]
    np.testing.assert_equal(sensors, [(np.nan, 1, False), (0.001, 5, True), (np.nan, 1, False)])
    sigma_m = np.array([0.0, 0.0, 1e-5, 0.0, 0.0])
    found.close()
    corrected, also = (
        CommissionedTorque(ns, np.full(5, 3e-4), np.ones((4, 6)), sigma_m, speed=speed)
        for ns, speed in ((20, 6.0), (21, 4.5))
    )
    found = reopened(corrected, also)
    assert [one.stamp_ns for one in found.commissioned_torques] == [21, 20]


@pytest.mark.parametrize("what", ["reset_wear", "undo_reset"])
@pytest.mark.parametrize("reset_ns", [5, 50])
def test_baselines_are_of_the_parts_since_the_last_reset_whatever_the_clocks_say(
    reopened, reset_ns, what
) -> None:
    former, own = (CommissionedTorque(ns, np.full(5, 3e-4), np.ones((4, 6)), speed=6.0) for ns in (20, 10))
    for noted, kept in (((former,), [20]), ((Audit(reset_ns, "ann", what),), []), ((own,), [10])):
        found = reopened(*noted)
        assert [one.stamp_ns for one in found.commissioned_torques] == kept
        found.close()


def test_a_transaction_that_was_cut_off_is_undone(open_ledger, reopened, entry_at, tmp_path):
    reopened().close()
    cut = tmp_path / "cut.ledger"
    cut_off(tmp_path / "wear.ledger", cut)
    assert cut.read_bytes() != (tmp_path / "wear.ledger").read_bytes()
    assert contents(open_ledger(path=cut).entry) == contents(entry_at(1))


RAISED = Alarm(kind="clearance", subject="A", level=Level.WARN, value=1.0, limit=2.0, beyond=(1, 0))
WORN = JointWear("A", np.random.default_rng(1).random((2, 720)), 7, 0.1 + 0.2, 5, 1e-15)
LEG = LegParameters(np.array([1.02, 1.0]), np.array([0.999, 1.0]), 1.5, load=np.ones((4, 2)))
TORQUE = (np.ones((3, POINTS), np.float16), np.full((2, POINTS), 0.3, np.float16))
EVIDENCE = (Evidence("clearance A", 3e-4, None, "m"),)
VERDICT = Verdict(
    state=State.WATCH,
    joints=("A",),
    why="why",
    since_ns=3,
    do="do",
    evidence=EVIDENCE,
    not_valid=(Figure.FORECAST,),
    fault_code="NONE",
)
EVENTS = [
    Audit(1, "ann", "reset_wear", WORN, (RAISED,)),
    AlarmEvent(2, RAISED),
    ClearancePoint(3, 7, "A", 3.0e-4, 4.0e-4),
    Measurement(1, "A", "ann", 3e-4, 1e-6, 1e-5, 3, 0, 0.3, counts=True),
    CorrectedClearance(1, "A", 1e-3, 4e-5, 7e-4, 0, 2, 1.5),
    Commissioned(1, ("hip",), np.zeros(1), np.arange(3.0), np.eye(3)),
    CommissionedTorque(1, np.full(5, 3e-4), np.ones((3, 80))),
    SimulatedReference(
        1, ("thigh", "foot"), TorqueReference(CrankProfile.steady(6.0), np.ones((2, 5)), TORQUE, LEG)
    ),
    IdentifiedLeg(1, ("thigh", "foot"), LEG),
    VerdictEvent(4, VERDICT),
]


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_an_event_is_read_to_the_bit_as_it_was_noted(reopened, event):
    (found,) = read(reopened(event)._db, type(event))
    given, stored = (attrs.asdict(each) | {"id": 0} for each in (event, found))
    np.testing.assert_equal(stored, given)


def test_spans_are_kept_by_epochs_of_the_clock(open_ledger, entry_at):
    ledger = open_ledger()
    ledger.epoch, ledger.boot_id = 3, "7f-2"
    spans = ((5, 9, 2), (1, 7, 3), (10, 12, 3))
    ledger.keep(attrs.evolve(entry_at(1), spans=spans), closed=True)
    ledger.close()
    found = open_ledger()
    assert found.entry.spans == spans
    assert found.counted_ns.tolist() == [[1, 7], [5, 9], [10, 12]]
    assert (found.epoch, found.boot_id) == (3, "7f-2")
    assert (found.last_run.epoch, found.last_run.boot_id, found.last_run.closed) == (3, "7f-2", True)
