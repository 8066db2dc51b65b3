"""security/policy.xml allows what the live nodes do, and nothing else."""

import re
import time
from collections.abc import Callable
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

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.ros.gait_publisher import GaitPublisher
from leg_wear_monitor.ros.monitor_node import MonitorNode

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
        (MonitorNode, {"publish_scalars": True, "foot_load__source": "wrench"}, "dynamic_joint_states"),
        pytest.param(
            MonitorNode,
            {"publish_scalars": True, "foot_load__source": "wrench", "drive_torque__source": "interface"},
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
