"""A healthy leg raises no alarm, whichever message brings its drive torque; a missing torque raises one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.messages import encode
from leg_wear_monitor.monitor.config.inputs import TORQUE_SOURCES, DriveTorque
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import Samples

HEALTHY = share_directory() / "bags" / "healthy.mcap"
SECONDS = 6
TRANSPORT_NS = 300_000  # between a stamp and its log time


@pytest.fixture(scope="module")
def walked() -> tuple[Samples, Samples]:
    """Crank and torque samples of the healthy sample recording's first seconds."""
    with Recording([HEALTHY], lw.MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    samples = samples[samples["stamp_ns"] < samples["stamp_ns"][0] + SECONDS * 10**9]
    crank = samples["kind"] == CRANK
    number = min(np.count_nonzero(crank), np.count_nonzero(~crank))
    return samples[crank][:number], samples[~crank][:number]


def joint_rows(crank: Samples, effort: Any) -> Any:
    """Messages of the crank and of a joint that stands still."""
    still = np.zeros(len(crank))
    values = {"position": crank["crank_angle_rad"], "velocity": crank["crank_velocity_radps"]}
    if effort is not None:
        values["effort"] = effort
    both = {name: np.stack([still, value], axis=1) for name, value in values.items()}
    return encode.joint_states(crank["stamp_ns"], ["hip", "crank"], **both)


@pytest.fixture
def write(walked: tuple[Samples, Samples], tmp_path: Path) -> Callable[..., Path]:
    """Write the walk with its torque from one source."""

    def bag(source: str, effort: Any = None, shorten: bool = False) -> Path:
        crank, torque = walked
        values = torque["torque_nm"]
        if source == "effort" and effort is None:
            effort = values
        path = tmp_path / f"{source}.mcap"
        with McapWriter(path) as writer:
            joints = writer.channel("/joint_states", encode.JOINT_STATE)
            rows = joint_rows(crank, effort)
            if shorten:  # one effort for two joints
                rows = rows[:, :-8].copy()
                rows[:, joint_rows(crank, None).shape[1] - 4] = 1
            writer.write_many(joints, crank["stamp_ns"] + TRANSPORT_NS, rows)
            if source == "wrench":
                axes = np.stack([0.0 * values, 0.0 * values, values], axis=1)
                rows = encode.wrenches(torque["stamp_ns"], torque=axes, frame_id="pelvis")
                channel = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
                writer.write_many(channel, torque["stamp_ns"] + TRANSPORT_NS, rows)
            if source == "interface":
                there = {"hip": {}, "crank": {"position": 0.0, "effort": values}}
                rows = encode.dynamic_joint_states(torque["stamp_ns"], there)
                channel = writer.channel("/dynamic_joint_states", encode.DYNAMIC_JOINT_STATE)
                writer.write_many(channel, torque["stamp_ns"] + TRANSPORT_NS, rows)
            if source == "float64":
                channel = writer.channel("/drive_torque", encode.FLOAT64)
                writer.write_many(channel, torque["stamp_ns"] + TRANSPORT_NS, encode.float64s(values))
        return path

    return bag


def replayed(path: Path, source: str, **torque: Any) -> Any:
    return lw.replay(
        path, attrs.evolve(lw.MonitorConfig(), drive_torque=DriveTorque(source=source, **torque))
    )


@pytest.mark.parametrize("source", TORQUE_SOURCES)
def test_a_healthy_leg_raises_no_alarm(write: Callable[..., Path], source: str) -> None:
    result = replayed(write(source), source)
    assert len(result.history) >= SECONDS - 2
    assert not result.history.changes
    assert result.torque_samples == result.crank_samples > 190 * SECONDS
    status = {each.name: each for each in result.monitor.status()}
    assert status["input"].values["torque_rate_hz"] == pytest.approx(200.0, rel=0.05)
    assert status["torque"].values["samples"] == pytest.approx(200.0, rel=0.05)
    assert status["torque"].message == "measured as predicted"


@pytest.mark.parametrize("what", ["absent", "empty"])
def test_an_effort_that_is_gone_raises_the_alarm_of_the_torques_rate(
    write: Callable[..., Path], walked: tuple[Samples, Samples], what: str
) -> None:
    path = write("wrench") if what == "absent" else write("effort", np.full(len(walked[0]), np.nan))
    result = replayed(path, "effort")
    assert {alarm.name for _, alarm in result.history.changes} == {"input_rate torque"}
    assert result.torque_samples == 0


def test_efforts_that_are_not_one_a_joint_raise_alarms(
    write: Callable[..., Path], walked: tuple[Samples, Samples]
) -> None:
    result = replayed(write("effort", shorten=True), "effort")
    errors = {alarm.name for _, alarm in result.history.changes if alarm.level is Level.ERROR}
    assert "input_samples" in errors
    assert result.monitor.lost.faulty["wrong_length"] == len(walked[0])


def test_an_interface_that_is_not_there_is_reported_with_those_that_are(write: Callable[..., Path]) -> None:
    result = replayed(write("interface"), "interface", interface="motor_current")
    assert {alarm.name for _, alarm in result.history.changes} >= {"input_rate torque"}
    texts = [finding.text for finding in result.findings if "dynamic_joint_states" in finding.text]
    assert texts == [
        f"{result.crank_samples} messages of dynamic_joint_states: crank has no interface 'motor_current', "
        "it has effort, position; set drive_torque.interface"
    ]
