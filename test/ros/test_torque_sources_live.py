"""The monitor over real DDS with every source of the drive torque: no alarm on a healthy leg."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.gait.config import EFFORT, FLOAT64, TORQUE_SOURCES, TorqueSensorConfig
from leg_wear_monitor.gait.sensors import Reading
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.ros.gait_publisher import PublisherConfig
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

ME = "/leg_wear_monitor"
START_NS = 1_700_000_000_000_000_000
SECONDS = 6.0


@pytest.fixture(scope="module")
def healthy():
    """Readings of the healthy sample recording's first seconds."""
    with Recording([share_directory() / "bags" / "healthy.mcap"], MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    begin_ns = samples["stamp_ns"][0] - 10_000_000
    found = []
    for row in samples[samples["stamp_ns"] < begin_ns + SECONDS * 1.0e9]:
        taken_s = float(row["stamp_ns"] - begin_ns) * 1.0e-9
        values = (float(row[name]) for name in ("crank_angle_rad", "crank_velocity_radps", "torque_nm"))
        found.append(Reading(taken_s, taken_s, int(row["kind"]), NO_FAULT, *values))
    return found


def walk_with(readings, source):
    """The walk with its torque from a source."""
    if source == EFFORT:
        crank, torque = ([one for one in readings if one.kind == kind] for kind in (CRANK, TORQUE))
        pairs = zip(crank, torque, strict=False)
        readings = [one._replace(torque_nm=with_it.torque_nm) for one, with_it in pairs]
    config = PublisherConfig(torque_sensor=TorqueSensorConfig(source=source))
    return SimpleNamespace(config=config, readings=readings)


@pytest.mark.parametrize("source", TORQUE_SOURCES)
def test_a_healthy_leg_raises_no_alarm(stage, healthy, source, arrive_at) -> None:
    """A Float64 has no stamp: it is of the time at which it comes, here that of the walk."""
    monitor = stage.monitor(drive_torque__source=source)
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    block_s = 1.0e-4 if source == FLOAT64 else 0.015
    stage.legs(source=source).play(walk_with(healthy, source), monitor, block_s=block_s, before=arrive_at)
    stage.wait_for(lambda: bool(alarms), "the alarms")
    status = {one.name: one for one in monitor.node.monitor.status()}
    assert [line.name for message in alarms for line in message.status if line.level[0]] == []
    assert status["input"].values["torque_rate_hz"] == pytest.approx(200.0, rel=0.05)
    assert status["torque"].values["samples"] == pytest.approx(200.0, rel=0.05)
    assert status["torque"].message == "measured as predicted"
