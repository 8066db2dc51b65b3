"""Messages of ros2_control as bytes, as the library encodes them."""

from collections.abc import Mapping

import numpy as np

from leg_wear_monitor.recordings.streams import types

DYNAMIC_JOINT_STATE = "control_msgs/msg/DynamicJointState"


def dynamic_joint_state(stamp_ns: int, interfaces: Mapping[str, Mapping[str, float]]) -> bytes:
    """A message with these values by joint and interface, as the library encodes it."""
    store = types()
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    values = [
        kinds["control_msgs/msg/InterfaceValue"](list(one), np.array([*one.values()], float))
        for one in interfaces.values()
    ]
    header = kinds["std_msgs/msg/Header"](stamp, "")
    message = kinds[DYNAMIC_JOINT_STATE](header, list(interfaces), values)
    return bytes(store.serialize_cdr(message, DYNAMIC_JOINT_STATE))
