"""What people do to a monitor: set parameters, well and badly, and call its services."""

from pathlib import Path

import pytest

pytest.importorskip("rclpy")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.parameters import PARAMETERS
from leg_wear_monitor.ros.gait_publisher import GaitPublisher
from leg_wear_monitor.ros.monitor_node import MonitorNode

ME = "/leg_wear_monitor"


@pytest.fixture(scope="module")
def ledger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("ledger") / "wear.db"


@pytest.fixture(scope="module")
def monitor(shared_stage, walk, ledger: Path):
    """A monitor that has seen all of the walk, with alarms raised in each joint."""
    monitor = shared_stage.monitor(
        wear_acceleration=1.0e5,
        ledger__path=str(ledger),
        limits__clearance_m=3.0e-4,
        alarms__on_delay_cycles=1,
    )
    shared_stage.legs().play(walk, monitor)
    return monitor


def set_to(stage, name: str, value: object):
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return stage.call(SetParameters, f"{ME}/set_parameters", request).results[0]


def trigger(stage, name: str):
    return stage.call(Trigger, f"{ME}/{name}", Trigger.Request())


def test_a_live_parameter_changes_the_running_monitor(shared_stage, monitor) -> None:
    assert set_to(shared_stage, "limits.growth_m_per_hour", 0.5).successful
    assert monitor.node.monitor.config.limits.growth_m_per_hour == 0.5
    assert monitor.node.get_parameter("limits.growth_m_per_hour").value == 0.5


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        (
            "limits.clearance_m",
            7.0,
            "limits.clearance_m: 7.0 is not at most 0.1 m, expected above 0, at most 0.1",
        ),
        ("limits.clearance_m", float("nan"), "not a finite number"),
        ("limits.clearance_m", "wide", "Wrong parameter type"),
        ("hardware_id", "other", "read-only"),
        ("limits.clearence_m", 0.001, "declared"),
        ("limits.joint_clearance_m", [0.001], "has 1 values, expected one each for A, B, G, I, J"),
    ],
)
def test_a_change_that_cannot_be_is_refused_in_a_line(shared_stage, monitor, name, value, reason) -> None:
    result = set_to(shared_stage, name, value)
    assert not result.successful
    assert reason in result.reason
    assert "\n" not in result.reason
    assert monitor.node.monitor.config.limits.clearance_m == 3.0e-4


def test_every_parameter_is_described(shared_stage, monitor) -> None:
    names = list(PARAMETERS)
    request = DescribeParameters.Request(names=names)
    told = shared_stage.call(DescribeParameters, f"{ME}/describe_parameters", request).descriptors
    for name, one in zip(names, told, strict=True):
        assert one.description.startswith(PARAMETERS[name].description)
        assert one.read_only == PARAMETERS[name].read_only
        assert one.additional_constraints == PARAMETERS[name].bounds


def test_alarms_are_acknowledged_and_stay_while_they_are_present(shared_stage, monitor) -> None:
    answer = trigger(shared_stage, "acknowledge_alarms")
    assert answer.success
    assert "clearance A" in answer.message.split("still present")[1]
    heard = shared_stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    shared_stage.wait_for(lambda: bool(heard), "the latched list of alarms")
    line = next(one for one in heard[-1].status if one.name.endswith(": clearance A"))
    assert line.message == "present, acknowledged"


def test_a_part_is_replaced_and_the_ledger_saved(shared_stage, monitor, ledger: Path) -> None:
    wear_monitor = monitor.node.monitor
    worn = wear_monitor.status()
    asked = trigger(shared_stage, "reset_wear/A")
    assert not asked.success
    assert "not reset yet" in asked.message
    assert "call again within 30 s" in asked.message
    assert [repr(one) for one in wear_monitor.status()] == [repr(one) for one in worn]
    forecasts = shared_stage.listen("/leg_wear_monitor/forecast", DiagnosticArray)
    answer = trigger(shared_stage, "reset_wear/A")
    assert answer.success
    shared_stage.wait_for(lambda: bool(forecasts), "the forecast of the new part, while the leg rests")
    joints = {one.name: one.values["clearance_m"] for one in wear_monitor.status() if "joint" in one.name}
    before = {one.name: one.values["clearance_m"] for one in worn if "joint" in one.name}
    assert joints["joint A"] == pytest.approx(3.0e-4, rel=1e-12)
    assert before["joint A"] > 3.05e-4
    assert joints["joint B"] == before["joint B"]
    assert trigger(shared_stage, "save_state").success
    assert ledger.exists()
    answer = trigger(shared_stage, "undo_reset/A")
    assert answer.success
    assert "undone" in answer.message
    joints = {one.name: one.values["clearance_m"] for one in wear_monitor.status() if "joint" in one.name}
    assert joints == before
    answer = trigger(shared_stage, "undo_reset/A")
    assert not answer.success
    assert "has no reset to undo" in answer.message


@pytest.mark.parametrize(
    ("node", "parameters", "line"),
    [
        (MonitorNode, {"limits.clearance_m": 7.0}, "limits.clearance_m: 7.0 is not at most 0.1 m"),
        (MonitorNode, {"limits.clearance_m": 1}, "is a whole number to ROS, expected 1.0 [m]"),
        (MonitorNode, {"limit.clearance_m": 1.0}, "unknown parameter, did you mean limits.clearance_m?"),
        (MonitorNode, {"mechanism": "no_leg"}, "no_leg: no mechanism of this name"),
        (MonitorNode, {"record.path": "/no/such/place.mcap"}, "/no/such/place.mcap: cannot be written"),
        (MonitorNode, {"ledger.path": "/no/such/place.db"}, "/no/such/place.db: cannot be created"),
        (GaitPublisher, {"pace.ripple": 1.0}, "pace.ripple: 1.0 is not at most 0.9"),
        (GaitPublisher, {"precompute": True}, "precompute: needs a duration_s above 0 s"),
    ],
)
def test_a_node_with_a_bad_parameter_does_not_start(node, parameters, line) -> None:
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--log-level", "error"], context=context)
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    try:
        with pytest.raises(LegWearError) as refused:
            node(context=context, parameter_overrides=overrides)
    finally:
        rclpy.utilities.try_shutdown(context=context)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
