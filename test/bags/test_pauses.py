"""A pause between two recordings that are given together is no fault of the input."""

import pytest
from short_walk import torque_of_a_cycle, write_walk

import leg_wear_monitor as lw
from leg_wear_monitor.bags.findings import Severity
from leg_wear_monitor.monitor.input_health import Pauses

SECONDS, PAUSE_S = 5, 3600.0


@pytest.fixture
def record(tmp_path, leg):
    """Record a steady gait of a few seconds into a file, from a time [s] on."""
    cycle = torque_of_a_cycle(leg)
    return lambda name, begin_s: write_walk(cycle, tmp_path / name, begin_s, SECONDS, seed=1)


def gaps(result):
    return [alarm.name for _, alarm in result.history.changes if alarm.name == "input_gaps"]


def test_a_pause_between_recordings_is_reported_and_raises_no_alarm(record):
    paths = [record("a.mcap", 0.0), record("b.mcap", SECONDS + PAUSE_S)]
    config = lw.MonitorConfig()
    result = lw.replay(paths, config)
    lost = result.monitor.lost
    assert gaps(result) == []
    assert lost.gaps_lost == 0
    assert lost.paused_s == pytest.approx(PAUSE_S, abs=0.01)
    assert 0.0 < lost.unmonitored_s < 1.0
    (note,) = (each for each in result.findings if "begins" in each.text)
    assert note.file == paths[1] and note.severity is Severity.NOTE
    assert "begins 3600 s after the recording before it ended" in note.text
    status = {each.name: each for each in result.monitor.status()}
    assert status["gait"].values["unmonitored_s"] == lost.unmonitored_s


def test_what_is_missing_in_one_bag_is_a_fault_of_the_input(record):
    """The same silence between files of one bag: somebody recorded, and nothing came."""
    first = record("bag/a_0.mcap", 0.0)
    record("bag/a_1.mcap", SECONDS + 5.0)
    result = lw.replay(first.parent, lw.MonitorConfig())
    assert gaps(result)
    assert result.monitor.lost.paused_s == 0.0 and result.monitor.lost.unmonitored_s > 4.0


@pytest.mark.plain
def test_pauses_are_taken_from_the_time_without_a_leg_once_it_is_in_there():
    pauses = Pauses().with_pause(10.0, unmonitored_s=2.0)
    assert pauses.passed_s(2.0) == 0.0
    assert pauses.passed_s(12.3) == 10.0
    again = pauses.with_pause(5.0, unmonitored_s=12.3)
    assert again.passed_s(12.3) == 10.0 and again.passed_s(20.0) == 15.0
    assert again.number == 2 and again.total_s == 15.0
