"""Writes MCAP files of the ros2 profile, with the mcap library."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from leg_wear_monitor.errors import system_asked
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.qos import RELIABLE, Qos
from leg_wear_monitor.recordings.streams import definition

PROFILE, LIBRARY = "ros2", "leg_wear_monitor"


class _Whole:
    """A file that takes each write whole or not at all: earlier chunks stay readable on a full disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with system_asked(path, "cannot be written", error_of=RecordingError):
            self.file = path.open("wb", buffering=0)
        self.has_failed = False

    def tell(self) -> int:
        return self.file.tell()

    def flush(self) -> None:
        """Nothing is buffered."""

    def write(self, data: bytes) -> None:
        begin, left = self.file.tell(), memoryview(data)
        try:
            while left:
                left = left[self.file.write(left) :]
        except OSError as error:
            self.has_failed = True
            with suppress(OSError):  # a device cannot be truncated
                self.file.truncate(begin)
            raise RecordingError(str(self._path), "", f"cannot be written: {error.strerror}") from error


class McapWriter:
    """An MCAP file. Flushed messages stay readable if the process dies.

    Parameters
    ----------
    path : str or pathlib.Path
        An existing file is overwritten.
    chunk_bytes : int
        Size at which a chunk is written [bytes].

    Raises
    ------
    RecordingError
        If writing to the disk fails, here and in every method that writes. Earlier chunks stay readable;
        the file then ends without an index.
    """

    def __init__(self, path: str | Path, *, chunk_bytes: int = 2**17) -> None:
        self.path = Path(path)
        self._disk = _Whole(self.path)
        output: Any = self._disk
        self._writer = Writer(output, chunk_size=chunk_bytes)
        self._schemas: dict[str, int] = {}
        try:
            self._writer.start(PROFILE, LIBRARY)
        except RecordingError:
            self._disk.file.close()
            raise

    def __enter__(self) -> "McapWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def channel(self, topic: str, type_name: str, qos: Qos = RELIABLE) -> int:
        """Add a channel and return its number.

        Parameters
        ----------
        topic : str
            Full name, with the leading slash.
        type_name : str
            Such as ``sensor_msgs/msg/JointState``.
        qos : Qos
            Quality of service offered by the publisher.
        """
        known = definition(type_name)
        if type_name not in self._schemas:
            text = known.text.encode()
            self._schemas[type_name] = self._writer.register_schema(type_name, "ros2msg", text)
        metadata = {"offered_qos_profiles": qos.text(), "topic_type_hash": known.digest}
        return self._writer.register_channel(topic, "cdr", self._schemas[type_name], metadata)

    def write(self, channel: int, log_time_ns: int, raw: bytes) -> None:
        """Add one serialized message.

        Parameters
        ----------
        channel : int
        log_time_ns : int
            Time of reception [ns].
        raw : bytes
            CDR with its encapsulation header.
        """
        self._writer.add_message(channel, log_time_ns, raw, log_time_ns)

    def write_many(self, channel: int, log_time_ns: NDArray[np.int64], messages: NDArray[np.uint8]) -> None:
        """Add messages of equal length.

        Parameters
        ----------
        channel : int
        log_time_ns : (n,) array of int
            Time of reception; also used as the time of sending [ns].
        messages : (n, bytes) array of uint8
            One message per row.
        """
        data, size = messages.tobytes(), messages.shape[1]
        for k, time_ns in enumerate(np.asarray(log_time_ns).tolist()):
            self._writer.add_message(channel, time_ns, data[k * size : (k + 1) * size], time_ns)

    def flush(self) -> None:
        """Write the current chunk, so that all messages added so far can be read."""
        self._writer.flush()

    def close(self) -> None:
        """Write the remaining messages and the index; no effect if the file is already closed."""
        if self._disk.file.closed:
            return
        try:
            if not self._disk.has_failed:
                self._writer.finish()
        finally:
            self._disk.file.close()
