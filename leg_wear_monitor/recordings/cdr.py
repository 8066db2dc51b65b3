"""Messages as they lie in a bag: CDR (XCDR1, little endian) of the input types, read in place.

A message is four bytes of encapsulation and a body; members are aligned relative to the start of the body
(OMG DDS-XTypes 1.3, section 7.4.3). Positions are indices into one array of bytes that holds many messages.
Position -1 marks the end of a message that cannot be read.
"""

import math

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.streams import CONTACT as CONTACT_SWITCH
from leg_wear_monitor.recordings.streams import (
    FLOAT64,
    INTERFACES,
    JOINT_STATE,
    LOAD_FLOAT64,
    LOAD_WRENCH,
    STREAMS,
    WRENCH_STAMPED,
)
from leg_wear_monitor.twin.sample import (
    CONTACT,
    EMPTY,
    GAIT_SAMPLE,
    MISSING_JOINT,
    NO_FAULT,
    NOT_FINITE,
    UNDECODABLE,
    WRONG_LENGTH,
    ZERO_STAMP,
    Samples,
)

MESSAGE = np.dtype([(name, "i8") for name in ("begin", "end", "log_time_ns", "type")])
"""One message among bytes: from where to where, when it was recorded, and its stream's code."""

_KIND = np.full(1 + max(stream.code for stream in STREAMS), -1)
_KIND[[stream.code for stream in STREAMS]] = [stream.kind for stream in STREAMS]
"""Kinds of samples by the codes of streams."""

ENCAPSULATION = 4
# Bytes that may follow a message: up to 3 where a middleware fills up to a multiple of four, and 4 more for
# each empty sequence of numbers, because rclpy's serialize_message reserves room to align absent numbers.
_MOST_PADDING = 15


@kernel
def uint32(data, at):
    """Integer of four bytes."""
    value = np.int64(0)
    for i in range(4):
        value |= np.int64(data[at + i]) << (8 * i)
    return value


@kernel
def float64(data, at):
    """Number of eight bytes."""
    bits = np.uint64(0)
    for i in range(8):
        bits |= np.uint64(data[at + i]) << np.uint64(8 * i)
    return np.uint64(bits).view(np.float64)


@kernel
def aligned(at, size, origin):
    """Next position whose distance from the start of the body is a multiple of a size."""
    return at + (origin - at) % size


@kernel
def counted(data, at, end, origin):
    """Length that stands before a text or a sequence, and the position behind it."""
    if at < 0:
        return np.int64(0), np.int64(-1)
    at = aligned(at, 4, origin)
    if at + 4 > end:
        return np.int64(0), np.int64(-1)
    return uint32(data, at), np.int64(at + 4)


@kernel
def text(data, at, end, origin):
    """Length of a text without its closing zero, its first byte, and the position behind it."""
    size, at = counted(data, at, end, origin)
    if at < 0 or size > end - at:
        return np.int64(0), np.int64(-1), np.int64(-1)
    return max(size - 1, np.int64(0)), at, at + size


@kernel
def numbers(data, at, end, origin):
    """Length of a sequence of float64, its first byte, and the position behind it."""
    count, at = counted(data, at, end, origin)
    if at < 0 or count == 0:
        return np.int64(0), at, at
    at = aligned(at, 8, origin)
    if count > (end - at) // 8:
        return np.int64(0), np.int64(-1), np.int64(-1)
    return count, at, at + 8 * count


@kernel
def header(data, origin, end):
    """Stamp of a std_msgs/Header [ns], and the position behind the header."""
    if origin + 8 > end:
        return np.int64(0), np.int64(-1)
    seconds = uint32(data, origin)
    if seconds >= 2**31:
        seconds -= 2**32
    stamp = seconds * 1_000_000_000 + uint32(data, origin + 4)
    _, _, at = text(data, origin + 8, end, origin)
    return stamp, at


@kernel
def names(data, at, end, origin, wanted):
    """Number of texts, index of the wanted text (-1 unless it occurs once), position after them."""
    count, at = counted(data, at, end, origin)
    if at < 0 or count > (end - at) // 4:
        return np.int64(0), np.int64(-1), np.int64(-1)
    found, times = np.int64(-1), 0
    for i in range(count):
        size, first, at = text(data, at, end, origin)
        if at < 0:
            return np.int64(0), np.int64(-1), np.int64(-1)
        if size == wanted.shape[0]:
            same = True
            for k in range(size):
                same &= data[first + k] == wanted[k]
            if same:
                found, times = np.int64(i), times + 1
    return count, found if times == 1 else np.int64(-1), at


@kernel
def ends(at, end):
    """True if a message ends where its data end."""
    return at >= 0 and end - at <= _MOST_PADDING


@kernel
def value(data, count, first, index):
    """Number of a sequence, NaN where the sequence is empty."""
    return float64(data, first + 8 * index) if count else math.nan


@kernel
def joint_state(data, begin, end, crank):
    """Read sensor_msgs/JointState: fault, stamp [ns], the crank's position, velocity and effort.

    A driver gives NaN for a velocity or an effort that it does not measure. The value is then absent; this is
    not a fault.
    """
    origin = begin + ENCAPSULATION
    stamp, at = header(data, origin, end)
    count, index, at = names(data, at, end, origin, crank)
    n_q, q, at = numbers(data, at, end, origin)
    n_v, v, at = numbers(data, at, end, origin)
    n_e, e, at = numbers(data, at, end, origin)
    if not ends(at, end):
        return UNDECODABLE, np.int64(0), math.nan, math.nan, math.nan
    if count == 0 or n_q == 0:
        return EMPTY, stamp, math.nan, math.nan, math.nan
    if n_q != count or (n_v != 0 and n_v != count) or (n_e != 0 and n_e != count):
        return WRONG_LENGTH, stamp, math.nan, math.nan, math.nan
    if index < 0:
        return MISSING_JOINT, stamp, math.nan, math.nan, math.nan
    position = value(data, n_q, q, index)
    velocity, effort = value(data, n_v, v, index), value(data, n_e, e, index)
    finite = math.isfinite(position) and not math.isinf(velocity) and not math.isinf(effort)
    return NO_FAULT if finite else NOT_FINITE, stamp, position, velocity, effort


@kernel
def joint_angle(data, begin, end, wanted):
    """Position of a joint in a valid JointState: NaN if the joint is missing, infinite without an angle."""
    origin = begin + ENCAPSULATION
    _, at = header(data, origin, end)
    _, index, at = names(data, at, end, origin, wanted)
    if index < 0:
        return math.nan
    count, first, _ = numbers(data, at, end, origin)
    position = value(data, count, first, index)
    return position if math.isfinite(position) else math.inf


@kernel
def wrench_stamped(data, begin, end, axis):
    """Read geometry_msgs/WrenchStamped: fault, stamp [ns], torque about an axis (0, 1, 2 for x, y, z)."""
    origin = begin + ENCAPSULATION
    stamp, at = header(data, origin, end)
    if at >= 0:
        at = aligned(at, 8, origin)
    if at < 0 or at + 48 > end or not ends(at + 48, end):
        return UNDECODABLE, np.int64(0), math.nan
    torque = float64(data, at + 24 + 8 * axis)
    return NO_FAULT if math.isfinite(torque) else NOT_FINITE, stamp, torque


@kernel
def float64_message(data, begin, end):
    """Read std_msgs/Float64: fault and number."""
    at = begin + ENCAPSULATION
    if at + 8 > end or not ends(at + 8, end):
        return UNDECODABLE, math.nan
    number = float64(data, at)
    return NO_FAULT if math.isfinite(number) else NOT_FINITE, number


@kernel
def wrench_force(data, begin, end, out_force):
    """Read the force of a geometry_msgs/WrenchStamped into (2,), x and y: fault, stamp [ns]."""
    fault, stamp, _ = wrench_stamped(data, begin, end, 0)
    if fault == UNDECODABLE:
        return fault, stamp
    _, at = header(data, begin + ENCAPSULATION, end)
    at, finite = aligned(at, 8, begin + ENCAPSULATION), True
    for i in range(2):
        out_force[i] = float64(data, at + 8 * i)
        finite &= math.isfinite(out_force[i])
    return NO_FAULT if finite else NOT_FINITE, stamp


@kernel
def dynamic_joint_state(data, begin, end, joint, interface, further):
    """Read control_msgs/DynamicJointState: fault, stamp [ns], values of two interfaces of a joint.

    joint_state_broadcaster publishes NaN for an interface that has no value yet. The second value may be
    absent: it is then NaN, and this is not a fault.
    """
    origin = begin + ENCAPSULATION
    stamp, at = header(data, origin, end)
    count, index, at = names(data, at, end, origin, joint)
    n_interfaces, at = counted(data, at, end, origin)
    if at < 0 or n_interfaces > (end - at) // 8:
        return UNDECODABLE, np.int64(0), math.nan, math.nan
    is_there, is_short, number, beside = False, False, math.nan, math.nan
    for i in range(n_interfaces):
        own = at
        n_names, found, at = names(data, at, end, origin, interface)
        n_values, first, at = numbers(data, at, end, origin)
        if at < 0:
            return UNDECODABLE, np.int64(0), math.nan, math.nan
        if i == index and found >= 0:
            is_there, is_short = True, n_values != n_names
            if not is_short:
                number = float64(data, first + 8 * found)
                if further.shape[0]:
                    _, place, _ = names(data, own, end, origin, further)
                    if place >= 0:
                        beside = float64(data, first + 8 * place)
    if not ends(at, end):
        return UNDECODABLE, np.int64(0), math.nan, math.nan
    if count == 0 or n_interfaces == 0:
        return EMPTY, stamp, math.nan, math.nan
    if n_interfaces != count or is_short:
        return WRONG_LENGTH, stamp, math.nan, math.nan
    if not is_there:
        return MISSING_JOINT, stamp, math.nan, math.nan
    return NO_FAULT if math.isfinite(number) else NOT_FINITE, stamp, number, beside


@kernel
def bool_message(data, begin, end):
    """Read std_msgs/Bool: fault and 0 or 1."""
    at = begin + ENCAPSULATION
    if at + 1 > end or not ends(at + 1, end):
        return UNDECODABLE, math.nan
    return NO_FAULT, 1.0 if data[at] != 0 else 0.0


@entry
def decode(
    data, messages, crank, interface, thermal, encoders, ends_at, axis, use_effort, out, out_angles, out_force
):
    """Read messages into samples as they are: no sign, no scale, no offset.

    Parameters
    ----------
    data : (bytes,) array of uint8
    messages : (n,) array of MESSAGE
    crank : (characters,) array of uint8
        Name of the crank's joint, UTF-8.
    interface : (characters,) array of uint8
        Name of the crank's torque interface, UTF-8.
    thermal : (characters,) array of uint8
        Name of the crank's interface for the drive temperature, UTF-8; empty if there is none.
    encoders : (characters,) array of uint8
        Names of the joints with further encoders, joined without a separator.
    ends_at : (m,) array of int
        End of each name.
    axis : int
        Axis of a wrench's torque: 0, 1, 2 for x, y, z.
    use_effort : bool
        True if the crank's effort is its torque.
    out : (n,) array of GAIT_SAMPLE
        The stamp is the header stamp, the log time if a type has no header, and 0 if it cannot be read.
        ``encoder_rad`` and ``foot_force_n`` are not modified.
    out_angles : (n, m) array
        Angles of the further encoders.
    out_force : (n, 2) array
        Force on the foot, x and y [N]. A vertical force is y. A contact switch gives 0 or 1.
    """
    for i in range(messages.shape[0]):
        begin, end = messages[i]["begin"], messages[i]["end"]
        kind = messages[i]["type"]
        fault, stamp = UNDECODABLE, np.int64(0)
        position, velocity, torque, temperature = math.nan, math.nan, math.nan, math.nan
        force = out_force[i]
        force[0], force[1] = math.nan, math.nan
        # parameter lists, XCDR2 and big endian lay out otherwise
        if end - begin >= ENCAPSULATION and data[begin] == 0 and data[begin + 1] == 1:
            if kind == JOINT_STATE:
                fault, stamp, position, velocity, torque = joint_state(data, begin, end, crank)
                if not use_effort:
                    torque = math.nan
            elif kind == WRENCH_STAMPED:
                fault, stamp, torque = wrench_stamped(data, begin, end, axis)
            elif kind == FLOAT64:
                fault, torque = float64_message(data, begin, end)
                stamp = messages[i]["log_time_ns"]
            elif kind == INTERFACES:
                fault, stamp, torque, temperature = dynamic_joint_state(
                    data, begin, end, crank, interface, thermal
                )
            elif kind == LOAD_WRENCH:
                fault, stamp = wrench_force(data, begin, end, force)
            elif kind == LOAD_FLOAT64:
                fault, force[1] = float64_message(data, begin, end)
                force[0], stamp = 0.0, messages[i]["log_time_ns"]
            elif kind == CONTACT_SWITCH:
                fault, force[1] = bool_message(data, begin, end)
                force[0], stamp = 0.0, messages[i]["log_time_ns"]
        out[i]["stamp_ns"] = stamp
        out[i]["kind"] = _KIND[kind]
        out[i]["fault"] = fault
        out[i]["crank_angle_rad"] = position
        out[i]["crank_velocity_radps"] = velocity
        out[i]["torque_nm"] = torque
        out[i]["temperature_c"] = temperature
        first = 0
        for j in range(ends_at.shape[0]):
            out_angles[i, j] = math.nan
            if kind == JOINT_STATE and fault == NO_FAULT:
                wanted = encoders[first : ends_at[j]]
                out_angles[i, j] = joint_angle(data, begin, end, wanted)
            first = ends_at[j]


# Decoding of messages to gait samples: selects crank, torque and foot load, and applies signs and scales.


class Decoder:
    """Decodes messages to samples, singly or in bulk, with identical results; used live and in replay.

    Parameters
    ----------
    config : MonitorConfig
        The decoder uses `crank_joint`, `crank`, `encoders`, `drive_torque`, `drive` and `foot_load`.
    """

    def __init__(self, config: MonitorConfig) -> None:
        crank, torque = config.crank, config.drive_torque
        self._crank = np.frombuffer(config.crank_joint.encode(), np.uint8)
        self._crank_scale = crank.sign / crank.gear_ratio
        self._offset_rad = crank.offset_rad
        self._torque_scale = torque.sign * torque.scale * torque.gear_ratio
        self._axis = "xyz".index(torque.axis)
        self._effort = torque.source == "effort"
        self._interface, self._thermal = (
            np.frombuffer(name.encode(), np.uint8)
            for name in (torque.interface, config.drive.temperature_interface)
        )
        load = config.foot_load
        self._force_scale = 1.0 if load.source == CONTACT else load.sign * load.scale
        names = [name.encode() for name in config.encoders.names]
        self._encoders = np.frombuffer(b"".join(names), np.uint8)
        self._ends = np.cumsum([len(name) for name in names], dtype=np.int64)
        self._signs = np.array(config.encoders.signs or (1.0,) * len(names))

    def many(self, data: NDArray[np.uint8], messages: NDArray[np.void]) -> Samples:
        """Decode messages in order; an unusable message becomes a sample with a fault.

        Parameters
        ----------
        data : (bytes,) array of uint8
        messages : (n,) array of MESSAGE

        Returns
        -------
        (n,) array of GAIT_SAMPLE
        """
        samples = np.empty(len(messages), GAIT_SAMPLE)
        angles = np.empty((len(messages), len(self._ends)))
        force = np.empty((len(messages), 2))
        out = samples, angles, force
        names = self._crank, self._interface, self._thermal, self._encoders
        decode(data, messages, *names, self._ends, self._axis, self._effort, *out)
        samples["encoder_rad"] = np.nan
        samples["encoder_rad"][:, : len(self._ends)] = angles
        samples["foot_force_n"] = force
        return self.scaled(samples)

    def scaled(self, samples: Samples) -> Samples:
        """Apply signs, scales and offset, in place, to samples that are as their messages are."""
        samples["encoder_rad"][:, : len(self._ends)] *= self._signs
        with np.errstate(over="ignore"):
            samples["foot_force_n"] *= self._force_scale
            samples["crank_angle_rad"] *= self._crank_scale
            samples["crank_angle_rad"] += self._offset_rad
            samples["crank_velocity_radps"] *= self._crank_scale
            samples["torque_nm"] *= self._torque_scale
        overflown = np.isinf(samples["foot_force_n"]).any(axis=1)
        for name in ("crank_angle_rad", "crank_velocity_radps", "torque_nm"):
            overflown |= np.isinf(samples[name])
        samples["fault"][overflown & (samples["fault"] == NO_FAULT)] = NOT_FINITE
        return mark_zero_stamps(samples)

    def one(self, raw: bytes, kind: int, log_time_ns: int = 0) -> Samples:
        """Decode one serialized message.

        Parameters
        ----------
        raw : bytes
        kind : int
            Code of the message's stream.
        log_time_ns : int
            Time of arrival [ns]; stamps messages without a header.

        Returns
        -------
        (1,) array of GAIT_SAMPLE
        """
        message = np.zeros(1, MESSAGE)
        message[0] = (0, len(raw), log_time_ns, kind)
        return self.many(np.frombuffer(raw, np.uint8), message)


def mark_zero_stamps(samples: Samples) -> Samples:
    """Mark, in place, otherwise valid samples with a stamp of zero: their clock had not started."""
    zero = (samples["stamp_ns"] == 0) & (samples["fault"] == NO_FAULT)
    if zero.any():
        samples["fault"][zero] = ZERO_STAMP
    return samples
