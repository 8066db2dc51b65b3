"""Entries between whole ones: some kB each, the wear to a fraction of what was new, every damage told."""

import os
import shutil
from itertools import pairwise

import attrs
import numpy as np
import pytest

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.ledger.copy import copy_of
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.log import read_log
from leg_wear_monitor.monitor.ledger.recovery import WHOLE_S
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.step import decode, encode

pytestmark = pytest.mark.plain

SECOND = 10**9


@pytest.fixture
def walk(entry_at):
    """Gives the entry after each 5 s of a walk that wears all sectors, unevenly."""
    shape = 1.0e-10 * (1.1 + np.sin(np.linspace(0.0, 6.0, 720)))
    random = np.random.default_rng(2)
    entries = [entry_at(1)]
    while len(entries) < 12:
        last = entries[-1]
        joints = tuple(
            attrs.evolve(
                joint,
                depth=joint.depth + shape * random.uniform(0.9, 1.1, (2, 720)),
                cycles=joint.cycles + 5,
                moving_s=joint.moving_s + 5.0,
            )
            for joint in last.joints
        )
        stamp_ns = last.stamp_ns + 5 * SECOND
        totals = {"cycles": last.totals["cycles"] + 5.0, "moving_s": last.moving_s + 5.0}
        spans = ((0, stamp_ns),)
        entries.append(attrs.evolve(last, stamp_ns=stamp_ns, joints=joints, totals=totals, spans=spans))
    return entries


@pytest.fixture
def killed(open_ledger, walk):
    """A ledger whose run was killed after all entries of the walk but the first went to the log."""
    ledger = open_ledger()
    assert all(ledger.keep(entry, whole=False) for entry in walk)
    ledger.close()
    return ledger.path


def log_of(path):
    return path.with_name(path.name + "-log")


def test_a_copy_for_a_trial_has_the_last_entries(killed):
    with copy_of(killed) as copy:
        assert log_of(copy).read_bytes() == log_of(killed).read_bytes()
        assert copy.read_bytes() == killed.read_bytes()


def assert_is(found, entry, before):
    """The same but for depths, and those to a fraction of the largest rise since the entry before."""
    plain = [attrs.evolve(each, joints=()).digest() for each in (found, entry)]
    assert plain[0] == plain[1]
    for got, given, was in zip(found.joints, entry.joints, before.joints, strict=True):
        lives = [(joint.name, joint.cycles, joint.moving_s, joint.replaced_ns) for joint in (got, given)]
        assert lives[0] == lives[1]
        largest = np.abs(given.depth - was.depth).max(axis=1, keepdims=True)
        assert (np.abs(got.depth - given.depth) <= largest / 36).all()
        mean = np.abs((got.depth - given.depth).mean(axis=1, keepdims=True))
        assert (mean < largest / 300).all()


def test_an_entry_costs_some_kilobytes_and_the_tables_stay_as_they_are(open_ledger, walk):
    ledger = open_ledger()
    ledger.keep(walk[0])
    tables, sizes = ledger.path.read_bytes(), [log_of(ledger.path).stat().st_size]
    for entry in walk[1:]:
        assert ledger.keep(entry, whole=False)
        sizes.append(log_of(ledger.path).stat().st_size)
    assert ledger.path.read_bytes() == tables
    assert max(later - earlier for earlier, later in pairwise(sizes)) < 2000  # two joints, noisy


def test_after_a_kill_the_last_entry_is_there_and_errors_do_not_add_up(open_ledger, killed, walk):
    found = open_ledger()
    assert_is(found.entry, walk[-1], walk[-2])
    assert (found.cut_off_s, found.loss, found.kept_ns) == (5.0, "", walk[-1].stamp_ns)
    assert found.counted_ns.tolist() == [[0, walk[-1].stamp_ns]]
    found.close()
    again = open_ledger()  # what was in the log is in the tables now
    assert [joint.depth.tobytes() for joint in again.entry.joints] == [
        joint.depth.tobytes() for joint in found.entry.joints
    ]


def test_a_run_that_ends_in_order_is_exact_and_one_file(open_ledger, walk, tmp_path):
    ledger = open_ledger()
    for entry in walk:
        ledger.keep(entry, whole=False)
    ledger.keep(walk[-1], closed=True)
    ledger.close()
    assert [path.name for path in tmp_path.iterdir()] == [ledger.path.name]
    assert open_ledger().entry.digest() == walk[-1].digest()


def test_a_whole_entry_is_written_each_ten_minutes_of_motion(open_ledger, walk):
    ledger = open_ledger()
    ledger.keep(walk[0])
    tables = ledger.path.read_bytes()
    far = attrs.evolve(walk[1], totals=walk[1].totals | {"moving_s": walk[0].moving_s + WHOLE_S})
    ledger.keep(far, whole=False)
    assert ledger.path.read_bytes() != tables
    assert read_log(ledger.path).records == ()


def test_a_record_cut_off_by_a_power_cut_is_not_there_and_the_one_before_is(open_ledger, killed, walk):
    whole = log_of(killed).read_bytes()
    log_of(killed).write_bytes(whole[:-7])
    found = open_ledger()
    assert_is(found.entry, walk[-2], walk[-3])
    assert found.cut_off_s == 10.0  # of that record, and since
    assert "wear.ledger-log is not whole: the wear of at most 10 s of walking is lost" in found.loss


def test_records_that_are_missing_at_the_end_are_missed(open_ledger, killed, walk):
    sizes = [len(record) + 36 for record in read_log(killed).records]
    whole = log_of(killed).read_bytes()
    log_of(killed).write_bytes(whole[: len(whole) - sum(sizes[-3:])])
    found = open_ledger()
    assert_is(found.entry, walk[-4], walk[-5])
    assert found.cut_off_s == 20.0
    assert "is not whole: the wear of at most 20 s of walking is lost" in found.loss


def test_a_flipped_bit_in_the_log_is_told_with_what_may_be_lost(open_ledger, killed, walk):
    sizes = [len(record) + 36 for record in read_log(killed).records]
    broken = bytearray(log_of(killed).read_bytes())
    broken[56 + sum(sizes[:4]) + 100] ^= 4  # in the fifth record
    log_of(killed).write_bytes(broken)
    found = open_ledger()
    assert_is(found.entry, walk[4], walk[3])
    assert found.cut_off_s == pytest.approx(WHOLE_S - 20.0 + 10.0)
    assert "wear.ledger-log is not whole" in found.loss
    assert "at most 590 s of walking is lost" in found.loss


@pytest.mark.parametrize("damage", ["missing", "empty", "of another time", "something else"])
def test_a_log_that_is_not_there_or_another_is_told_with_what_may_be_lost(
    open_ledger, killed, walk, tmp_path, damage
):
    log = log_of(killed)
    if damage == "missing":
        log.unlink()
    elif damage == "of another time":
        shutil.copy(log, tmp_path / "kept")
        open_ledger().close()
        shutil.copy(tmp_path / "kept", log)
        open_ledger().close()  # fits: what it led to is in the tables
        shutil.copy(tmp_path / "kept", log)
    else:
        log.write_bytes(b"" if damage == "empty" else os.urandom(5000))
    before = killed.read_bytes()
    found = open_ledger()
    assert found.cut_off_s == WHOLE_S + 10.0
    assert "the wear of at most 610 s of walking is lost" in found.loss
    assert before != killed.read_bytes()  # it goes on
    last = walk[-1] if damage == "of another time" else walk[0]
    assert found.entry.stamp_ns == last.stamp_ns


def test_an_older_ledger_beside_a_newer_log_is_refused_and_left_alone(open_ledger, walk, tmp_path):
    ledger = open_ledger()
    ledger.keep(walk[0])
    shutil.copy(ledger.path, tmp_path / "older")
    ledger.keep(walk[1])
    ledger.keep(walk[2], whole=False)
    ledger.close()
    log = log_of(ledger.path).read_bytes()
    shutil.copy(tmp_path / "older", ledger.path)
    with pytest.raises(LedgerError, match=r"is older than wear.ledger-log beside it; put back the ledger"):
        open_ledger()
    assert log_of(ledger.path).read_bytes() == log
    log_of(ledger.path).unlink()
    assert open_ledger().entry.stamp_ns == walk[0].stamp_ns


def test_no_new_ledger_begins_beside_the_log_of_a_lost_one(open_ledger, killed):
    killed.unlink()
    with pytest.raises(LedgerError, match=r"is missing, but wear\.ledger-log beside it is there"):
        open_ledger()
    assert not killed.exists()


def test_a_log_that_cannot_be_written_is_said_and_made_up_for(open_ledger, walk):
    ledger = open_ledger()
    ledger.keep(walk[0])
    ledger.keep(walk[1], whole=False)
    log_of(ledger.path).rename(ledger.path.with_name("away"))
    assert not ledger.keep(walk[2], whole=False)
    assert "No such file" in ledger.fault
    assert ledger.kept_ns == walk[1].stamp_ns
    assert ledger.keep(walk[3], whole=False)
    ledger.close()
    found = open_ledger()
    assert found.entry.digest() == walk[3].digest()
    assert found.cut_off_s == 10.0


def test_files_can_be_read_by_owner_and_group_alone_or_less(open_ledger, walk, tmp_path):
    for umask, mode in ((0o022, 0o640), (0o077, 0o600)):
        was = os.umask(umask)
        try:
            ledger = open_ledger(path=tmp_path / f"{umask}.ledger")
            ledger.keep(walk[0])
        finally:
            os.umask(was)
        assert [path.stat().st_mode & 0o777 for path in (ledger.path, log_of(ledger.path))] == [mode] * 2


@pytest.mark.plain
def test_a_raised_alarm_keeps_its_worst_value_between_whole_entries(entry_at) -> None:
    worst = Alarm(kind="input_gaps", level=Level.ERROR, value=0.0, worst=0.42, limit=0.05, raised_ns=7)
    before, entry = entry_at(1), attrs.evolve(entry_at(2), alarms=(worst, Alarm(kind="cadence")))
    record, _ = encode(entry, Run(1), before, 0)
    kept, unknown = decode(record, before)[1].alarms
    assert (kept.name, kept.worst, kept.limit) == ("input_gaps", 0.42, 0.05)
    assert np.isnan(unknown.worst) and np.isnan(unknown.limit)
