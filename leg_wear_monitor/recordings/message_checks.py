"""Checks of messages for reports: missing names, and the axis of a torque."""

import struct
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.cdr import ENCAPSULATION
from leg_wear_monitor.recordings.findings import listed
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, Samples


class _Fields:
    """Reads the fields of a message in order, from the frame of its header on."""

    def __init__(self, raw: bytes) -> None:
        self._raw, self._at = raw, ENCAPSULATION + 8
        self.text()

    def count(self) -> int:
        self._at += -self._at % 4 + 4
        return int(struct.unpack_from("<I", self._raw, self._at - 4)[0])

    def text(self) -> str:
        size = self.count()
        self._at += size
        return self._raw[self._at - size : self._at].rstrip(b"\0").decode("utf-8", "replace")

    def texts(self) -> list[str]:
        return [self.text() for _ in range(self.count())]

    def skip_numbers(self) -> None:
        if number := self.count():
            self._at += (ENCAPSULATION - self._at) % 8 + 8 * number


def names_in(raw: bytes) -> list[str]:
    """Joint names in a sensor_msgs/JointState message that has been decoded successfully."""
    return _Fields(raw).texts()


def interfaces_in(raw: bytes) -> dict[str, list[str]]:
    """Interfaces of each joint in a control_msgs/DynamicJointState message, decoded successfully."""
    fields, found = _Fields(raw), dict[str, list[str]]()
    joints = fields.texts()
    fields.count()
    for joint in joints:
        found.setdefault(joint, fields.texts())
        fields.skip_numbers()
    return found


def wanted_interfaces(config: MonitorConfig) -> dict[str, str]:
    """Interfaces of the crank to read, by the parameters that name them; empty names are not read."""
    return {
        "drive_torque.interface": config.drive_torque.interface,
        "drive.temperature_interface": config.drive.temperature_interface,
    }


def twice(names: Sequence[str], joint: str) -> str:
    """Report that a name occurs several times, and at which places; empty if it occurs at most once."""
    places = [str(i + 1) for i, name in enumerate(names) if name == joint]
    if len(places) < 2:
        return ""
    return f"joints {' and '.join(places)} of joint_states are both named {joint!r}: rename one of them"


def is_without(samples: Samples, interfaces: Mapping[str, str]) -> NDArray[np.bool_]:
    """Mask (n,) of the samples of control_msgs/DynamicJointState that lack a wanted interface."""
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
        Interfaces to read, by the parameters that name them; an empty name is not read.
    """
    there = interfaces_in(raw)
    if joint not in there:
        return f"no joint is named {joint!r}; the joints are {listed(sorted(there))}"
    absent = {key: name for key, name in interfaces.items() if name and name not in there[joint]}
    if not absent:
        return f"{joint} has no value of {' or '.join(filter(None, interfaces.values()))} yet"
    names, keys = " and ".join(map(repr, absent.values())), " and ".join(absent)
    return f"{joint} has no interface {names}. It has {listed(sorted(there[joint]))}; set {keys}"


# Check that the drive torque is about the configured axis; otherwise report the axis that has a torque.


_AXES = "xyz"
_TORQUE = struct.Struct("<3d")  # the end of a wrench
_KEPT = 400
_LEAST = 40
_SWINGS = 0.3  # RMS of a drive's torque, as a fraction of the predicted one
_STILL = 0.02  # Largest RMS of noise and crosstalk between a sensor's axes, as a fraction


class WrenchAxis:
    """Compares the three torques of wrenches.

    Parameters
    ----------
    axis : str
        Axis that is read, ``x``, ``y`` or ``z``.
    predicted_nm : float, optional
        RMS of the predicted torque at the sensor.
    """

    def __init__(self, axis: str, predicted_nm: float = 0.0) -> None:
        self._axis, self._predicted_nm = _AXES.index(axis), predicted_nm
        self._torques: list[tuple[float, float, float]] = []

    def add(self, wrenches: Iterable[bytes]) -> None:
        """Add sound messages of geometry_msgs/WrenchStamped."""
        for raw in wrenches:
            self._torques.append(_TORQUE.unpack_from(raw, len(raw) - _TORQUE.size))
        del self._torques[:-_KEPT]

    def report(self) -> str:
        """Report that a different axis carries the torque; empty if the configured axis carries it."""
        if len(self._torques) < _LEAST:
            return ""
        with np.errstate(over="ignore", invalid="ignore"):  # a torque may be any finite number
            rms = np.nan_to_num(np.std(self._torques, axis=0))
        largest = int(np.argmax(rms))
        is_still = rms[largest] <= _SWINGS * self._predicted_nm
        if is_still or rms[self._axis] > _STILL * rms[largest]:
            return ""
        # without values, because each change of a message adds a line to the log
        return (
            f"the torque about {_AXES[self._axis]} does not change, but about {_AXES[largest]} it does; "
            f"if this is the drive torque, set drive_torque.axis to {_AXES[largest]}"
        )
