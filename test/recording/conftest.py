"""Messages made by the libraries that ours is held against."""

from collections.abc import Callable
from typing import Any

import pytest

from leg_wear_monitor.recording.cdr import TYPES

rosbags_types = pytest.importorskip("rosbags.typesys")


@pytest.fixture(scope="session")
def store() -> Any:
    """Types of ROS 2 Jazzy, as rosbags knows them."""
    return rosbags_types.get_typestore(rosbags_types.Stores.ROS2_JAZZY)


@pytest.fixture(scope="session")
def joint_state(store: Any) -> Callable[..., Any]:
    """Make a sensor_msgs/JointState of rosbags."""
    import numpy as np

    types = store.types

    def make(
        name: list[str],
        position: Any = (),
        velocity: Any = (),
        effort: Any = (),
        stamp_ns: int = 1,
        frame: str = "",
    ) -> Any:
        stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        head = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
        values = [np.asarray(numbers, float) for numbers in (position, velocity, effort)]
        return types["sensor_msgs/msg/JointState"](head, name, *values)

    return make


@pytest.fixture(scope="session")
def wrench(store: Any) -> Callable[..., Any]:
    """Make a geometry_msgs/WrenchStamped of rosbags."""
    types = store.types

    def make(force: Any, torque: Any, stamp_ns: int = 1, frame: str = "") -> Any:
        stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        vector = types["geometry_msgs/msg/Vector3"]
        body = types["geometry_msgs/msg/Wrench"](vector(*force), vector(*torque))
        return types["geometry_msgs/msg/WrenchStamped"](types["std_msgs/msg/Header"](stamp, frame), body)

    return make


@pytest.fixture(scope="session")
def foreign(store: Any) -> Callable[[str, bytes], Any]:
    """Read a message with mcap-ros2-support."""
    decoder = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()
    schema = pytest.importorskip("mcap.records").Schema

    def read(name: str, raw: bytes) -> Any:
        text, _ = store.generate_msgdef(name, ros_version=2)
        return decoder.decoder_for("cdr", schema(TYPES[name], text.encode(), "ros2msg", name))(raw)

    return read
