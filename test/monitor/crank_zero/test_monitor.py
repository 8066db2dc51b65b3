"""A monitor that finds its crank's zero: nothing is counted by a wrong angle, and nothing is lost."""

import math
from collections.abc import Callable, Iterator

import attrs
import numpy as np
import pytest
from reported import as_new, status_of

from leg_wear_monitor import Mechanism, WearMonitor
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.state import Level, State
from leg_wear_monitor.twin.sample import Samples

ZERO_RAD = 2.4


@pytest.fixture(scope="module")
def fresh(leg: Mechanism) -> Callable[[], WearMonitor]:
    """Gives a monitor of an encoder that starts at zero."""
    return as_new(WearMonitor(leg, config_from({"crank.zero": "at_start", "diagnosis.enabled": False})))


def cycles_of(monitor: WearMonitor, samples: Samples, block: int = 97) -> Iterator[CycleReport]:
    for piece in np.split(samples, range(block, len(samples), block)):
        yield from monitor.update(piece).cycles


def without_forecast(cycle: CycleReport) -> str:
    """A report to its last bit; a forecast depends on the time since the last one, too."""
    joints = tuple(attrs.evolve(joint, forecast=None) for joint in cycle.joints)
    return repr(attrs.asdict(attrs.evolve(cycle, forecast=None, joints=joints)))


def test_gait_cycles_and_wear_are_those_of_a_known_zero_bit_for_bit(fresh, new_monitor, walk) -> None:
    samples, monitor = walk(6.5, ZERO_RAD), fresh()
    found = [without_forecast(cycle) for cycle in cycles_of(monitor, samples)]
    values = status_of(monitor, "crank zero").values
    assert abs(math.remainder(values["offset_rad"] - ZERO_RAD, math.tau)) < 0.02
    known = new_monitor()
    samples["crank_angle_rad"] += values["offset_rad"]  # as the decoder adds a known one
    assert found == [without_forecast(cycle) for cycle in cycles_of(known, samples, 1000)]
    assert len(found) == 5
    assert monitor.wear_depth_m.tobytes() == known.wear_depth_m.tobytes()
    assert monitor.lost == known.lost


def test_it_is_said_while_it_is_looked_for(fresh, walk) -> None:
    samples, monitor = walk(5.0, ZERO_RAD), fresh()
    reports = monitor.update(samples[:1000])
    assert not len(reports.samples)
    assert [report.verdict.fault_code for report in reports.verdicts] == ["CRANK_ZERO"]
    assert monitor.verdict.verdict.state is State.NOT_MONITORED
    assert monitor.verdict.verdict.why.startswith("the crank's zero is being found: 2 of 3 turns")
    found = status_of(monitor, "crank zero")
    assert (found.level, found.fault_code) == (Level.WARN, "CRANK_ZERO")
    assert (found.values["turns"], found.values["times_found"]) == (2.0, 0.0)
    assert math.isnan(found.values["offset_rad"])
    assert status_of(monitor, "gait").fault_code == "CRANK_ZERO"
    # if it ended here, the time walked would not be monitored
    assert monitor.lost.unmonitored_s == pytest.approx(2.5, abs=0.05)
    reports = monitor.update(samples[1000:])
    assert "CRANK_ZERO" not in {report.verdict.fault_code for report in reports.verdicts}
    found = status_of(monitor, "crank zero")
    assert (found.level, found.fault_code, found.values["times_found"]) == (Level.OK, "NONE", 1.0)
    assert found.values["other_mismatch"] > found.values["mismatch"]
    assert monitor.lost.unmonitored_s == pytest.approx(0.1, abs=0.02)  # until the tracker has the crank


def test_a_restored_snapshot_continues_bit_for_bit(fresh, walk) -> None:
    samples, monitor = walk(5.0, ZERO_RAD), fresh()
    monitor.update(samples[:900])
    half = monitor.snapshot()
    expected = [without_forecast(cycle) for cycle in cycles_of(monitor, samples[900:])]
    state = [repr(each) for each in monitor.status()]
    monitor.restore(half)
    assert [without_forecast(cycle) for cycle in cycles_of(monitor, samples[900:], 500)] == expected
    assert [repr(each) for each in monitor.status()] == state
    assert expected


def test_a_drive_that_restarts_loses_the_time_of_its_restart_alone(fresh, walk) -> None:
    first, second = walk(5.0, ZERO_RAD), walk(5.0, 7.0 * math.tau - 1.0, begin_s=7.0, seed=1)
    monitor = fresh()
    is_known = []
    for piece in np.array_split(np.concatenate([first, second]), 60):
        monitor.update(piece)
        is_known.append("CRANK_ZERO" not in {finding.code for finding in monitor.verdict.findings})
    assert np.count_nonzero(np.diff(is_known)) == 3  # found, lost, found again
    assert status_of(monitor, "crank zero").values["times_found"] == 2.0
    assert abs(math.remainder(status_of(monitor, "crank zero").values["offset_rad"] + 1.0, math.tau)) < 0.02
    assert monitor.lost.unmonitored_s == pytest.approx(2.0 + 3 * 0.1, abs=0.1)  # and the tracker's lag
    moving_s = status_of(monitor, "gait").values["moving_s"]
    assert moving_s + monitor.lost.unmonitored_s == pytest.approx(12.0, abs=0.2)
    assert monitor.lost.outliers == 0


def test_an_offset_is_not_silently_ignored() -> None:
    with pytest.raises(ConfigError, match=r"crank\.offset_rad: 0\.3 rad is not used with crank\.zero"):
        config_from({"crank.zero": "at_start", "crank.offset_rad": 0.3})
