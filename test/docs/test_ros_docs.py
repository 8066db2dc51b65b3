"""Launch files, parameter files and the security policy fit the nodes."""

import re
import time
from collections.abc import Callable
from configparser import ConfigParser
from fnmatch import fnmatchcase
from importlib.util import find_spec
from typing import Any
from xml.etree import ElementTree

import pytest

pytest.importorskip("rclpy")

import rclpy
from made_node import made_node
from rclpy.parameter import Parameter
from rclpy.utilities import try_shutdown
from ruamel.yaml import YAML

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.config.parameters import parse_config, structured
from leg_wear_monitor.monitor.config.tables import FORCES
from leg_wear_monitor.recordings.streams import STREAMS
from leg_wear_monitor.ros import monitor_node
from leg_wear_monitor.ros.gait_publisher import GaitPublisher, PublisherConfig
from leg_wear_monitor.ros.inputs import DEPTH
from leg_wear_monitor.ros.monitor_node import MonitorNode

# Launch files and shipped parameter files fit the nodes.


TAKE_S = monitor_node._TAKE_S  # the nodes of these tests take their messages sooner


def flat(mapping: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key, value in mapping.items():
        values |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return values


def test_the_demo_s_parameters_fit_both_nodes() -> None:
    path = share_directory() / "config" / "demo.yaml"
    document = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    monitor = parse_config(document, path.name, "/demo/leg_wear_monitor")
    leg = structured(PublisherConfig, flat(document["/**/gait_publisher"]["ros__parameters"]), path.name)
    assert monitor.wear_acceleration == leg.wear_acceleration
    assert set(leg.pace.speeds_rpm) == {monitor.cadence.commanded_rpm}
    assert 0.0 < leg.knock.at_s < leg.duration_s


def test_launch_files_start_what_is_installed() -> None:
    package = share_directory()
    setup = ConfigParser()
    setup.read(package / "setup.cfg")
    scripts = setup["options.entry_points"]["console_scripts"].split("\n")
    installed = {line.split("=")[0].strip() for line in scripts if line}
    nodes = [node for path in package.glob("launch/*.xml") for node in ElementTree.parse(path).iter("node")]
    shown, nodes = (
        [node for node in nodes if (node.get("pkg") == "rviz2") is is_rviz] for is_rviz in (True, False)
    )
    assert len(nodes) == 4
    assert {node.get("pkg") for node in nodes} == {"leg_wear_monitor"}
    assert {node.get("exec") for node in nodes} <= installed
    assert len(shown) == 2
    for path in package.glob("launch/*.xml"):
        for group in ElementTree.parse(path).iterfind("group"):
            # a package that is missing aborts a launch, also that of the monitor
            assert group.get("if") == "$(var rviz)"
            (has,) = (one for one in group.iterfind("let") if one.get("name") == "has_rviz2")
            assert '"rviz2" in ament_index_python.get_packages_with_prefixes()' in has.get("value")
            (said,) = group.iterfind("log")
            assert said.get("unless") == "$(var has_rviz2)"
            assert "rviz2 is not installed" in said.get("message")
    for node in shown:
        assert node.get("if") == "$(var has_rviz2)"
        layout = node.get("args").removeprefix("-d $(find-pkg-share leg_wear_monitor)/")
        assert (package / layout).is_file()


def test_every_input_can_be_remapped_by_the_launch_files() -> None:
    """A robot with one broadcaster for both legs, or on ros2_control, could not."""
    topics = {stream.topic for stream in STREAMS}
    one, two = (
        ElementTree.parse(share_directory() / "launch" / f"{name}.launch.xml").getroot()
        for name in ("monitor", "two_legs")
    )
    for node in one.iterfind("node"):
        assert {(each.get("from"), each.get("to")) for each in node.iterfind("remap")} == {
            (topic, f"$(var {topic})") for topic in topics
        }
    for launch, included in ((one, ()), (two, two.findall("include"))):
        declared = {arg.get("name"): arg.get("default") for arg in launch.iterfind("arg")}
        for include in included:
            passed = {arg.get("name"): arg.get("value") for arg in include.iterfind("arg")}
            assert topics < set(passed) < {arg.get("name") for arg in one.iterfind("arg")}
            assert {declared[passed[topic][6:-1]] for topic in topics} == topics


def test_the_parameters_for_tools_prevail_where_rviz_is_asked_for() -> None:
    package = share_directory()
    document = YAML(typ="safe", pure=True).load(
        (package / "config" / "tools.yaml").read_text(encoding="utf-8")
    )
    config = parse_config(document, "tools.yaml", "/left/leg_wear_monitor")
    assert config.publish_markers
    for name in ("monitor", "demo"):
        launch = ElementTree.parse(package / "launch" / f"{name}.launch.xml").getroot()
        values = {next(iter(one.items())): one.get("value") for one in launch.iterfind("let")}
        assert values == {
            ("if", "$(var rviz)"): "$(find-pkg-share leg_wear_monitor)/config/tools.yaml",
            ("unless", "$(var rviz)"): "$(var params_file)",
        }
        for node in launch.iter("node"):
            if node.get("exec") == "monitor":
                files = [one.get("from") for one in node.iter("param") if one.get("from")]
                assert files == ["$(var params_file)", "$(var shown)"]


def test_the_pages_have_the_numbers_and_units_of_the_code() -> None:
    docs = share_directory() / "docs"
    reference = (docs / "reference" / "ros.md").read_text(encoding="utf-8")
    tables = (docs / "howto" / "csv.md").read_text(encoding="utf-8")
    numbers = {"depth": DEPTH, "at most": monitor_node._AT_ONCE, "At": monitor_node._HELD}
    for words, number in numbers.items():
        assert f"{words} {number:,}".replace(",", " ") in reference
    assert f"{1.0 / TAKE_S:g} times per second the node takes" in reference
    assert f"`table.units.foot_load` is {' or '.join(f'`{unit}`' for unit in FORCES)}" in tables


# security/policy.xml allows what the live nodes do, and nothing else.


pytest.importorskip("rclpy")


PATIENCE_S = 60.0

POLICY = ElementTree.parse(share_directory() / "security" / "policy.xml").getroot()


def allowed(node: str, kind: str, right: str, policy: ElementTree.Element = POLICY) -> set[str]:
    """Full names, patterns among them, of what a node in the root may publish, subscribe or reply to."""
    (profile,) = policy.iterfind(f".//profile[@node='{node}']")
    assert profile.get("ns") == "/"
    rules = profile.iterfind(f"{kind}s[@{right}='ALLOW']/{kind}")
    return {"/" + rule.text.replace("~", node).lstrip("/") for rule in rules}


@pytest.mark.parametrize(
    ("make", "own", "idle"),
    [
        (MonitorNode, {"foot_load__source": "wrench"}, "dynamic_joint_states"),
        pytest.param(
            MonitorNode,
            {"foot_load__source": "wrench", "drive_torque__source": "interface"},
            "drive_torque",
            marks=pytest.mark.skipif(not find_spec("control_msgs"), reason="control_msgs is not installed"),
        ),
        (GaitPublisher, {"foot_load_sensor__source": "wrench"}, ""),
    ],
)
def test_a_node_may_do_what_it_does_and_nothing_else(
    make: Callable[..., Any], own: dict[str, Any], idle: str
) -> None:
    """Idle is the input of the torque that another source than the node's reads."""
    with made_node(make=make, use_sim_time=True, clearance_joints=["G"], **own) as node:
        name = node.get_name()
        agrees(node.get_publisher_names_and_types_by_node, name, allowed(name, "topic", "publish"))
        inputs = allowed(name, "topic", "subscribe") - {f"/{idle}"}
        agrees(node.get_subscriber_names_and_types_by_node, name, inputs)
        agrees(node.get_service_names_and_types_by_node, name, allowed(name, "service", "reply"))
        agrees(node.get_client_names_and_types_by_node, name, allowed(name, "service", "request"))


def test_an_operator_may_do_what_its_program_does_and_nothing_else() -> None:
    """The policy of docs/howto/sros2.md against the program there."""
    pages = share_directory() / "docs" / "howto"
    page = (pages / "sros2.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"(<policy.*?</policy>)", page, re.DOTALL)
    policy = ElementTree.fromstring(text)
    assert 'create_node("operator")' in page
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    try:
        node = rclpy.create_node(
            "operator", context=context, parameter_overrides=[Parameter("use_sim_time", value=True)]
        )
        rights = {
            "topic": {
                "publish": node.get_publisher_names_and_types_by_node,
                "subscribe": node.get_subscriber_names_and_types_by_node,
            },
            "service": {"reply": node.get_service_names_and_types_by_node},
        }
        for kind, graphs in rights.items():
            for right, graph in graphs.items():
                agrees(graph, "operator", allowed("operator", kind, right, policy))
        assert allowed("operator", "service", "request", policy) == {
            name.replace("~", "leg_wear_monitor")
            for name in allowed("leg_wear_monitor", "service", "reply")
            if "param" not in name and "type_description" not in name
        }
        node.destroy_node()
    finally:
        try_shutdown(context=context)


def agrees(graph: Callable[[str, str], list[tuple[str, list[str]]]], node: str, rules: set[str]) -> None:
    def there() -> set[str]:
        return {name for name, _ in graph(node, "/")}

    def unused() -> set[str]:
        return {rule for rule in rules if not any(fnmatchcase(name, rule) for name in there())}

    # a node sees itself in the graph a little after it was made
    given_up = time.monotonic() + PATIENCE_S
    while unused() and time.monotonic() < given_up:
        time.sleep(0.01)
    assert unused() == set()
    assert {name for name in there() if not any(fnmatchcase(name, rule) for rule in rules)} == set()


def test_the_policy_says_nothing_that_is_not_compared() -> None:
    """As in sros2's schema: rules of topics and services, and each right an ALLOW."""
    assert POLICY.get("version") == "0.2.0"
    rights = {"topics": {"publish", "subscribe"}, "services": {"reply"}}
    for rule in POLICY.iterfind(".//profile/*"):
        assert set(rule.attrib) <= rights[rule.tag]
        assert set(rule.attrib.values()) == {"ALLOW"}
