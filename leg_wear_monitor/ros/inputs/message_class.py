"""Message classes by the names of their types."""

from importlib import import_module
from typing import Any


def message_class(name: str) -> Any:
    """Class of a message type such as ``sensor_msgs/msg/JointState``."""
    package, _, message = name.split("/")
    return getattr(import_module(f"{package}.msg"), message)
