"""Checks of messages for reports: missing names, and the axis of a torque."""

import struct
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.cdr import ENCAPSULATION
from leg_wear_monitor.recordings.findings import listed
from leg_wear_monitor.recordings.streams import INTERFACES, JOINT_STATE, WRENCH_STAMPED
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, NOT_FINITE, ZERO_STAMP, Samples


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


def twice(names: Sequence[str], joint: str) -> str:
    """Report that a name occurs several times, and at which places; empty if it occurs at most once."""
    places = [str(i + 1) for i, name in enumerate(names) if name == joint]
    if len(places) < 2:
        return ""
    return f"joints {' and '.join(places)} of joint_states are both named {joint!r}: rename one of them"


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


# Checks of all messages, in a recording or live: the crank's name, its interfaces, the axis of its torque.


_AXES = "xyz"
_TORQUE = struct.Struct("<3d")  # the end of a wrench
_KEPT = 400
_LEAST = 40
_SWINGS = 0.3  # RMS of a drive's torque, as a fraction of the predicted one
_STILL = 0.02  # Largest RMS of noise and crosstalk between a sensor's axes, as a fraction
_WITH_CRANK = (NO_FAULT, NOT_FINITE, ZERO_STAMP)  # faults of messages that have the crank
_NAMED = 5  # messages without the crank whose joint names are read, per block


class MessageChecks:
    """Searches messages for the crank joint, its interfaces, and a torque about the configured axis.

    Several nodes may publish joints of one robot on one topic, so messages without the crank are a fault only
    if no message has it.

    Parameters
    ----------
    config : MonitorConfig
    predicted_nm : float
        RMS of the predicted torque at the sensor; 0 if it is not known.
    compared : int
        Most wrenches of a block that are compared, to limit the cost.

    Attributes
    ----------
    found, missing : int
        Numbers of joint states with the crank and without it.
    lacking : int
        Number of messages that lack an interface.
    """

    def __init__(self, config: MonitorConfig, predicted_nm: float = 0.0, compared: int = 100) -> None:
        self._crank, self._predicted_nm, self._compared = config.crank_joint, predicted_nm, compared
        self._interfaces = {
            "drive_torque.interface": config.drive_torque.interface,
            "drive.temperature_interface": config.drive.temperature_interface,
        }
        self._axis = _AXES.index(config.drive_torque.axis)
        self._torques: list[tuple[float, float, float]] = []
        self.forget_names()

    def forget_names(self) -> None:
        """Begin a new period of the checks of names."""
        self.found, self.missing, self.lacking = 0, 0, 0
        self._names: set[str] = set()
        self._again, self._lack = "", ""

    def add(self, codes: NDArray[np.int64], samples: Samples, raw: Callable[[int], bytes]) -> None:
        """Add messages: codes of their streams (n,), their samples, and a function that gives their bytes."""
        is_good = samples["fault"] == NO_FAULT
        is_joint_state, is_missing = codes == JOINT_STATE, samples["fault"] == MISSING_JOINT
        self.found += int(np.count_nonzero(is_joint_state & np.isin(samples["fault"], _WITH_CRANK)))
        missing = np.flatnonzero(is_joint_state & is_missing).tolist()
        self.missing += len(missing)
        for i in missing[-_NAMED:]:
            names = names_in(raw(i))
            self._names |= set(names)
            self._again = self._again or twice(names, self._crank)
        if self._interfaces["drive.temperature_interface"]:
            is_missing |= is_good & np.isnan(samples["temperature_c"])
        lacking = np.flatnonzero((codes == INTERFACES) & is_missing).tolist()
        self.lacking += len(lacking)
        if lacking and not self._lack:
            self._lack = without_interface(raw(lacking[0]), self._crank, self._interfaces)
        wrenches = np.flatnonzero(is_good & (codes == WRENCH_STAMPED))
        for i in wrenches[:: max(1, len(wrenches) // self._compared)].tolist():
            wrench = raw(i)
            self._torques.append(_TORQUE.unpack_from(wrench, len(wrench) - _TORQUE.size))
        del self._torques[:-_KEPT]

    @property
    def crank_fault(self) -> str:
        """Why the crank is not read; empty if a message has it, or none came."""
        if self._again or self.found or not self.missing:
            return self._again
        there = listed(sorted(self._names))
        return f"no joint is named {self._crank!r}; the joints are {there}; set crank_joint (--crank-joint)"

    @property
    def interface_fault(self) -> str:
        """Which interface a message lacks, and those that exist; empty if none is missing."""
        return self._lack

    @property
    def axis_fault(self) -> str:
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
