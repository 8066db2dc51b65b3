"""A reset that is taken back: the part was not replaced, and its wear went on."""

import numpy as np
import pytest

from leg_wear_monitor import WearMonitor
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.parameters import config_from

START_NS = 1_700_000_000_123_456_789


def test_wear_before_and_since_a_reset_is_of_one_part_once_it_is_taken_back(begin, gait, rows) -> None:
    monitor = begin()
    monitor.update(gait(2.5))
    worn = monitor.wear_of("G")
    monitor.reset_wear("G", START_NS, "ann")
    monitor.update(gait(2.5, begin_s=2.5))
    since = monitor.wear_of("G")
    assert since.replaced_ns == START_NS
    assert (since.depth > 0.0).any()
    others = np.delete(monitor.wear_depth_m, monitor.clearance_joints.index("G"), axis=0)
    now = monitor.undo_reset("G", START_NS + 7, "bob")
    assert np.array_equal(now.depth, worn.depth + since.depth)
    assert now.cycles == worn.cycles + since.cycles
    assert now.moving_s == pytest.approx(worn.moving_s + since.moving_s, abs=1e-9)
    assert now.replaced_ns == worn.replaced_ns == 0
    assert np.array_equal(
        np.delete(monitor.wear_depth_m, monitor.clearance_joints.index("G"), axis=0), others
    )
    with pytest.raises(LegWearError, match="joint G: the ledger has no reset to undo"):
        monitor.undo_reset("G", START_NS + 8, "bob")
    monitor.close()
    audit = rows("SELECT id, who, what, undoes FROM audit ORDER BY id")
    assert audit == [(1, "ann", "reset_wear", None), (2, "bob", "undo_reset", 1)]
    again = begin()
    assert np.array_equal(again.wear_of("G").depth, now.depth)
    assert again.wear_of("G").cycles == now.cycles


def test_a_stop_returns_once_the_reset_that_ended_it_is_taken_back(begin, gait, rows) -> None:
    monitor = begin({"diagnosis.enabled": False})
    monitor.update(gait(2.5))
    monitor.measure("G", 1.2e-3, 5e-6, START_NS, "ann")
    stopped = monitor.verdict.verdict
    monitor.reset_wear("G", START_NS + 1, "ann")
    assert monitor.verdict.verdict.state.value != "stop"
    monitor.undo_reset("G", START_NS + 2, "ann")
    now = monitor.verdict.verdict
    assert (stopped.state.value, stopped.fault_code) == ("stop", "CLEARANCE_G")
    assert (now.state, now.fault_code, now.since_ns) == (stopped.state, stopped.fault_code, stopped.since_ns)
    (alarm,) = (each for each in monitor.alarms.alarms if each.name == "clearance G")
    assert (alarm.worst, alarm.cause, alarm.unit, alarm.acknowledged) == (1.2e-3, "measured", "m", False)
    monitor.close()
    assert rows("SELECT level FROM alarm_history WHERE subject = 'G'") == [(2,), (0,), (2,)]
    (last,) = rows("SELECT state FROM verdict ORDER BY id DESC LIMIT 1")
    assert last == ("stop",)


def test_without_a_ledger_there_is_nothing_to_take_back(leg) -> None:
    monitor = WearMonitor(leg, config_from({"clearance_joints": ["G"]}))
    monitor.reset_wear("G", START_NS, "ann")
    with pytest.raises(LegWearError, match="no ledger is used"):
        monitor.undo_reset("G", START_NS, "ann")


def test_stamps_may_be_those_of_samples(begin, gait, rows) -> None:
    monitor, samples = begin(), gait(2.5)
    monitor.update(samples)
    last_ns = samples["stamp_ns"][-1]  # of NumPy, which SQLite would keep as bytes
    monitor.reset_wear("G", last_ns, "ann")
    monitor.measure("G", np.float32(3.1e-4), np.float32(1e-5), last_ns, "ann")
    monitor.undo_reset("G", last_ns, "bob")
    monitor.acknowledge(last_ns)
    monitor.begin_epoch(last_ns, "bob")
    monitor.close()
    assert rows("SELECT stamp_ns FROM audit") == [(int(last_ns),)] * 3
    assert rows("SELECT stamp_ns FROM measurement") == [(int(last_ns),)]
