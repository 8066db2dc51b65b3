"""Outputs of the node: topics, markers, and the recording of all of them."""

import re
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime
from functools import cached_property
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.reports import Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.leg_markers import LINKAGE, MARKERS, SILENT_NS, LegDrawing, LegMarkers
from leg_wear_monitor.recordings.streams import Outgoing, Output, Qos
from leg_wear_monitor.ros.running import until_down

if TYPE_CHECKING:
    from leg_wear_monitor.recordings.mcap_file import McapWriter


# Separate recordings of the seconds around a STOP.


_BEFORE_NS, _AFTER_NS = 30_000_000_000, 10_000_000_000


class StopRecorder:
    """Keeps the messages of the last 30 s in memory; a STOP writes them and the messages of the next 10 s.

    Parameters
    ----------
    directory : str
        Directory of the files, one per STOP, named by the computer's time (UTC) and the leg.
    leg : str
        Hardware id; several legs may write into one directory.
    report : callable
        Called with a line for the log.

    Raises
    ------
    LegWearError
        If the directory cannot be made; later, if a file cannot be written.
    """

    def __init__(self, directory: str, leg: str, report: Callable[[str], None]) -> None:
        self._directory, self._report = Path(directory), report
        self._leg = re.sub(r"[^\w.-]", "_", leg)  # such as robot/left, which would be a directory
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LegWearError(
                f"record.stop_recording_dir: {directory} cannot be made: {error.strerror}"
            ) from error
        self._kept: deque[tuple[int, str, bytes | NDArray[np.uint8]]] = deque()
        self._topics: dict[str, tuple[str, Qos]] = {}
        self._writer: McapWriter | None = None
        self._channels: dict[str, int] = {}
        self._until_ns = 0

    def add_topic(self, topic: str, kind: str, qos: Qos) -> None:
        """Register a topic by its full name and type."""
        self._topics[topic] = kind, qos

    def keep(self, topic: str, log_time_ns: int, raw: bytes | NDArray[np.uint8]) -> None:
        """Keep a message, or several of equal length (n, bytes)."""
        if self._writer is not None and log_time_ns > self._until_ns:
            self.close()
        self._kept.append((log_time_ns, topic, raw))
        # This also removes messages stamped in the future by a clock that was set back.
        while not log_time_ns - _BEFORE_NS <= self._kept[0][0] <= log_time_ns:
            self._kept.popleft()
        if self._writer is not None:
            self._write(log_time_ns, topic, raw)

    def stop(self, now_ns: int) -> None:
        """Begin a file with the stored messages; a file that is still being written gets no second file."""
        if self._writer is not None:
            return
        path = self._directory / f"stop-{_utc(now_ns * 1.0e-9)}-{self._leg}.mcap"
        self._writer = _writer("record.stop_recording_dir", path, self._report)
        self._channels = {name: self._writer.channel(name, *spec) for name, spec in self._topics.items()}
        self._until_ns = now_ns + _AFTER_NS
        for kept in self._kept:
            self._write(*kept)

    def flush(self) -> None:
        """Flush the written messages to the disk."""
        if self._writer is not None:
            self._writer.flush()

    def close(self) -> None:
        """Finish the file that is being written."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _write(self, log_time_ns: int, topic: str, raw: bytes | NDArray[np.uint8]) -> None:
        if self._writer is not None:
            put(self._writer, self._channels[topic], log_time_ns, raw)


def put(writer: "McapWriter", channel: int, log_time_ns: int, raw: bytes | NDArray[np.uint8]) -> int:
    """Write a message, or several of equal length (n, bytes); returns their number."""
    if isinstance(raw, bytes):
        writer.write(channel, log_time_ns, raw)
        return 1
    writer.write_many(channel, np.full(len(raw), log_time_ns, np.int64), raw)
    return len(raw)


# MCAP recording of all messages the node receives and publishes; its replay reproduces the live run.


class BlackBox:
    """Optional recording: without a path, or after a disk failure, nothing is recorded.

    Parameters
    ----------
    path : str
        MCAP file; empty disables the recording. An earlier recording of this name is kept under a new name.
    stops : str
        Directory for recordings of the seconds around a STOP; empty for none.
    leg : str
        Hardware id, for the names of these recordings.
    report : callable
        Called with a line for the log: the file that is written, and the new name of an earlier file.

    Attributes
    ----------
    fault : str
        Why the recording stopped; empty if it did not.
    recorded : int
        Number of recorded messages.

    Raises
    ------
    LegWearError
        If the file, or the directory, cannot be created.
    """

    def __init__(self, path: str, stops: str, leg: str, report: Callable[[str], None]) -> None:
        self.fault, self.recorded = "", 0
        self._stops = StopRecorder(stops, leg, report) if stops else None
        self._writer = _writer("record.path", Path(path), report) if path else None
        self._channels: dict[str, int] = {}

    @property
    def on(self) -> bool:
        """True if all messages are recorded, including messages without a subscriber."""
        return self._writer is not None

    @property
    def takes_inputs(self) -> bool:
        """True if received messages are recorded, or kept for a STOP."""
        return self.on or self._stops is not None

    def add_topic(self, topic: str, kind: str, qos: "Qos") -> None:
        """Register a topic by its full name and type."""
        if self._stops is not None:
            self._stops.add_topic(topic, kind, qos)
        if self._writer is not None:
            self._channels[topic] = self._writer.channel(topic, kind, qos)

    def write(self, topic: str, log_time_ns: int, raw: bytes | NDArray[np.uint8]) -> None:
        """Record a message, or several of equal length (n, bytes)."""
        self._with_stops(lambda stops: stops.keep(topic, log_time_ns, raw))

        def record(writer: "McapWriter") -> None:
            self.recorded += put(writer, self._channels[topic], log_time_ns, raw)

        self._with_writer(record)

    def stop(self, now_ns: int) -> None:
        """Write the seconds around a STOP, if a directory is configured."""
        self._with_stops(lambda stops: stops.stop(now_ns))

    def flush(self) -> None:
        """Write buffered messages to the disk."""
        self._with_stops(StopRecorder.flush)
        self._with_writer(lambda writer: writer.flush())

    def close(self) -> None:
        """Finish the files."""
        self._with_stops(StopRecorder.close)
        self._with_writer(lambda writer: writer.close())
        self._writer = None

    def _with_stops(self, use: Callable[[StopRecorder], None]) -> None:
        """Use the recorder of stops, if there is one; a disk failure ends the recorder, not the monitor."""
        if self._stops is not None:
            try:
                use(self._stops)
            except LegWearError as error:
                self.fault, self._stops = str(error), None

    def _with_writer(self, use: Callable[["McapWriter"], None]) -> None:
        """Use the writer, if there is one; a disk failure ends the recording, not the monitor."""
        writer = self._writer
        if writer is not None:
            try:
                use(writer)
            except LegWearError as error:
                self.fault, self._writer = str(error), None
                with suppress(LegWearError):  # already reported
                    writer.close()


def _writer(parameter: str, path: Path, report: Callable[[str], None]) -> "McapWriter":
    """A writer of a file; a recording that the file contains is kept, and the log names both files."""
    try:
        from leg_wear_monitor.recordings.mcap_file import McapWriter
    except ImportError as error:
        raise LegWearError(f"{parameter}: {error}; pip install 'leg_wear_monitor[bags]'") from error
    earlier = _move_aside(parameter, path)
    writer = McapWriter(path)
    report(f"recording to {path}" + (f"; the earlier recording is kept as {earlier}" if earlier else ""))
    return writer


def _move_aside(parameter: str, path: Path) -> Path | None:
    """Rename a file that is not empty by the time of its last change (UTC); its new name.

    A restart with the same parameters must not delete the earlier recordings.
    """
    try:
        if not path.is_file() or not path.stat().st_size:
            return None
        stem = f"{path.stem}-{_utc(path.stat().st_mtime)}"
        names = (f"{stem}{again}{path.suffix}" for again in chain([""], (f"-{n}" for n in count(2))))
        return path.rename(next(each for each in map(path.with_name, names) if not each.exists()))
    except OSError as error:
        raise LegWearError(f"{parameter}: {path} cannot be renamed: {error.strerror}") from error


def _utc(time_s: float) -> str:
    """Time in the name of a file."""
    return datetime.fromtimestamp(time_s, UTC).strftime("%Y%m%dT%H%M%SZ")


# Output topics of the monitor: serialized messages are published and recorded.


VOLATILE = "volatile"

_KINDS = {
    "sensor_msgs/msg/JointState": JointState,
    "geometry_msgs/msg/WrenchStamped": WrenchStamped,
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray,
    "std_msgs/msg/String": String,
    "visualization_msgs/msg/MarkerArray": MarkerArray,
}


def qos_profile(qos: Qos) -> QoSProfile:
    """Convert to a quality-of-service profile of rclpy."""
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )


class Outlets:
    """Publishers of a node's outputs.

    Parameters
    ----------
    node : rclpy.node.Node
    outputs : iterable of Output
    black_box : BlackBox
    """

    def __init__(self, node: Node, outputs: Iterable[Output], black_box: BlackBox) -> None:
        self._context, self._black_box = node.context, black_box
        self._topics: dict[Output, str] = {}
        self._publishers: dict[Output, Publisher] = {}
        for output in outputs:
            # names without a leading slash are in the node's namespace; names may be remapped
            self._publishers[output] = publisher = node.create_publisher(
                _KINDS[output.type],
                output.name,
                qos_profile(output.qos),
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
            self._topics[output] = publisher.topic_name
            black_box.add_topic(publisher.topic_name, output.type, output.qos)

    def wanted(self, output: Output) -> bool:
        """True if a message is needed: for a subscriber, a late subscriber (latched), or the recording."""
        if self._black_box.on or output.qos.durability != VOLATILE:
            return True
        with until_down(self._context):
            return self._publishers[output].get_subscription_count() > 0
        return False

    def send(self, outgoing: Outgoing, now_ns: int) -> None:
        """Record and publish messages; only record them after the context has shut down."""
        output, rows = outgoing.output, outgoing.messages
        self._black_box.write(self._topics[output], now_ns, rows)
        size, whole, handle = rows.shape[1], rows.tobytes(), self._publishers[output].handle
        with until_down(self._context), handle:  # like `publish`, which checks the type of each message
            for at in range(0, len(whole), size):
                handle.publish_raw(whole[at : at + size])


# Topics ``~/markers`` and ``~/linkage_states`` of the node; `recordings.leg_markers` makes them.


class MarkerTopic:
    """``~/markers`` and ``~/linkage_states``, published while wanted and either subscribed to or recorded.

    Parameters
    ----------
    node : rclpy.node.Node
    outlets : Outlets
    monitor : WearMonitor
    is_current : callable
        Returns whether there are current data; otherwise the leg is published in grey, once a second.
    """

    def __init__(
        self, node: Node, outlets: Outlets, monitor: WearMonitor, is_current: Callable[[], bool]
    ) -> None:
        self._node, self._outlets, self._monitor, self._is_current = node, outlets, monitor, is_current
        self._markers: LegMarkers | None = None
        if self._is_wanted:
            self._markers = LegMarkers(monitor, self._drawing)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(SILENT_NS * 1.0e-9, self._show_silence, clock=steady)

    def publish(self, reports: Reports) -> None:
        """Publish the markers of reports."""
        for outgoing in self._drawn.of(reports) if self._is_wanted else ():
            self._send(outgoing)

    def operated(self) -> None:
        """Show alarms and verdict that an operator has changed."""
        if self._markers:
            self._markers.set_state(self._monitor.alarms, self._monitor.verdict)

    @cached_property
    def _drawing(self) -> LegDrawing:
        return LegDrawing(self._monitor.mechanism)

    @property
    def _drawn(self) -> LegMarkers:
        self._markers = self._markers or LegMarkers(self._monitor, self._drawing)
        return self._markers

    @property
    def _is_wanted(self) -> bool:
        """True if markers are needed; otherwise their content is not kept up to date."""
        wanted = self._monitor.config.publish_markers and any(map(self._outlets.wanted, (MARKERS, LINKAGE)))
        if not wanted:
            self._markers = None
        return wanted

    def _show_silence(self) -> None:
        if not self._is_current() and self._is_wanted:
            self._send(self._drawn.no_data(self._node.get_clock().now().nanoseconds))

    def _send(self, outgoing: Outgoing) -> None:
        self._outlets.send(outgoing, time.time_ns())
