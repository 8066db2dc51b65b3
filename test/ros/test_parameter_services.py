"""Parameters as ros2 param and rqt_reconfigure ask for them: listed, dumped, edited, loaded."""

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
import yaml
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file, parameter_value_to_python
from rclpy.utilities import try_shutdown
from rosgraph_msgs.msg import Clock

from leg_wear_monitor.monitor.config.parameters import PARAMETERS, load_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.ros.monitor_node import MonitorNode
from leg_wear_monitor.ros.running import ClosingNode, Parameters

ME = "/leg_wear_monitor"


@pytest.fixture(scope="module")
def node(shared_stage) -> MonitorNode:
    return shared_stage.monitor(encoders__names=["knee"], encoders__joints=["G"]).node


def names_of(stage, prefixes: tuple[str, ...] = (), depth: int = 0) -> list[str]:
    request = ListParameters.Request(prefixes=list(prefixes), depth=depth)
    return list(stage.call(ListParameters, f"{ME}/list_parameters", request).result.names)


def dumped(stage) -> dict[str, Any]:
    """What `ros2 param dump` writes: all names, then all values in one call, nested by their dots."""
    names = sorted(names_of(stage))
    request = GetParameters.Request(names=names)
    values = stage.call(GetParameters, f"{ME}/get_parameters", request).values
    assert len(values) == len(names)
    tree: dict[str, Any] = {}
    for name, value in zip(names, values, strict=True):
        *sections, last = name.split(".")
        place = tree
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = parameter_value_to_python(value)
    return tree


def written(tree: dict[str, Any], path: Path) -> Path:
    path.write_text(yaml.dump({ME: {"ros__parameters": tree}}, default_flow_style=False))
    return path


def loaded(stage, path: Path) -> dict[str, str]:
    """What `ros2 param load` does; reasons of what was refused, by name."""
    wanted = list(parameter_dict_from_yaml_file(str(path), target_nodes=[ME]).values())
    request = SetParameters.Request(parameters=wanted)
    results = stage.call(SetParameters, f"{ME}/set_parameters", request).results
    return {one.name: result.reason for one, result in zip(wanted, results, strict=True) if result.reason}


def test_every_parameter_is_listed_and_has_a_value_of_its_type(shared_stage, node) -> None:
    assert set(PARAMETERS) <= set(names_of(shared_stage))
    names = list(PARAMETERS)
    request = GetParameters.Request(names=names)
    values = shared_stage.call(GetParameters, f"{ME}/get_parameters", request).values
    types = shared_stage.call(
        GetParameterTypes, f"{ME}/get_parameter_types", GetParameterTypes.Request(names=names)
    ).types
    told = shared_stage.call(
        DescribeParameters, f"{ME}/describe_parameters", DescribeParameters.Request(names=names)
    ).descriptors
    kinds = [Parameter.Type[PARAMETERS[name].type.upper()].value for name in names]
    assert [value.type for value in values] == kinds == list(types) == [one.type for one in told]


def test_sections_are_listed_by_prefix_and_depth(shared_stage, node) -> None:
    limits = [name for name in PARAMETERS if name.startswith("limits.")]
    assert sorted(names_of(shared_stage, ("limits",))) == sorted(limits)
    assert "mechanism" in names_of(shared_stage, depth=1)
    assert not set(limits) & set(names_of(shared_stage, depth=1))


def test_a_dump_starts_the_same_monitor_and_is_read_by_replay(
    shared_stage, node, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tree = dumped(shared_stage)
    assert tree["clearance_joints"] == []
    assert tree["encoders"]["names"] == ["knee"]
    tree["limits"]["clearance_m"] = 5.0e-4
    path = written(tree, tmp_path / "dump.yaml")
    monkeypatch.setattr(MonitorNode, "_compile", lambda self, decoder: None)
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--params-file", str(path)], context=context)
    try:
        again = MonitorNode(context=context)
        config = again.monitor.config
        again.close()
        again.destroy_node()
    finally:
        try_shutdown(context=context)
    assert config.limits.clearance_m == 5.0e-4
    assert config.encoders == node.monitor.config.encoders
    assert config == load_config(path)


def test_an_edited_dump_is_loaded_but_for_what_is_read_at_the_start(
    shared_stage, node, tmp_path: Path
) -> None:
    tree = dumped(shared_stage)
    assert not loaded(shared_stage, written(tree, tmp_path / "same.yaml"))
    tree["limits"]["joint_clearance_m"] = [5.0e-4] * 5
    tree["frame_id"] = "hip"
    refused = loaded(shared_stage, written(tree, tmp_path / "edited.yaml"))
    assert list(refused) == ["frame_id"]
    assert "read-only" in refused["frame_id"]
    assert node.monitor.config.limits.joint_clearance_m == (5.0e-4,) * 5
    tree["limits"]["joint_clearance_m"] = []
    del tree["frame_id"]
    assert not loaded(shared_stage, written(tree, tmp_path / "back.yaml"))
    assert node.monitor.config.limits.joint_clearance_m == ()


def test_parameters_are_set_together_or_not_at_all(shared_stage, node) -> None:
    def set_to(**values: Any) -> Any:
        parameters = [
            Parameter(name.replace("__", "."), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
        request = SetParametersAtomically.Request(parameters=parameters)
        return shared_stage.call(SetParametersAtomically, f"{ME}/set_parameters_atomically", request).result

    assert set_to(limits__impact_force_n=9000.0, alarms__deadband=0.1).successful
    assert node.monitor.config.limits.impact_force_n == 9000.0
    refused = set_to(limits__impact_force_n=8000.0, alarms__deadband=7.0)
    assert not refused.successful
    assert "alarms.deadband" in refused.reason
    assert node.monitor.config.limits.impact_force_n == 9000.0


def test_a_type_that_does_not_exist_is_refused_and_the_node_stays(shared_stage, node) -> None:
    def one(name: str, **value: Any) -> ParameterMessage:
        return ParameterMessage(name=name, value=ParameterValue(**value))

    good = one("limits.growth_m_per_hour", type=3, double_value=2.0e-4)
    bad = [one("limits.clearance_m", type=200), one("", type=10), one("x" * 100_000, type=255)]
    request = SetParameters.Request(parameters=[*bad, good])
    results = shared_stage.call(SetParameters, f"{ME}/set_parameters", request).results
    assert [result.successful for result in results] == [False, False, False, True]
    assert results[0].reason == "limits.clearance_m: 200 is no type of a parameter, expected 0 to 9"
    assert len(results[2].reason) < 300
    assert node.monitor.config.limits.growth_m_per_hour == 2.0e-4
    for service in ("set_parameters_atomically", "measure"):
        request = SetParametersAtomically.Request(parameters=[good, *bad])
        result = shared_stage.call(SetParametersAtomically, f"{ME}/{service}", request).result
        assert (result.successful, result.reason) == (False, results[0].reason)


def test_a_time_before_0_on_clock_is_ignored(stage) -> None:
    node = stage.monitor(use_sim_time=True).node
    clock = stage.node.create_publisher(Clock, "/clock", 10)
    stage.wait_for(lambda: clock.get_subscription_count() > 0, "the node's clock")
    for sec in (-5, 7):
        message = Clock()
        message.clock.sec = sec
        clock.publish(message)
    stage.wait_for(lambda: node.get_clock().now().nanoseconds == 7_000_000_000, "the time after it")


def test_descriptors_have_the_bounds_as_ranges_and_any_value_between_is_taken(shared_stage, node) -> None:
    request = DescribeParameters.Request(names=list(PARAMETERS))
    told = shared_stage.call(DescribeParameters, f"{ME}/describe_parameters", request).descriptors
    ranged = 0
    for name, one in zip(PARAMETERS, told, strict=True):
        declared = PARAMETERS[name]
        ranges = [*one.floating_point_range, *one.integer_range]
        bounds = (declared.above, declared.at_least, declared.at_most)
        is_number = declared.type in ("double", "integer")
        assert bool(ranges) is (is_number and any(bound is not None for bound in bounds)), name
        for each in ranges:
            ranged += 1
            assert each.step == 0
            assert each.from_value <= declared.default <= each.to_value
            if declared.at_most is not None:
                assert each.to_value == declared.at_most
            lower = declared.above if declared.at_least is None else declared.at_least
            if lower is not None:
                assert each.from_value == lower
    assert ranged > 40

    def set_to(value: float) -> Any:
        wanted = Parameter("limits.warn_fraction", value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[wanted])
        return shared_stage.call(SetParameters, f"{ME}/set_parameters", request).results[0]

    assert set_to(0.812345678901).successful
    for value in (0.0, 1.5, float("nan")):  # the first is excluded, though in the range
        refused = set_to(value)
        assert not refused.successful
        assert "limits.warn_fraction" in refused.reason and "at most 1" in refused.reason
    assert node.monitor.config.limits.warn_fraction == 0.812345678901


def test_the_clock_is_kept_while_the_node_runs(shared_stage, node) -> None:
    request = SetParameters.Request(parameters=[Parameter("use_sim_time", value=True).to_parameter_msg()])
    (result,) = shared_stage.call(SetParameters, f"{ME}/set_parameters", request).results
    assert not result.successful
    assert result.reason.startswith("use_sim_time: is read only at the start")
    assert node.get_parameter("use_sim_time").value is False
    assert not node.get_clock().ros_time_is_active


@pytest.mark.parametrize("text", ["clearance_joints:=[]", "limits.joint_clearance_m:=[]", "clearances_m:=[]"])
def test_an_empty_list_on_the_command_line_is_an_empty_list(text: str) -> None:
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "-p", text], context=context)
    try:
        node = ClosingNode("leg", context=context)
        assert isinstance(Parameters(node, MonitorConfig).config, MonitorConfig)
        assert node.get_parameter(text.split(":=")[0]).value == []
        node.destroy_node()
    finally:
        try_shutdown(context=context)
