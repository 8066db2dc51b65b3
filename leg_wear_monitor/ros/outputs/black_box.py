"""MCAP recording of all messages the node receives and publishes; its replay reproduces the live run."""

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError

if TYPE_CHECKING:
    from leg_wear_monitor.bags.mcap.writer import McapWriter
    from leg_wear_monitor.messages.qos import Qos


class BlackBox:
    """Optional recording: without a path, or after a disk failure, nothing is recorded.

    Parameters
    ----------
    path : str
        MCAP file; empty disables the recording.

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

    def __init__(self, path: str) -> None:
        self.fault, self.recorded = "", 0
        self._writer = _writer(path) if path else None
        self._channels: dict[str, int] = {}

    @property
    def on(self) -> bool:
        """Whether messages are recorded."""
        return self._writer is not None

    def add_topic(self, topic: str, kind: str, qos: "Qos") -> None:
        """Register a topic by its full name and type."""
        if self._writer is not None:
            self._channels[topic] = self._writer.channel(topic, kind, qos)

    def write(self, topic: str, log_time_ns: int, raw: bytes) -> None:
        """Record a message."""
        if self._writer is None:
            return
        try:
            self._writer.write(self._channels[topic], log_time_ns, raw)
            self.recorded += 1
        except LegWearError as error:
            self._fail(error)

    def write_many(self, topic: str, log_time_ns: int, rows: NDArray[np.uint8]) -> None:
        """Record messages of equal length, (n, bytes)."""
        if self._writer is None:
            return
        try:
            stamps = np.full(len(rows), log_time_ns, np.int64)
            self._writer.write_many(self._channels[topic], stamps, rows)
            self.recorded += len(rows)
        except LegWearError as error:
            self._fail(error)

    def flush(self) -> None:
        """Write buffered messages to the disk."""
        if self._writer is not None:
            try:
                self._writer.flush()
            except LegWearError as error:
                self._fail(error)

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            try:
                self._writer.close()
            except LegWearError as error:
                self._fail(error)
            self._writer = None

    def _fail(self, error: LegWearError) -> None:
        """Stop recording: written data stay readable, and a disk failure must not stop the monitor."""
        self.fault, writer, self._writer = str(error), self._writer, None
        if writer is not None:
            with suppress(LegWearError):  # already reported
                writer.close()


def _writer(path: str) -> "McapWriter":
    try:
        from leg_wear_monitor.bags.mcap.writer import McapWriter
    except ImportError as error:
        raise LegWearError(f"record.path: {error}; pip install 'leg_wear_monitor[bags]'") from error
    return McapWriter(path)
