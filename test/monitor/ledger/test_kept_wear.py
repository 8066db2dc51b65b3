"""Monitor and ledger together: wear goes on where it ended, and is not counted twice."""

import sqlite3
from contextlib import closing
from itertools import pairwise

import numpy as np
import pytest

from leg_wear_monitor import WearMonitor, open_ledger
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.accounting import next_point_s
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.state import Level

SECOND = 10**9
START_NS = 1_700_000_000_123_456_789


@pytest.fixture
def begin(leg, tmp_path):
    """Begin a run of a monitor on the ledger of this test; all are closed at its end."""
    begun = []

    def begin(values=None):
        config = config_from(
            {"ledger.path": str(tmp_path / "wear.ledger"), "clearance_joints": ["A", "G"]} | (values or {})
        )
        ledger = open_ledger(leg, config)
        monitor = WearMonitor(leg, config, ledger)
        begun.append(ledger)
        return monitor, ledger

    yield begin
    for ledger in begun:
        ledger.close()


def wear_status(monitor):
    return {status.name: status for status in monitor.status()}["ledger"]


def rows(tmp_path, query):
    with closing(sqlite3.connect(tmp_path / "wear.ledger")) as db:
        return db.execute(query).fetchall()


def test_wear_goes_on_where_it_ended(begin, gait, tmp_path):
    first, _ = begin()
    first.update(gait(4.5))
    worn, cycles = first._twin.depth, first._accounting.totals["cycles"]
    first.close()
    second, ledger = begin({"clearance_joints": ["G", "A"]})  # in another order
    assert ledger.cut_off_s is None
    np.testing.assert_array_equal(second._twin.depth, worn[::-1])
    reports = second.update(gait(4.0, begin_s=10.0))
    assert reports.cycles[0].cycle == cycles + 1 == 4
    second.close()
    moving = dict(rows(tmp_path, "SELECT name, moving_s FROM joint"))
    (total,) = rows(tmp_path, "SELECT value FROM total WHERE name = 'moving_s'")
    assert moving == {"A": pytest.approx(total[0]), "G": pytest.approx(total[0])}
    assert 7.5 < total[0] < 8.5


def test_time_that_is_counted_is_not_counted_again(begin, gait):
    first, _ = begin()
    first.update(gait(4.0))
    totals, worn = first._accounting.totals, first._twin.depth
    first.close()
    again, _ = begin()
    samples = gait(4.0)
    reports = again.update(samples)
    np.testing.assert_array_equal(again._twin.depth, worn)
    assert again._accounting.totals["moving_s"] == totals["moving_s"]
    assert reports.lost.already_counted > 750  # but for the tracker's lag at the end
    (status,) = [status for status in again.status() if status.name == "input"]
    assert status.values["already_counted"] == reports.lost.already_counted
    after = again.update(gait(5.5, begin_s=4.0))
    assert len(after.cycles) >= 3
    assert after.lost.unmonitored_s < 0.3
    assert {alarm.name for alarm in again.alarms.alarms if alarm.level} == {"input_rate torque"}
    again.close()
    third, _ = begin({"ledger.skip_counted": False})  # for a clock that begins anew each time
    third.update(samples)
    assert third._twin.depth.sum() > worn.sum()


def test_a_new_time_base_within_a_run_is_followed(begin, gait, tmp_path):
    monitor, _ = begin()
    monitor.update(gait(3.0, begin_s=1000.0))
    monitor.update(gait(3.0))
    assert monitor.lost.already_counted == 0
    assert monitor.lost.backward_jumps == 1
    monitor.close()
    spans = rows(tmp_path, "SELECT begin_ns, end_ns FROM span ORDER BY begin_ns")
    assert [round((begin - START_NS) / SECOND) for begin, _ in spans] == [0, 1000]
    assert all(end - begin < 3 * SECOND for begin, end in spans)


def test_an_entry_is_written_every_so_often(begin, gait, tmp_path):
    monitor, ledger = begin({"ledger.checkpoint_s": 1.0})
    stamps = set()
    for second in range(5):
        monitor.update(gait(1.0, begin_s=second))
        stamps.add(ledger.kept_ns)
        newest = monitor._twin.intake.followed_stamp_ns
        assert newest - ledger.kept_ns < 1.3 * SECOND
        assert wear_status(monitor).values["not_kept_s"] < 1.3
    assert len(stamps) == 5
    ledger.close()  # as a kill would leave it
    _, after = begin()
    assert 1.0 <= after.cut_off_s < 1.3


def test_the_next_start_says_that_wear_was_lost(begin, gait):
    monitor, ledger = begin()
    monitor.update(gait(2.0))
    ledger.close()
    second, _ = begin()
    status = wear_status(second)
    assert status.level is Level.WARN
    assert "interrupted" in status.message
    assert status.values["cut_off_s"] == 5.0
    second.acknowledge(0)
    assert wear_status(second).level is Level.OK


def test_a_standing_leg_writes_nothing(begin, gait):
    monitor, ledger = begin({"ledger.checkpoint_s": 1.0})
    monitor.update(gait(3.0))
    still = gait(6.0, rpm=0.0, begin_s=3.0)
    monitor.update(still[:800])
    kept_ns = ledger.kept_ns
    monitor.update(still[800:])
    assert ledger.kept_ns == kept_ns


def test_alarms_stay_latched_over_a_new_start_and_have_a_history(begin, gait, tmp_path):
    limits = {"limits.impact_force_n": 1000.0}
    monitor, _ = begin(limits)
    monitor.update(gait(3.0))
    monitor.close()
    second, _ = begin()  # the limit is no longer reached
    raised = {alarm.name for alarm in second.alarms.alarms if alarm.level is Level.ERROR}
    assert "impact_force A" in raised
    second.update(gait(3.0, begin_s=5.0))
    assert {alarm.name for alarm in second.alarms.alarms if alarm.level is Level.ERROR} >= raised
    cleared, _ = second.acknowledge(77)
    assert {alarm.name for alarm in cleared} >= {"impact_force A", "impact_force G"}
    second.close()
    history = rows(tmp_path, "SELECT level FROM alarm_history WHERE kind = 'impact_force' AND subject = 'A'")
    assert [level for (level,) in history] == [2, 0]


def test_a_replaced_part_has_its_history(begin, gait, tmp_path):
    monitor, _ = begin()
    cycles_before = len(monitor.update(gait(3.0)).cycles)
    was = monitor._twin.depth[1]
    monitor.reset_wear("G", START_NS, "ann")
    monitor.update(gait(3.0, begin_s=3.0))
    monitor.close()
    ((stamp_ns, who, what, joint, cycles, depth),) = rows(
        tmp_path, "SELECT stamp_ns, who, what, joint, cycles, depth FROM audit"
    )
    assert (stamp_ns, who, what, joint, cycles) == (START_NS, "ann", "reset_wear", "G", cycles_before)
    np.testing.assert_array_equal(np.frombuffer(depth).reshape(2, -1), was)
    joints = rows(tmp_path, "SELECT name, cycles, replaced_ns FROM joint")
    life = {name: (cycles, replaced_ns) for name, cycles, replaced_ns in joints}
    assert life["A"][0] == life["G"][0] + cycles_before
    assert (life["A"][1], life["G"][1]) == (0, START_NS)
    again, _ = begin()
    assert again._accounting.joint_wear(1, again._twin.depth).cycles == life["G"][0]


def test_a_ledger_that_cannot_be_written_stops_nothing(begin, gait):
    monitor, ledger = begin({"ledger.checkpoint_s": 1.0})
    monitor.update(gait(1.5))
    ledger._db.execute("PRAGMA query_only = ON")
    ledger.path.rename(ledger.path.with_suffix(".away"))
    reports = monitor.update(gait(2.0, begin_s=1.5))
    assert len(reports.cycles) == 2
    status = wear_status(monitor)
    assert status.level is Level.ERROR
    assert "moved away" in status.message
    with pytest.raises(LegWearError, match="moved away"):
        monitor.save()
    ledger.path.with_suffix(".away").rename(ledger.path)
    monitor.update(gait(1.5, begin_s=3.5))
    assert wear_status(monitor).level is Level.OK
    monitor.save()
    monitor.close()
    again, _ = begin()
    np.testing.assert_array_equal(again._twin.depth, monitor._twin.depth)


def test_clearances_are_noted_for_the_history(begin, gait, tmp_path):
    monitor, _ = begin()
    monitor.update(gait(4.0))
    monitor.close()
    points = rows(tmp_path, "SELECT cycle, joint, clearance_m FROM history")
    assert [(cycle, joint) for cycle, joint, _ in points] == [
        (1, "A"),
        (1, "G"),
    ]  # the next after ten minutes
    assert all(clearance_m > 3.0e-4 for *_, clearance_m in points)
    again, _ = begin()
    again.update(gait(4.0, begin_s=10.0))
    again.close()
    assert rows(tmp_path, "SELECT cycle, joint, clearance_m FROM history") == points  # in a later run, too


def test_the_history_of_a_year_is_thin_and_has_no_hole():
    year_s, times = 365 * 8 * 3600.0, [0.0]
    while times[-1] < year_s:
        times.append(next_point_s(times[-1]))
    assert times[1] == 600.0
    assert len(times) < 1200
    assert all(b - a <= max(600.0, 0.0051 * a) for a, b in pairwise(times))
