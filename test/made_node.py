"""A node that is made and taken down, and not served: what it does of itself."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.utilities import try_shutdown

from leg_wear_monitor.ros.monitor_node import MonitorNode


@contextmanager
def made_node(
    *arguments: str, make: Callable[..., Any] = MonitorNode, namespace: str = "", **parameters: Any
) -> Iterator[Any]:
    """A node in a context of its own, by arguments of ROS, and parameters with dots written as ``__``."""
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--log-level", "fatal", *arguments], context=context)
    overrides = [Parameter(name.replace("__", "."), value=value) for name, value in parameters.items()]
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(MonitorNode, "_compile", lambda self, decoder: None)
            node = make(context=context, namespace=namespace, parameter_overrides=overrides)
        yield node
        node.close()
        node.destroy_node()
    finally:
        try_shutdown(context=context)
