"""All joints and torques of recordings as time series, for finding the crank and its torque."""

from collections.abc import Callable, Iterable
from contextlib import ExitStack

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.bag import Recordable, Source, check_channel, find_files, open_sources
from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError, Severity
from leg_wear_monitor.bags.mcap_layout import Channel
from leg_wear_monitor.estimate.joint_motion import Series, series
from leg_wear_monitor.messages import outputs
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.names import interfaces_in, names_in
from leg_wear_monitor.messages.streams import INTERFACES, JOINT_STATE, STREAMS, WRENCH_STAMPED, Stream
from leg_wear_monitor.monitor.config.inputs import EFFORT, FLOAT64, INTERFACE, WRENCH, DriveTorque
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, ZERO_STAMP, Samples

# The series: each joint is a candidate for the crank, each torque one for the drive torque.


# of a joint's interfaces those that are no torque, and the one that joint_states has, too
_NO_TORQUE = ("position", "velocity", "acceleration", "effort")


@attrs.frozen
class JointName:
    """A joint of a recording: its topic and its name in the messages."""

    topic: str
    joint: str


@attrs.frozen
class TorqueSource:
    """A torque of a recording.

    Attributes
    ----------
    source : str
        Value of `drive_torque.source`.
    topic : str
    component : str
        Axis of a wrench (x, y, z), joint of an effort or of an interface; empty for a Float64.
    interface : str
        Name of an interface; empty for others.
    """

    source: str
    topic: str
    component: str = ""
    interface: str = ""

    @property
    def label(self) -> str:
        """The torque in words."""
        if self.source == WRENCH:
            return f"wrench, axis {self.component}, of {self.topic}"
        if self.source == EFFORT:
            return f"effort of {self.component} in {self.topic}"
        if self.source == INTERFACE:
            return f"{self.interface} of {self.component} in {self.topic}"
        return f"Float64 of {self.topic}"


@attrs.frozen(eq=False)
class Signals:
    """All candidates of one or more recordings, as series over time."""

    joints: dict[JointName, Series]
    torques: dict[TorqueSource, Series]


# Reading: each channel is decoded by the monitor's own decoder, once for each joint or axis.
#
# A decoder yields a crank angle and a torque, of one joint or axis that its configuration names. So it is
# configured with each joint in turn as if that were the crank, and with each axis as if that were the
# torque's.


# Ends of topics that the monitor itself publishes: its predicted torque would fit better than any measured
# one.
_PUBLISHED = tuple(each.name.lstrip("~") for each in (outputs.CLEARANCES, outputs.IMPACTS, outputs.TORQUE))
_MOST_CHANNELS = 250  # the field `type` of a message, which contains a channel's number here, has eight bits
_MOST_JOINTS = 200  # of a channel, to bound the work: each joint is decoded by itself
_NAMING_MESSAGES = 20  # first messages of a piece, whose joint names are read
_NO_JOINT = "(no joint)"  # name of a crank joint that no message has


_Channel = tuple[str, Stream]
"""Topic and stream of a channel that is read."""

_Parts = list[tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]]
"""Parts of one series, from successive pieces: stamps [ns], values, indices of the recording."""


def read_signals(
    paths: Iterable[Recordable],
    config: MonitorConfig,
    *,
    joint_states: str | None = None,
    drive_torque: str | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> tuple[Signals, list[Finding]]:
    """Read all joints and torques of recordings.

    Parameters
    ----------
    paths : iterable
        MCAP, .db3, CSV and Parquet files, bag directories, tables in memory.
    config : MonitorConfig
        Columns and units of tables.
    joint_states, drive_torque : str, optional
        Topics to read, and no others of their kind; default: all.
    progress : callable
        Takes the fraction read.

    Raises
    ------
    RecordingError
        If nothing can be read, or there is no joint.
    """
    bag_files, findings = find_files(paths)
    with ExitStack() as stack:
        sources, lost = open_sources(bag_files, config, Budget(), stack)
        selected, skipped = _select(sources, joint_states, drive_torque)
        if not any(stream.kind == CRANK for _, stream in selected):
            raise RecordingError(
                ", ".join(str(one.path) for one in bag_files),
                "joint_states",
                "no topic of sensor_msgs/msg/JointState",
            )
        collected: dict[JointName | TorqueSource, _Parts] = {}
        read, total = 0, max(1, sum(source.file.size for source in sources))
        for source in sources:
            for due in source.pieces():
                piece = due.load()
                if piece is not None:
                    recording = source.bag_file.recording
                    _add_piece(collected, selected, piece.data, piece.messages, recording)
                    read += piece.stored
                    progress(min(1.0, read / total))
        findings += lost + skipped + [each for source in sources for each in source.file.findings]
    return _signals(collected), findings


def _select(
    sources: list[Source], joint_states: str | None, drive_torque: str | None
) -> tuple[list[_Channel], list[Finding]]:
    """Channels to be read.

    The messages of a source get the number of their channel here, from 1, as their `type`; a reader of one
    channel for each stream has the stream's code there. Channels of the same topic and stream share a number.
    """
    selected: list[_Channel] = []
    findings: list[Finding] = []
    for source in sources:
        for number, channel in sorted(source.file.channels.items()):
            path, known = source.bag_file.path, source.bag_file.types.get(channel.topic, "")
            stream = _stream(channel, known, {CRANK: joint_states}, drive_torque)
            if stream is None:
                continue
            try:
                check_channel(stream, channel, known, str(path))
            except RecordingError as error:
                findings.append(Finding(path, f"{error.key} {error.fault}: it is not read", Severity.NOTE))
                continue
            selected_channel = channel.topic, stream
            if selected_channel not in selected:
                selected.append(selected_channel)
            if (index := selected.index(selected_channel)) < _MOST_CHANNELS:
                source.types[number] = 1 + index
    return selected, findings


def _stream(
    channel: Channel, known: str, chosen: dict[int, str | None], drive_torque: str | None
) -> Stream | None:
    """Stream of a channel by its message type; None for a channel that is not read."""
    if channel.topic.endswith(_PUBLISHED):
        return None
    for stream in STREAMS:
        topic = chosen.get(stream.kind, drive_torque)
        if stream.type == (channel.type or known) and not stream.load_source:
            return stream if topic in (None, channel.topic, channel.topic.lstrip("/")) else None
    return None


def _add_piece(
    collected: dict[JointName | TorqueSource, _Parts],
    selected: list[_Channel],
    data: NDArray[np.uint8],
    messages: NDArray[np.void],
    recording: int,
) -> None:
    """Decode a piece, and add its values to the series of each joint and torque."""
    for number in np.unique(messages["type"]).tolist():
        channel = selected[number - 1]
        chosen = messages[messages["type"] == number]
        chosen["type"] = channel[1].code
        for name, samples, field in _decoded_series(channel, data, chosen):
            # a message without a stamp is usable at its log time
            is_unstamped = samples["fault"] == ZERO_STAMP
            is_usable = is_unstamped | (samples["fault"] == NO_FAULT)
            stamps = np.where(is_unstamped, chosen["log_time_ns"], samples["stamp_ns"])[is_usable]
            parts = collected.setdefault(name, [])
            parts.append((stamps, samples[field][is_usable], np.full(len(stamps), recording)))


def _decoded_series(
    channel: _Channel, data: NDArray[np.uint8], messages: NDArray[np.void]
) -> list[tuple[JointName | TorqueSource, Samples, str]]:
    """Samples of each series in a channel's messages, and the field of its values."""
    topic, code = channel[0], channel[1].code
    found: list[tuple[JointName | TorqueSource, Samples, str]] = []
    if code == JOINT_STATE:
        for joint in _joint_names(data, messages):
            samples = _decoder(EFFORT, joint=joint).many(data, messages)
            found.append((JointName(topic, joint), samples, "crank_angle_rad"))
            if np.isfinite(samples["torque_nm"]).any():
                found.append((TorqueSource(EFFORT, topic, joint), samples, "torque_nm"))
        return found
    if code == INTERFACES:
        for joint, interface in _interfaces(data, messages):
            samples = _decoder(INTERFACE, joint=joint, interface=interface).many(data, messages)
            found.append((TorqueSource(INTERFACE, topic, joint, interface), samples, "torque_nm"))
        return found
    if code == WRENCH_STAMPED:
        return [
            (TorqueSource(WRENCH, topic, axis), _decoder(WRENCH, axis).many(data, messages), "torque_nm")
            for axis in "xyz"
        ]
    return [(TorqueSource(FLOAT64, topic), _decoder(FLOAT64).many(data, messages), "torque_nm")]


def _decoder(source: str, axis: str = "z", joint: str = _NO_JOINT, interface: str = "effort") -> Decoder:
    """Decoder of one torque source and of one joint as the crank."""
    torque = DriveTorque(source=source, axis=axis, interface=interface)
    return Decoder(MonitorConfig(crank_joint=joint, drive_torque=torque))


def _joint_names(data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[str]:
    """Names of the joints in the first sound messages."""
    names: dict[str, None] = {}
    for raw in _first_sound(EFFORT, data, messages):
        names |= dict.fromkeys(names_in(raw)[:_MOST_JOINTS])
    return [name for name in names if name][:_MOST_JOINTS]


def _interfaces(data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[tuple[str, str]]:
    """Joints and interfaces in the first sound messages that may be a torque."""
    pairs: dict[tuple[str, str], None] = {}
    for raw in _first_sound(INTERFACE, data, messages):
        for joint, names in list(interfaces_in(raw).items())[:_MOST_JOINTS]:
            pairs |= dict.fromkeys((joint, name) for name in names if name and name not in _NO_TORQUE)
    return list(pairs)[:_MOST_JOINTS]


def _first_sound(source: str, data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[bytes]:
    """The first messages without a fault.

    A decoder for a joint that no message has reports only sound messages as MISSING_JOINT.
    """
    faults = _decoder(source).many(data, messages)["fault"]
    sound = np.flatnonzero(faults == MISSING_JOINT)[:_NAMING_MESSAGES]
    return [data[one["begin"] : one["end"]].tobytes() for one in messages[sound]]


def _signals(collected: dict[JointName | TorqueSource, _Parts]) -> Signals:
    """Series that are not empty, with times since the first stamp of all."""
    full = {name: parts for name, parts in collected.items() if any(len(part[0]) for part in parts)}
    first_ns = min(
        (int(part[0].min()) for parts in full.values() for part in parts if len(part[0])), default=0
    )
    found = {name: _joined(parts, first_ns) for name, parts in full.items()}
    joints = {name: one for name, one in found.items() if isinstance(name, JointName)}
    torques = {name: one for name, one in found.items() if isinstance(name, TorqueSource)}
    return Signals(joints, torques)


def _joined(parts: _Parts, first_ns: int) -> Series:
    stamps, values, recording = (np.concatenate(column) for column in zip(*parts, strict=True))
    return series(stamps, values, recording, first_ns)
