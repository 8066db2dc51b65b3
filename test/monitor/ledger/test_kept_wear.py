"""Monitor and ledger together: wear goes on where it ended, and is not counted twice."""

from itertools import pairwise

import attrs
import numpy as np
import pytest
from reported import raised, status_of

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.accounting import next_point_s
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.state import Level

SECOND = 10**9
START_NS = 1_700_000_000_123_456_789


def test_wear_goes_on_where_it_ended(begin, gait, rows):
    first = begin()
    first.update(gait(4.5))
    worn, cycles = first._twin.depth, first._accounting.totals["cycles"]
    first.close()
    second = begin({"clearance_joints": ["G", "A"]})  # in another order
    assert second._accounting.ledger.cut_off_s is None
    np.testing.assert_array_equal(second._twin.depth, worn[::-1])
    reports = second.update(gait(4.0, begin_s=10.0))
    assert reports.cycles[0].cycle == cycles + 1 == 4
    second.close()
    moving = dict(rows("SELECT name, moving_s FROM joint"))
    (total,) = rows("SELECT value FROM total WHERE name = 'moving_s'")
    assert moving == {"A": pytest.approx(total[0]), "G": pytest.approx(total[0])}
    assert 7.5 < total[0] < 8.5


def test_time_that_is_counted_is_not_counted_again(begin, gait):
    first = begin()
    first.update(gait(4.0))
    totals, worn = first._accounting.totals, first._twin.depth
    first.close()
    again = begin()
    samples = gait(4.0)
    reports = again.update(samples)
    np.testing.assert_array_equal(again._twin.depth, worn)
    assert again._accounting.totals["moving_s"] == totals["moving_s"]
    assert reports.lost.already_counted > 750  # but for the tracker's lag at the end
    assert status_of(again, "input").values["already_counted"] == reports.lost.already_counted
    after = again.update(gait(5.5, begin_s=4.0))
    assert len(after.cycles) >= 3
    assert after.lost.unmonitored_s < 0.3
    assert raised(again, Level.WARN) == {"input_rate torque"}
    again.close()
    third = begin({"ledger.skip_counted": False})  # for a clock that begins anew each time
    third.update(samples)
    assert third._twin.depth.sum() > worn.sum()


def test_a_new_time_base_within_a_run_is_followed(begin, gait, rows):
    monitor = begin()
    monitor.update(gait(3.0, begin_s=1000.0))
    monitor.update(gait(3.0))
    assert monitor.lost.already_counted == 0
    assert monitor.lost.backward_jumps == 1
    monitor.close()
    spans = rows("SELECT begin_ns, end_ns FROM span ORDER BY begin_ns")
    assert [round((begin - START_NS) / SECOND) for begin, _ in spans] == [0, 1000]
    assert all(end - begin < 3 * SECOND for begin, end in spans)


def test_an_entry_is_written_every_so_often(begin, gait, rows):
    monitor = begin({"ledger.checkpoint_s": 1.0})
    ledger = monitor._accounting.ledger
    stamps = set()
    for second in range(5):
        monitor.update(gait(1.0, begin_s=second))
        stamps.add(ledger.kept_ns)
        newest = monitor._twin.intake.followed_stamp_ns
        assert newest - ledger.kept_ns < 1.3 * SECOND
        assert status_of(monitor, "ledger").values["not_kept_s"] < 1.3
    assert len(stamps) == 5
    ledger.close()  # as a kill would leave it
    assert 1.0 <= begin()._accounting.ledger.cut_off_s < 1.3


def test_the_next_start_says_that_wear_was_lost(begin, gait):
    monitor = begin()
    monitor.update(gait(2.0))
    monitor._accounting.ledger.close()
    for checkpoint_s in (2.0, 1.0):  # until somebody has acknowledged it
        second = begin({"ledger.checkpoint_s": checkpoint_s})
        status = status_of(second, "ledger")
        assert status.level is Level.WARN
        assert "interrupted" in status.message
        assert status.values["cut_off_s"] == 5.0
        second.close()
    third = begin({"ledger.checkpoint_s": 1.0})
    third.acknowledge(0)
    assert status_of(third, "ledger").level is Level.OK
    third._accounting.ledger.close()
    assert begin()._accounting.ledger.cut_off_s < 5.0  # the third was interrupted, too


def test_a_standing_leg_writes_nothing(begin, gait):
    monitor = begin({"ledger.checkpoint_s": 1.0})
    ledger = monitor._accounting.ledger
    monitor.update(gait(3.0))
    still = gait(6.0, rpm=0.0, begin_s=3.0)
    monitor.update(still[:800])
    kept_ns = ledger.kept_ns
    monitor.update(still[800:])
    assert ledger.kept_ns == kept_ns


def test_alarms_stay_latched_over_a_new_start_and_have_a_history(begin, gait, rows):
    limits = {"limits.impact_force_n": 1000.0}
    monitor = begin(limits)
    monitor.update(gait(3.0))
    monitor.close()
    second = begin()  # the limit is no longer reached
    latched = raised(second)
    assert "impact_force A" in latched
    second.update(gait(3.0, begin_s=5.0))
    assert raised(second) >= latched
    cleared, _ = second.acknowledge(77)
    assert {alarm.name for alarm in cleared} >= {"impact_force A", "impact_force G"}
    second.close()
    history = rows("SELECT level FROM alarm_history WHERE kind = 'impact_force' AND subject = 'A'")
    assert [level for (level,) in history] == [2, 0]


@pytest.mark.parametrize("was_acknowledged", [False, True])
def test_an_alarm_of_encoders_that_are_not_read_any_more_stays_until_it_is_acknowledged(
    begin, gait, rows, was_acknowledged
):
    first = begin()
    first.update(gait(2.5))
    first.close()
    departed = Alarm(
        kind="clearance_departure", subject="G", level=Level.ERROR, present=Level.ERROR, worst=4e-4,
        limit=1e-4, raised_ns=START_NS, acknowledged=was_acknowledged,
    )  # fmt: skip
    ledger = begin()._accounting.ledger
    ledger.record(attrs.evolve(ledger.entry, spans=(), alarms=(departed,)))
    ledger.close()
    for begin_s in (5.0, 10.0):
        later = begin()
        later.update(gait(2.5, begin_s=begin_s))
        assert (departed.name in raised(later)) != was_acknowledged
        later.close()
    last = begin()
    last.acknowledge(START_NS)
    assert departed.name not in raised(last)
    last.close()
    assert rows("SELECT level FROM alarm_history WHERE kind = 'clearance_departure'") == [(0,)]
    assert begin().alarms.level is Level.OK


def test_a_ledger_that_cannot_be_written_stops_nothing(begin, gait):
    monitor = begin({"ledger.checkpoint_s": 1.0})
    ledger = monitor._accounting.ledger
    monitor.update(gait(1.5))
    ledger._db.execute("PRAGMA query_only = ON")
    ledger.path.rename(ledger.path.with_suffix(".away"))
    reports = monitor.update(gait(2.0, begin_s=1.5))
    assert len(reports.cycles) == 2
    status = status_of(monitor, "ledger")
    assert status.level is Level.ERROR
    assert "moved away" in status.message
    with pytest.raises(LegWearError, match="moved away"):
        monitor.save()
    ledger.path.with_suffix(".away").rename(ledger.path)
    monitor.update(gait(1.5, begin_s=3.5))
    assert status_of(monitor, "ledger").level is Level.OK
    monitor.save()
    monitor.close()
    again = begin()
    np.testing.assert_array_equal(again._twin.depth, monitor._twin.depth)


def test_a_last_entry_that_cannot_be_written_is_reported(begin, gait):
    monitor = begin()
    monitor.update(gait(2.5))
    path = monitor._accounting.ledger.path
    path.rename(path.with_suffix(".away"))
    with pytest.raises(LegWearError, match=r"moved away.*; nothing of what came after its last entry"):
        monitor.close()


def test_clearances_are_noted_for_the_history(begin, gait, rows):
    monitor = begin()
    monitor.update(gait(4.0))
    monitor.close()
    points = rows("SELECT cycle, joint, clearance_m FROM history")
    assert [point[:2] for point in points] == [(1, "A"), (1, "G")]  # the next after ten minutes
    assert all(clearance_m > 3.0e-4 for *_, clearance_m in points)
    again = begin()
    again.update(gait(4.0, begin_s=10.0))
    again.close()
    assert rows("SELECT cycle, joint, clearance_m FROM history") == points  # in a later run, too


def test_the_history_of_a_year_is_thin_and_has_no_hole():
    year_s, times = 365 * 8 * 3600.0, [0.0]
    while times[-1] < year_s:
        times.append(next_point_s(times[-1]))
    assert times[1] == 600.0
    assert len(times) < 1200
    assert all(b - a <= max(600.0, 0.0051 * a) for a, b in pairwise(times))
