"""Names in a message, for reports on what is not in it."""

import struct
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import printable
from leg_wear_monitor.messages.cdr import ENCAPSULATION
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, Samples

_MOST_NAMED = 20


def names_in(raw: bytes) -> list[str]:
    """Joint names in a sensor_msgs/JointState message that has been decoded successfully."""
    return _texts(raw, *_after_header(raw))[0]


def interfaces_in(raw: bytes) -> dict[str, list[str]]:
    """Interfaces of each joint in a control_msgs/DynamicJointState message, decoded successfully."""
    at, order = _after_header(raw)
    joints, at = _texts(raw, at, order)
    _, at = _count(raw, at, order)
    found: dict[str, list[str]] = {}
    for joint in joints:
        names, at = _texts(raw, at, order)
        found.setdefault(joint, names)
        number, at = _count(raw, at, order)
        at += (ENCAPSULATION - at) % 8 + 8 * number if number else 0
    return found


def wanted_interfaces(config: MonitorConfig) -> dict[str, str]:
    """Interfaces of the crank that are read, by the parameters that name them; empty names are not wanted."""
    return {
        "drive_torque.interface": config.drive_torque.interface,
        "drive.temperature_interface": config.drive.temperature_interface,
    }


def twice(names: Sequence[str], joint: str) -> str:
    """That a name is there several times, and at which places; empty if it is there at most once."""
    places = [str(i + 1) for i, name in enumerate(names) if name == joint]
    if len(places) < 2:
        return ""
    return f"joints {' and '.join(places)} of joint_states are both named {joint!r}: rename one of them"


def is_without(samples: Samples, interfaces: Mapping[str, str]) -> NDArray[np.bool_]:
    """Which samples (n,) of control_msgs/DynamicJointState messages lack a wanted interface."""
    absent = samples["fault"] == MISSING_JOINT
    if interfaces["drive.temperature_interface"]:
        absent |= (samples["fault"] == NO_FAULT) & np.isnan(samples["temperature_c"])
    return np.asarray(absent)


def without_interface(raw: bytes, joint: str, interfaces: Mapping[str, str]) -> str:
    """Report on a control_msgs/DynamicJointState message, decoded successfully, that lacks an interface.

    Parameters
    ----------
    raw : bytes
    joint : str
    interfaces : mapping of str to str
        Wanted interfaces by the parameters that name them; an empty one is not wanted.
    """
    there = interfaces_in(raw)
    if joint not in there:
        return f"no joint is named {joint!r}; there are {_listed(list(there))}"
    absent = {key: name for key, name in interfaces.items() if name and name not in there[joint]}
    if not absent:
        return f"{joint} has no value of {' or '.join(filter(None, interfaces.values()))} yet"
    names, keys = " and ".join(map(repr, absent.values())), " and ".join(absent)
    return f"{joint} has no interface {names}, it has {_listed(there[joint])}; set {keys}"


def _listed(names: list[str]) -> str:
    shown = ", ".join(printable(name, 100) for name in sorted(set(names))[:_MOST_NAMED]) or "none"
    return f"{shown} and more" if len(set(names)) > _MOST_NAMED else shown


def _after_header(raw: bytes) -> tuple[int, str]:
    """Position behind a message's std_msgs/Header, and its byte order."""
    order = "<" if raw[1] else ">"
    return _text(raw, ENCAPSULATION + 8, order)[1], order


def _texts(raw: bytes, at: int, order: str) -> tuple[list[str], int]:
    count, at = _count(raw, at, order)
    found = []
    for _ in range(count):
        content, at = _text(raw, at, order)
        found.append(content.rstrip(b"\0").decode("utf-8", "replace"))
    return found, at


def _count(raw: bytes, at: int, order: str) -> tuple[int, int]:
    at += -at % 4
    return struct.unpack_from(f"{order}I", raw, at)[0], at + 4


def _text(raw: bytes, at: int, order: str) -> tuple[bytes, int]:
    size, at = _count(raw, at, order)
    return raw[at : at + size], at + size
