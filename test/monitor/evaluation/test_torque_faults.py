"""A torque that no drive has is told by its name, on a leg that is healthy otherwise."""

import numpy as np
import pytest

pytest.importorskip("mcap")

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.share import share_directory

SECONDS = 8


@pytest.fixture(scope="module")
def healthy():
    """The healthy sample recording's first seconds; its torque has an RMS of 8.4 N m."""
    with Recording([share_directory() / "bags" / "healthy.mcap"], MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    return samples[samples["stamp_ns"] < samples["stamp_ns"][0] + SECONDS * 10**9]


@pytest.mark.parametrize(
    ("bias_nm", "offset_rad", "alarm", "cause"),
    [
        (20.0, 0.0, "torque_bias", "exceeds the largest friction of the drive"),
        (-5.0, 0.0, "torque_bias", "friction cannot"),
        (0.0, 0.05, "torque_lag", "crank.offset_rad"),
        (1.5, 0.0, None, "measured as predicted"),
    ],
)
def test_it_is_told(monitor, healthy, bias_nm, offset_rad, alarm, cause):
    samples = healthy.copy()
    samples["torque_nm"] += bias_nm
    samples["crank_angle_rad"] += offset_rad
    reports = monitor.update(samples)
    raised = {one.name: one.level for one in monitor.alarms.alarms if one.level is not Level.OK}
    assert raised.keys() == ({alarm} if alarm else set())
    status = {one.name: one for one in monitor.status()}["torque"]
    assert cause in status.message
    if alarm:
        assert raised[alarm] is Level.ERROR is status.level
        assert status.message != "measured as predicted"
    if offset_rad:
        assert status.values["crank_offset_error_rad"] == pytest.approx(offset_rad, rel=0.15)
    assert reports.cycles[-1].friction_nm == pytest.approx(bias_nm, abs=0.3)
