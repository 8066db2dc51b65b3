"""Parameters as ros2 param and rqt_reconfigure ask for them: listed, dumped, edited, loaded, refused."""

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import yaml
from made_node import made_node
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
from rosgraph_msgs.msg import Clock

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.parameters import PARAMETERS, load_config
from leg_wear_monitor.ros.gait_publisher import GaitPublisher
from leg_wear_monitor.ros.monitor_node import MonitorNode

ME = "/leg_wear_monitor"
QOS = "qos_overrides./joint_states.subscription"
LEG = "qos_overrides./joint_states.publisher"
OUT = f"qos_overrides.{ME}/verdict.publisher"


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


def set_to(stage, name: str, value: object) -> Any:
    """Result of setting one parameter."""
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    (result,) = stage.call(SetParameters, f"{ME}/set_parameters", request).results
    return result


def described(stage) -> list[Any]:
    request = DescribeParameters.Request(names=list(PARAMETERS))
    return stage.call(DescribeParameters, f"{ME}/describe_parameters", request).descriptors


def test_every_parameter_is_listed_and_has_a_value_of_its_type(shared_stage, node) -> None:
    assert set(PARAMETERS) <= set(names_of(shared_stage))
    names = list(PARAMETERS)
    request = GetParameters.Request(names=names)
    values = shared_stage.call(GetParameters, f"{ME}/get_parameters", request).values
    request = GetParameterTypes.Request(names=names)
    types = shared_stage.call(GetParameterTypes, f"{ME}/get_parameter_types", request).types
    kinds = [Parameter.Type[PARAMETERS[name].type.upper()].value for name in names]
    assert [value.type for value in values] == kinds == list(types)
    assert [one.type for one in described(shared_stage)] == kinds


def test_sections_are_listed_by_prefix_and_depth(shared_stage, node) -> None:
    limits = [name for name in PARAMETERS if name.startswith("limits.")]
    assert sorted(names_of(shared_stage, ("limits",))) == sorted(limits)
    assert "mechanism" in names_of(shared_stage, depth=1)
    assert not set(limits) & set(names_of(shared_stage, depth=1))


def test_a_dump_starts_the_same_monitor_and_is_read_by_replay(shared_stage, node, tmp_path: Path) -> None:
    tree = dumped(shared_stage)
    assert tree["clearance_joints"] == []
    assert tree["encoders"]["names"] == ["knee"]
    tree["limits"]["clearance_m"] = 5.0e-4
    path = written(tree, tmp_path / "dump.yaml")
    with made_node("--params-file", str(path)) as again:
        config = again.monitor.config
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
    def set_both(**values: Any) -> Any:
        parameters = [
            Parameter(name.replace("__", "."), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
        request = SetParametersAtomically.Request(parameters=parameters)
        return shared_stage.call(SetParametersAtomically, f"{ME}/set_parameters_atomically", request).result

    assert set_both(limits__impact_force_n=9000.0, alarms__deadband=0.1).successful
    assert node.monitor.config.limits.impact_force_n == 9000.0
    refused = set_both(limits__impact_force_n=8000.0, alarms__deadband=7.0)
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


def test_descriptors_tell_what_a_parameter_is_and_between_which_bounds(shared_stage, node) -> None:
    ranged = 0
    for (name, declared), one in zip(PARAMETERS.items(), described(shared_stage), strict=True):
        assert one.description.startswith(declared.description)
        assert (one.read_only, one.additional_constraints) == (declared.read_only, declared.bounds)
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


def test_any_value_between_the_bounds_is_taken(shared_stage, node) -> None:
    assert set_to(shared_stage, "limits.warn_fraction", 0.812345678901).successful
    assert node.monitor.config.limits.warn_fraction == 0.812345678901
    assert node.get_parameter("limits.warn_fraction").value == 0.812345678901


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
        ("limits.warn_fraction", 0.0, "at most 1"),  # excluded, though in the range
        ("hardware_id", "other", "read-only"),
        ("limits.clearence_m", 0.001, "declared"),
        ("limits.joint_clearance_m", [0.001], "has 1 values, expected one each for A, B, G, I, J"),
        ("use_sim_time", True, "use_sim_time: is read only at the start"),
    ],
)
def test_a_change_that_cannot_be_is_refused_in_a_line(shared_stage, node, name, value, reason) -> None:
    before = node.monitor.config
    result = set_to(shared_stage, name, value)
    assert not result.successful
    assert reason in result.reason
    assert "\n" not in result.reason
    assert node.monitor.config == before
    assert not node.get_clock().ros_time_is_active


def test_an_empty_list_on_the_command_line_is_an_empty_list() -> None:
    names = ("clearance_joints", "limits.joint_clearance_m", "clearances_m")
    with made_node(*(word for name in names for word in ("-p", f"{name}:=[]"))) as node:
        assert [node.get_parameter(name).value for name in names] == [[], [], []]


def test_a_quality_of_service_of_no_topic_is_named_with_the_one_that_may_be_meant() -> None:
    """In a namespace, or of a topic that is remapped, the name in the documents was ignored."""
    ours, meant = f"/left{ME}/verdict.publisher.depth", "/left/joint_states.subscription.reliability"
    given = {f"{QOS}.reliability": "reliable", f"qos_overrides.{ours}": 7}
    with made_node(namespace="left", clearance_joints=["G"], **given) as node:
        assert node.unused_qos == (f"{QOS}.reliability; did you mean qos_overrides.{meant}?",)


@pytest.mark.parametrize(
    ("node", "parameters", "line"),
    [
        (MonitorNode, {"limits.clearance_m": 7.0}, "limits.clearance_m: 7.0 is not at most 0.1 m"),
        (MonitorNode, {"limits.clearance_m": 1}, "is a whole number to ROS, expected 1.0 [m]"),
        (MonitorNode, {"limit.clearance_m": 1.0}, "unknown parameter, did you mean limits.clearance_m?"),
        (MonitorNode, {"mechanism": "no_leg"}, "no_leg: no mechanism of this name"),
        (MonitorNode, {"record.path": "/no/such/place.mcap"}, "/no/such/place.mcap: cannot be written"),
        (MonitorNode, {"ledger.path": "/no/such/place.db"}, "/no/such/place.db: cannot be created"),
        (MonitorNode, {"use_sim_times": True}, "use_sim_times: unknown parameter"),
        (MonitorNode, {"use_sim_time": "maybe"}, "/leg_wear_monitor: Trying to set parameter 'use_sim_time'"),
        (MonitorNode, {"use_sim_time": True, "drive_torque.source": "float64"},
         "drive_torque.source: the messages of float64 have no stamp, which use_sim_time needs, expected w"),
        (MonitorNode, {"use_sim_time": True, "foot_load.source": "contact"},
         "foot_load.source: the messages of contact have no stamp, which use_sim_time needs, expected wre"),
        (GaitPublisher, {"start_type_description_service": 7}, "expecting type 'BOOL'"),
        (MonitorNode, {f"{QOS}.reliability": "best"}, f"{QOS}.reliability: best cannot be used: "),
        (MonitorNode, {f"{QOS}.reliability": 7}, f"{QOS}.reliability: 7 cannot be used: "),
        (MonitorNode, {f"{QOS}.depth": -1}, f"{QOS}.depth: -1 is not from 0 to 2147483647 messages"),
        (MonitorNode, {f"{OUT}.depth": 2**31}, f"{OUT}.depth: 2147483648 is not from 0 to 2147483647"),
        (GaitPublisher, {f"{LEG}.history": "all"}, f"{LEG}.history: all cannot be used: "),
        (GaitPublisher, {"pace.ripple": 1.0}, "pace.ripple: 1.0 is not at most 0.9"),
        (GaitPublisher, {"precompute": True}, "precompute: needs a duration_s above 0 s"),
    ],
)  # fmt: skip
def test_a_node_with_a_bad_parameter_does_not_start(node, parameters, line) -> None:
    with pytest.raises(LegWearError) as refused, made_node(make=node, **parameters):
        pass
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
