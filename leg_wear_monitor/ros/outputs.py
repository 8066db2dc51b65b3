"""Outputs of the node: topics, markers, and the recording of all of them."""

import time
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
from leg_wear_monitor.recordings.leg_markers import MARKERS, LegDrawing, LegMarkers
from leg_wear_monitor.recordings.streams import Outgoing, Output, Qos
from leg_wear_monitor.ros.running import until_down

if TYPE_CHECKING:
    from leg_wear_monitor.recordings.mcap_file import McapWriter


# MCAP recording of all messages the node receives and publishes; its replay reproduces the live run.


class BlackBox:
    """Optional recording: without a path, or after a disk failure, nothing is recorded.

    Parameters
    ----------
    path : str
        MCAP file; empty disables the recording. An earlier recording of this name is kept under a new name.
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
        If the file cannot be created.
    """

    def __init__(self, path: str, report: Callable[[str], None]) -> None:
        self.fault, self.recorded = "", 0
        self._writer = _writer(Path(path), report) if path else None
        self._channels: dict[str, int] = {}

    @property
    def on(self) -> bool:
        """True if all messages are recorded, including messages without a subscriber."""
        return self._writer is not None

    def add_topic(self, topic: str, kind: str, qos: "Qos") -> None:
        """Register a topic by its full name and type."""
        if self._writer is not None:
            self._channels[topic] = self._writer.channel(topic, kind, qos)

    def write(self, topic: str, log_time_ns: int, rows: NDArray[np.uint8]) -> None:
        """Record messages of equal length (n, bytes)."""
        times = np.full(len(rows), log_time_ns, np.int64)
        self._with_writer(lambda writer: writer.write_many(self._channels[topic], times, rows))
        self.recorded += len(rows) if self.on else 0

    def flush(self) -> None:
        """Write buffered messages to the disk."""
        self._with_writer(lambda writer: writer.flush())

    def close(self) -> None:
        """Finish the file."""
        self._with_writer(lambda writer: writer.close())
        self._writer = None

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


def _writer(path: Path, report: Callable[[str], None]) -> "McapWriter":
    """A writer of a file; a recording that the file contains is kept, and the log names both files."""
    try:
        from leg_wear_monitor.recordings.mcap_file import McapWriter
    except ImportError as error:
        raise LegWearError(f"record.path: {error}; pip install 'leg_wear_monitor[bags]'") from error
    earlier = _move_aside(path)
    writer = McapWriter(path)
    report(f"recording to {path}" + (f"; the earlier recording is kept as {earlier}" if earlier else ""))
    return writer


def _move_aside(path: Path) -> Path | None:
    """Rename a file that is not empty by the time of its last change (UTC); its new name.

    A restart with the same parameters must not delete the earlier recordings.
    """
    try:
        if not path.is_file() or not path.stat().st_size:
            return None
        changed = datetime.fromtimestamp(path.stat().st_mtime, UTC)
        stem = f"{path.stem}-{changed:%Y%m%dT%H%M%SZ}"
        names = (f"{stem}{again}{path.suffix}" for again in chain([""], (f"-{n}" for n in count(2))))
        return path.rename(next(each for each in map(path.with_name, names) if not each.exists()))
    except OSError as error:
        raise LegWearError(f"record.path: {path} cannot be renamed: {error.strerror}") from error


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


# Topic ``~/markers`` of the node; `recordings.leg_markers` makes its messages.


class MarkerTopic:
    """``~/markers``, published while wanted and either subscribed to or recorded.

    Parameters
    ----------
    outlets : Outlets
    monitor : WearMonitor
    """

    def __init__(self, outlets: Outlets, monitor: WearMonitor) -> None:
        self._outlets, self._monitor = outlets, monitor
        self._markers = LegMarkers(monitor, self._drawing) if self._is_wanted else None

    def publish(self, reports: Reports) -> None:
        """Publish the markers of reports; without a listener, their content is not kept up to date."""
        if not self._is_wanted:
            self.forget()
            return
        self._markers = self._markers or LegMarkers(self._monitor, self._drawing)
        for outgoing in self._markers.of(reports):
            self._outlets.send(outgoing, time.time_ns())

    def forget(self) -> None:
        """Begin again with the present state, after an operator has changed it."""
        self._markers = None

    @property
    def _is_wanted(self) -> bool:
        return self._monitor.config.publish_markers and self._outlets.wanted(MARKERS)

    @cached_property
    def _drawing(self) -> LegDrawing:
        return LegDrawing(self._monitor.mechanism)
