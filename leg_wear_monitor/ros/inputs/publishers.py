"""Who publishes an input: nodes by their names, those of another type, several of one crank."""

from collections.abc import Iterable

import attrs
from rclpy.node import Node

_UNKNOWN = ("", "_NODE_NAME_UNKNOWN_", "_CREATED_BY_BARE_DDS_APP_")


@attrs.frozen
class Publishers:
    """Publishers of a topic as the graph has them.

    Attributes
    ----------
    fitting : tuple of str
        Full names of the nodes whose messages are of the expected type.
    other : tuple of (str, str)
        Full names of the others, and their types.
    """

    fitting: tuple[str, ...] = ()
    other: tuple[tuple[str, str], ...] = ()


def publishers_of(node: Node, topic: str, expected: str) -> Publishers:
    """Publishers of a topic; the middleware's event of another type comes from few of them.

    Parameters
    ----------
    node : rclpy.node.Node
    topic : str
        Full name.
    expected : str
        Type, such as ``sensor_msgs/msg/JointState``.
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
    """What is wrong with publishers of another type; empty if nothing is."""
    told = _listed(f"{name} publishes {kind}" for name, kind in publishers.other)
    return f"{told}, expected {expected}; nothing comes from it" if told else ""


def several(publishers: Publishers) -> str:
    """That there are several publishers; empty if there are not."""
    number = len(publishers.fitting)
    return f"{number} publishers: {_listed(publishers.fitting)}" if number > 1 else ""


def _listed(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))
