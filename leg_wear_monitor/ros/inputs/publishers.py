"""Publishers of an input: node names, publishers of another type, several publishers of one crank."""

from collections.abc import Iterable

import attrs
from rclpy.node import Node

_UNKNOWN = ("", "_NODE_NAME_UNKNOWN_", "_CREATED_BY_BARE_DDS_APP_")


@attrs.frozen
class Publishers:
    """Publishers of a topic according to the ROS graph.

    Attributes
    ----------
    fitting : tuple of str
        Full names of the nodes that publish the expected type.
    other : tuple of (str, str)
        Full names of the other nodes, and their message types.
    """

    fitting: tuple[str, ...] = ()
    other: tuple[tuple[str, str], ...] = ()


def publishers_of(node: Node, topic: str, expected: str) -> Publishers:
    """Publishers of a topic, from the graph: few middlewares raise an event for an incompatible type.

    Parameters
    ----------
    node : rclpy.node.Node
    topic : str
        Full name of the topic.
    expected : str
        Expected type, such as ``sensor_msgs/msg/JointState``.
    """
    found = [(_full_name(one), one.topic_type) for one in node.get_publishers_info_by_topic(topic)]
    return Publishers(
        tuple(sorted(name for name, kind in found if kind == expected)),
        tuple(sorted((name, kind) for name, kind in found if kind != expected)),
    )


def _full_name(info: object) -> str:
    name, space = getattr(info, "node_name", ""), getattr(info, "node_namespace", "")
    return "a publisher without a node" if name in _UNKNOWN else f"{space.rstrip('/')}/{name}"


def misfit(publishers: Publishers, expected: str) -> str:
    """Fault text for publishers of another type; empty if there are none."""
    listed = _listed(f"{name} publishes {kind}" for name, kind in publishers.other)
    return f"{listed}, expected {expected}; no message arrives from it" if listed else ""


def several(publishers: Publishers) -> str:
    """Fault text for several publishers; empty if there is at most one."""
    number = len(publishers.fitting)
    return f"{number} publishers: {_listed(publishers.fitting)}" if number > 1 else ""


def _listed(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))
