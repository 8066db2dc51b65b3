"""All joints and torques of recordings as time series.

`commissioning` then finds out which joint is the crank, and which torque drives it.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.joint_motion import Series, series
from leg_wear_monitor.monitor.config.inputs import EFFORT, FLOAT64, INTERFACE, WRENCH, DriveTorque
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import outputs
from leg_wear_monitor.recordings.bag import Recordable, Source, check_channel, find_files, open_sources
from leg_wear_monitor.recordings.cdr import Decoder
from leg_wear_monitor.recordings.findings import Channel, Finding, Piece, RecordingError, Severity
from leg_wear_monitor.recordings.message_checks import interfaces_in, names_in, twice
from leg_wear_monitor.recordings.reader import clock_steps
from leg_wear_monitor.recordings.streams import INTERFACES, JOINT_STATE, STREAMS, WRENCH_STAMPED, Stream
from leg_wear_monitor.twin import CRANK, KINDS, TORQUE
from leg_wear_monitor.twin.crank_motion import BACKWARD_JUMP_NS
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, ZERO_STAMP, Samples

# Identity of a series: each joint is a candidate for the crank, each torque for the drive torque.


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
        `WRENCH`, `EFFORT`, `INTERFACE` or `FLOAT64`, as the parameter `drive_torque.source`.
    topic : str
    component : str
        Axis of a wrench (x, y or z); joint of an effort or of an interface; empty for a Float64.
    interface : str
        Name of the joint's interface, such as ``motor_current``; empty for the other sources.
    """

    source: str
    topic: str
    component: str = ""
    interface: str = ""

    @property
    def label(self) -> str:
        """Source, component and topic, as messages print them."""
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
# The monitor's configuration names one crank joint and one axis, and its decoder yields the angle and the
# torque of these only. So one decoder is made for each joint, as if that were the crank, and one for each
# axis. A recording is read in pieces, because it may be larger than the memory.


# Ends of the topics that the monitor publishes as joint states or wrenches. They are not sensors, and the
# monitor's predicted torque would fit better than any measured torque.
_PUBLISHED = tuple(each.name.lstrip("~") for each in (outputs.CLEARANCES, outputs.IMPACTS, outputs.TORQUE))
# Interfaces of a joint that are not candidates: three are not torques, and joint_states has the effort as
# well.
_NO_CANDIDATES = ("position", "velocity", "acceleration", "effort")
_NAMING_MESSAGES = 20  # messages at the start of a piece to read joint names from
_LONGEST_PAUSE_NS = 10 * 10**9
_NO_JOINT = "(no joint)"  # name of a crank joint that no message has


_Name = JointName | TorqueSource
_Found = list[tuple[_Name, Samples, NDArray[np.float64]]]
"""Name of a series, its samples, and their values of this series."""


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
        The only topic to read for joints, or for torques; default: all topics.
    progress : callable
        Called after each piece with the fraction that is read, up to 1.

    Returns
    -------
    signals : Signals
    findings : list of Finding
        Files and channels that were not read, and damage in those that were.

    Raises
    ------
    RecordingError
        If nothing can be read, or there is no topic of joints.
    """
    bag_files = find_files(paths)
    collected: dict[_Name, list[Any]] = {}
    with ExitStack() as stack:
        sources, findings = open_sources(bag_files, config, stack)
        streams = [_select(source, joint_states, drive_torque, findings) for source in sources]
        if not any(stream.kind == CRANK for chosen in streams for stream in chosen.values()):
            where = ", ".join(str(one.path) for one in bag_files)
            raise RecordingError(where, "joint_states", "no topic of sensor_msgs/msg/JointState")
        read, total = 0, max(1, sum(source.file.size for source in sources))
        for source, chosen in zip(sources, streams, strict=True):
            parts: dict[_Name, list[Any]] = {}
            for _, load in source.pieces():
                piece = load()
                if piece is not None:  # a damaged piece is a finding of its file
                    for name, part in _piece_series(source, chosen, piece, config):
                        parts.setdefault(name, []).append(part)
                    read += piece.stored
                    progress(min(1.0, read / total))
            findings += source.file.findings
            for name, stamps, values in _continued(source.bag_file.path, parts, findings):
                collected.setdefault(name, []).append((stamps, values))
    return _signals(collected), findings


def _continued(
    path: Path, parts: dict[_Name, list[Any]], findings: list[Finding]
) -> Iterator[tuple[_Name, NDArray[np.int64], NDArray[np.float64]]]:
    """Each series of a file in order of arrival; after a step back of the clock, its stamps go on."""
    shifts_ns = [0]  # after each step, the same for all series, which thus keep their order
    for name, pieces in parts.items():
        if isinstance(name, JointName):
            for step in (step for piece in pieces for step in clock_steps(path, piece[0])[1]):
                fault = f"{step.text}, also for the log times. Record again with a steady clock"
                raise RecordingError(str(path), "", fault)
        logged, stamps, values = map(np.concatenate, zip(*pieces, strict=True))
        order = np.argsort(logged, kind="stable")
        stamps, values = stamps[order], values[order]
        back, found = clock_steps(path, stamps)
        known = len(shifts_ns) - 1
        findings += found[known:]
        for at in np.flatnonzero(back)[known:].tolist():
            shifts_ns.append(shifts_ns[-1] + int(stamps[at - 1] - stamps[at]) + BACKWARD_JUMP_NS)
        yield name, stamps + np.array(shifts_ns)[np.cumsum(back)], values


def _select(
    source: Source, joint_states: str | None, drive_torque: str | None, findings: list[Finding]
) -> dict[int, Stream]:
    """Streams of the channels to be read, by the numbers that the source then has as types of its messages.

    Elsewhere such a number is the code of a stream. Here several topics may have the same stream.
    """
    chosen = {}
    for number, channel in source.file.channels.items():
        path, stream = source.bag_file.path, _stream(channel, joint_states, drive_torque)
        try:
            if stream is not None:
                check_channel(stream, channel, str(path))
                source.types[number] = 1 + number  # 0 is a message that is not read
                chosen[1 + number] = stream
        except RecordingError as error:
            findings.append(Finding(path, f"{error.key} {error.fault}: it is not read", Severity.NOTE))
    return chosen


def _stream(channel: Channel, joint_states: str | None, drive_torque: str | None) -> Stream | None:
    """Stream of a channel by its message type; None for a channel that is not read."""
    if channel.topic.endswith(_PUBLISHED):
        return None
    for stream in STREAMS:
        # The streams of a foot load have the same types as torques; they are not read as torques.
        if stream.type == channel.type and stream.kind in (CRANK, TORQUE):
            wanted = joint_states if stream.kind == CRANK else drive_torque
            return stream if wanted in (None, channel.topic, channel.topic.lstrip("/")) else None
    return None


def _piece_series(
    source: Source, streams: dict[int, Stream], piece: Piece, config: MonitorConfig
) -> Iterator[tuple[_Name, tuple[NDArray[Any], ...]]]:
    """Log times and stamps [ns], and values of each joint and torque in a piece."""
    channels = source.file.channels
    for number in np.unique(piece.messages["type"]).tolist():
        topic, stream = channels[number - 1].topic, streams[number]
        is_chosen = piece.messages["type"] == number
        chosen = piece.messages[is_chosen]  # a copy, with the code that the decoder expects
        chosen["type"] = stream.code
        if piece.samples is None:
            found = _decoded_series(topic, stream.code, piece.data, chosen)
        else:
            found = _table_series(topic, stream, piece.samples[is_chosen], config)
        for name, samples, values in found:
            # a message without a stamp is usable at its log time
            is_unstamped = samples["fault"] == ZERO_STAMP
            largest = KINDS[CRANK if isinstance(name, JointName) else TORQUE].largest
            is_usable = (is_unstamped | (samples["fault"] == NO_FAULT)) & (np.abs(values) <= largest)
            logged = chosen["log_time_ns"]
            stamps = np.where(is_unstamped, logged, samples["stamp_ns"])
            yield name, (logged[is_usable], stamps[is_usable], values[is_usable])


def _table_series(topic: str, stream: Stream, samples: Samples, config: MonitorConfig) -> _Found:
    """Each series in the rows of a table."""
    torque, crank = config.drive_torque, config.crank_joint
    if stream.code == JOINT_STATE:
        found: _Found = [(JointName(topic, crank), samples, samples["crank_angle_rad"])]
        for k, name in enumerate(config.encoders.names):
            found.append((JointName(topic, name), samples, samples["encoder_rad"][:, k]))
        if np.isfinite(samples["torque_nm"]).any():
            found.append((TorqueSource(EFFORT, topic, crank), samples, samples["torque_nm"]))
        return found
    source = {
        WRENCH_STAMPED: TorqueSource(WRENCH, topic, torque.axis),
        INTERFACES: TorqueSource(INTERFACE, topic, crank, torque.interface),
    }.get(stream.code, TorqueSource(FLOAT64, topic))
    return [(source, samples, samples["torque_nm"])]


def _decoded_series(topic: str, code: int, data: NDArray[np.uint8], messages: NDArray[np.void]) -> _Found:
    """Each series in the messages of a topic.

    Each message gives one sample. Samples of a joint state have both the angle and the effort of the joint.
    """
    found: _Found = []
    if code == JOINT_STATE:
        for joint in _joint_names(data, messages):
            samples = _decoder(EFFORT, joint=joint).many(data, messages)
            found.append((JointName(topic, joint), samples, samples["crank_angle_rad"]))
            if np.isfinite(samples["torque_nm"]).any():
                found.append((TorqueSource(EFFORT, topic, joint), samples, samples["torque_nm"]))
        return found
    sources = {TorqueSource(FLOAT64, topic): _decoder(FLOAT64)}
    if code == INTERFACES:
        sources = {
            TorqueSource(INTERFACE, topic, joint, interface): _decoder(INTERFACE, "z", joint, interface)
            for joint, interface in _interfaces(data, messages)
        }
    elif code == WRENCH_STAMPED:
        sources = {TorqueSource(WRENCH, topic, axis): _decoder(WRENCH, axis) for axis in "xyz"}
    for source, decoder in sources.items():
        samples = decoder.many(data, messages)
        found.append((source, samples, samples["torque_nm"]))
    return found


def _decoder(source: str, axis: str = "z", joint: str = _NO_JOINT, interface: str = "effort") -> Decoder:
    """Decoder of one torque source and of one joint as the crank; a source ignores missing parts."""
    torque = DriveTorque(source=source, axis=axis, interface=interface)
    return Decoder(MonitorConfig(crank_joint=joint, drive_torque=torque))


def _joint_names(data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[str]:
    """Names of the joints in the first messages."""
    names: dict[str, None] = {}  # a set that keeps the order
    for raw in _first_decodable(EFFORT, data, messages):
        known = names_in(raw)
        again = next(filter(None, (twice(known, name) for name in known if name)), "")
        if again:
            raise LegWearError(again)
        names |= dict.fromkeys(known)
    return [name for name in names if name]


def _interfaces(data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[tuple[str, str]]:
    """Joints with their interfaces that may be a torque, in the first messages."""
    pairs: dict[tuple[str, str], None] = {}
    for raw in _first_decodable(INTERFACE, data, messages):
        for joint, names in interfaces_in(raw).items():
            pairs |= dict.fromkeys((joint, name) for name in names if name and name not in _NO_CANDIDATES)
    return list(pairs)


def _first_decodable(source: str, data: NDArray[np.uint8], messages: NDArray[np.void]) -> list[bytes]:
    """The first messages that are not damaged.

    The decoder is made for a joint that no message has: it reports an undamaged message as MISSING_JOINT, and
    a damaged message with a different fault.
    """
    faults = _decoder(source).many(data, messages)["fault"]
    decodable = np.flatnonzero(faults == MISSING_JOINT)[:_NAMING_MESSAGES]
    return [data[one["begin"] : one["end"]].tobytes() for one in messages[decodable]]


def _signals(collected: dict[_Name, list[Any]]) -> Signals:
    """Join the parts of each series that is not empty; time 0 is the first stamp of all series.

    Longer pauses are shortened, and so is a clock that is set while recording: memory is for walking time.
    """
    full = {
        name: [np.concatenate(column) for column in zip(*parts, strict=True)]
        for name, parts in collected.items()
    }
    all_ns = np.unique(np.concatenate([stamps for stamps, _ in full.values()] or [np.zeros(0, np.int64)]))
    walked_ns = np.cumsum(np.minimum(np.diff(all_ns, prepend=all_ns[:1]), _LONGEST_PAUSE_NS))
    found = {
        name: series(walked_ns[np.searchsorted(all_ns, stamps)], values, 0)
        for name, (stamps, values) in full.items()
        if len(stamps)
    }
    joints = {name: one for name, one in found.items() if isinstance(name, JointName)}
    torques = {name: one for name, one in found.items() if isinstance(name, TorqueSource)}
    return Signals(joints, torques)
