"""Entries between whole surfaces: cheap, exact in all that is counted, surfaces as last seen."""

import os

import attrs
import numpy as np
import pytest
from ledger_contents import contents

from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.file import copy_of
from leg_wear_monitor.monitor.ledger.ledger import WHOLE_S
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

SECOND = 10**9
MACHINE = np.finfo(float).eps


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
        spans = ((0, stamp_ns, 0),)
        entries.append(attrs.evolve(last, stamp_ns=stamp_ns, joints=joints, totals=totals, spans=spans))
    return entries


@pytest.fixture
def killed(open_ledger, walk):
    """A ledger whose run was killed after all entries of the walk; the first had whole surfaces."""
    ledger = open_ledger()
    assert all(ledger.keep(entry, whole=False) for entry in walk)
    ledger.close()
    return ledger.path


def surfaces(entry):
    """Their wear depths, to the bit."""
    return [joint.depth.tobytes() for joint in entry.joints]


def test_a_copy_for_a_trial_has_the_last_entry(killed):
    with copy_of(killed) as copy:
        assert copy.read_bytes() == killed.read_bytes()


def test_after_a_kill_all_that_is_counted_is_exact_to_the_last_entry(open_ledger, killed, walk):
    found = open_ledger()
    last, first = walk[-1], walk[0]
    for joints in zip(found.entry.joints, last.joints, first.joints, strict=True):
        got, given, seen = (joint.depth for joint in joints)
        lives = [(j.name, j.cycles, j.moving_s, j.replaced_ns) for j in joints[:2]]
        assert lives[0] == lives[1]
        np.testing.assert_allclose(joints[0].surface_means_m, joints[1].surface_means_m, rtol=8 * MACHINE)
        risen = got / seen  # each surface as it was seen, higher
        np.testing.assert_allclose(risen, risen.mean(axis=1, keepdims=True) * np.ones(720), rtol=8 * MACHINE)
        assert (risen > 1.0).all() and (given > seen).all()
    bare = [contents(attrs.evolve(entry, joints=())) for entry in (found.entry, last)]
    assert bare[0] == bare[1]
    assert (found.cut_off_s, found.kept_ns) == (5.0, last.stamp_ns)
    assert "interrupted" in found.loss
    assert found.counted_ns.tolist() == [[0, last.stamp_ns]]
    found.close()
    assert contents(open_ledger().entry) == contents(found.entry)  # also after a second kill


def test_a_new_part_has_worn_evenly_as_far_as_anybody_knows(open_ledger, walk):
    ledger = open_ledger()
    new = [attrs.evolve(joint, depth=np.zeros((2, 720))) for joint in walk[0].joints]
    ledger.keep(attrs.evolve(walk[0], joints=tuple(new)))
    ledger.keep(walk[1], whole=False)
    ledger.close()
    for found, given in zip(open_ledger().entry.joints, walk[1].joints, strict=True):
        means = np.array(given.surface_means_m).reshape(2, 1)
        np.testing.assert_array_equal(found.depth, np.broadcast_to(means, (2, 720)))


def test_a_run_that_ends_in_order_is_exact_and_one_file(open_ledger, walk, tmp_path):
    ledger = open_ledger()
    for entry in walk:
        ledger.keep(entry, whole=False)
    ledger.keep(walk[-1], closed=True)
    ledger.close()
    assert [path.name for path in tmp_path.iterdir()] == [ledger.path.name]
    found = open_ledger()
    assert contents(found.entry) == contents(walk[-1])
    assert (found.cut_off_s, found.loss) == (None, "")


def test_whole_surfaces_are_written_each_minute_of_motion(open_ledger, walk):
    ledger = open_ledger()
    ledger.keep(walk[0])
    far = attrs.evolve(walk[1], totals=walk[1].totals | {"moving_s": walk[0].moving_s + WHOLE_S})
    ledger.keep(far, whole=False)
    ledger.close()
    assert surfaces(open_ledger().entry) == surfaces(far)


def written() -> int:
    """Bytes that this process has handed to the system."""
    with open("/proc/self/io", encoding="ascii") as file:
        return int(next(line for line in file if line.startswith("wchar")).split()[1])


def test_entries_cost_some_kilobytes_and_the_file_does_not_grow_with_them(open_ledger, walk):
    ledger = open_ledger()
    ledger.keep(walk[0])
    size, before = ledger.path.stat().st_size, written()
    for entry in walk[1:]:
        assert ledger.keep(entry, whole=False)
    assert (written() - before) / len(walk[1:]) < 8000  # whole surfaces of two joints alone have 23 kB
    assert ledger.path.stat().st_size == size
    for entry in walk[1:]:
        ledger.keep(entry)
    assert ledger.path.stat().st_size == size


def test_a_file_can_be_read_by_owner_and_group_alone_or_less(open_ledger, walk, tmp_path):
    for umask, mode in ((0o022, 0o640), (0o077, 0o600)):
        was = os.umask(umask)
        try:
            ledger = open_ledger(path=tmp_path / f"{umask}.ledger")
            ledger.keep(walk[0])
        finally:
            os.umask(was)
        assert ledger.path.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize("whole", [True, False])
def test_a_raised_alarm_keeps_its_worst_value(open_ledger, entry_at, whole) -> None:
    worst = Alarm(kind="input_gaps", level=Level.ERROR, value=0.0, worst=0.42, limit=0.05, raised_ns=7)
    entry = attrs.evolve(entry_at(2), alarms=(worst, Alarm(kind="cadence")))
    ledger = open_ledger()
    ledger.keep(entry_at(1))
    ledger.keep(entry, whole=whole)
    ledger.close()
    kept = {alarm.name: alarm for alarm in open_ledger().entry.alarms}
    assert (kept["input_gaps"].worst, kept["input_gaps"].limit) == (0.42, 0.05)
    assert np.isnan(kept["cadence"].worst) and np.isnan(kept["cadence"].limit)
