"""Writes MCAP files, chunk by chunk."""

import struct
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Header, Schema, Statistics, SummaryOffset
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap_file import MAGIC
from leg_wear_monitor.errors import system_asked
from leg_wear_monitor.messages.qos import RELIABLE, Qos
from leg_wear_monitor.messages.streams import definition

# An MCAP chunk under construction, and its serialization as records.


HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_TYPE = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time_ns", "<u8"),
        ("publish_time_ns", "<u8"),
    ]
)
_INDEX = np.dtype([("log_time_ns", "<u8"), ("offset", "<u8")])
_HEAD_OF_MESSAGE = _MESSAGE.size - HEAD.size


@attrs.define(eq=False)
class Chunk:
    """Buffered message records, and the offset of each channel's messages within them."""

    content: bytearray = attrs.Factory(bytearray)
    indexes: dict[int, list[NDArray[Any]]] = attrs.Factory(dict)

    def add(self, channel: int, log_time_ns: int, raw: bytes) -> None:
        """Add one message."""
        self._note(channel, log_time_ns, len(self.content))
        length = _HEAD_OF_MESSAGE + len(raw)
        self.content += _MESSAGE.pack(Opcode.MESSAGE, length, channel, 0, log_time_ns, log_time_ns)
        self.content += raw

    def add_many(self, channel: int, log_time_ns: NDArray[np.int64], messages: NDArray[np.uint8]) -> None:
        """Add messages of equal length, one per row."""
        n, size = messages.shape
        heads = np.zeros(n, _MESSAGE_TYPE)
        heads["opcode"], heads["length"], heads["channel"] = Opcode.MESSAGE, _HEAD_OF_MESSAGE + size, channel
        heads["log_time_ns"] = heads["publish_time_ns"] = log_time_ns
        records = np.empty((n, _MESSAGE.size + size), np.uint8)
        records[:, : _MESSAGE.size] = heads.view(np.uint8).reshape(n, -1)
        records[:, _MESSAGE.size :] = messages
        self._note(channel, log_time_ns, len(self.content) + np.arange(n) * records.shape[1])
        self.content += records.tobytes()

    def _note(self, channel: int, log_time_ns: ArrayLike, offset: ArrayLike) -> None:
        """Index messages of a channel: their offsets and log times."""
        times = np.atleast_1d(np.asarray(log_time_ns))
        index = np.empty(len(times), _INDEX)
        index["log_time_ns"], index["offset"] = times, offset
        self.indexes.setdefault(channel, []).append(index)

    def records(self, at: int, compressor: zstandard.ZstdCompressor) -> tuple[ChunkIndex, bytes]:
        """Serialize the chunk and its message indexes; also return its chunk index for the summary.

        Parameters
        ----------
        at : int
            File offset of the chunk [bytes].
        compressor : zstandard.ZstdCompressor
        """
        content = bytes(self.content)
        stored = compressor.compress(content)
        by_channel = {channel: np.concatenate(parts) for channel, parts in self.indexes.items()}
        times = np.concatenate([np.zeros(0, "<u8"), *(each["log_time_ns"] for each in by_channel.values())])
        first, last = (int(times.min()), int(times.max())) if len(times) else (0, 0)
        body = struct.pack("<QQQI", first, last, len(content), zlib.crc32(content))
        body += struct.pack("<I4sQ", 4, b"zstd", len(stored)) + stored
        written = bytearray(HEAD.pack(Opcode.CHUNK, len(body)) + body)
        index = ChunkIndex(
            chunk_start_offset=at,
            chunk_length=len(written),
            compression="zstd",
            compressed_size=len(stored),
            uncompressed_size=len(content),
            message_start_time=first,
            message_end_time=last,
            message_index_offsets={},
            message_index_length=0,
        )
        for channel, entries in by_channel.items():
            index.message_index_offsets[channel] = at + len(written)
            written += HEAD.pack(Opcode.MESSAGE_INDEX, 6 + entries.nbytes)
            written += struct.pack("<HI", channel, entries.nbytes) + entries.tobytes()
        index.message_index_length = len(written) - index.chunk_length
        return index, bytes(written)


# Writer of MCAP files with ROS 2 messages; each chunk is written to disk before the next one begins.
#
# The writer of the mcap library adds one message at a time, which is too slow for a replay, and writes a
# chunk only when it is full. This writer adds many messages of a topic at once and can close a chunk at any
# time. All records other than messages, chunks and their indexes are written with the mcap library.


PROFILE, LIBRARY = "ros2", "leg_wear_monitor"


class McapWriter:
    """An MCAP file of the ros2 profile. Flushed messages stay readable if the process dies.

    Parameters
    ----------
    path : str or pathlib.Path
        An existing file is overwritten.
    chunk_bytes : int
        Size at which a chunk is written [bytes].
    level : int
        Of zstd.

    Raises
    ------
    RecordingError
        If writing to the disk fails, here and in every method that writes. Earlier chunks stay readable and
        writing may be retried; the chunk that could not be written is lost.
    """

    def __init__(self, path: str | Path, *, chunk_bytes: int = 2**17, level: int = 1) -> None:
        self.path = Path(path)
        self._chunk_bytes = chunk_bytes
        self._chunk = Chunk()
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._schemas: dict[str, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._indexes: list[ChunkIndex] = []
        self._counts: dict[int, int] = {}
        with system_asked(path, "cannot be written", error_of=RecordingError):
            self._file = self.path.open("wb", buffering=0)
        self._at = 0
        try:
            self._write(MAGIC + _written(Header(PROFILE, LIBRARY)))
        except RecordingError:
            self._file.close()
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
            schema = Schema(len(self._schemas) + 1, known.text.encode(), "ros2msg", type_name)
            self._schemas[type_name] = schema
            self._chunk.content += _written(schema)
        number = len(self._channels) + 1
        metadata = {"offered_qos_profiles": qos.text(), "topic_type_hash": known.digest}
        channel = Channel(number, topic, "cdr", metadata, self._schemas[type_name].id)
        self._channels[number] = channel
        self._counts[number] = 0
        self._chunk.content += _written(channel)
        return number

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
        self._chunk.add(channel, log_time_ns, raw)
        self._counts[channel] += 1
        if len(self._chunk.content) >= self._chunk_bytes:
            self.flush()

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
        self._chunk.add_many(channel, log_time_ns, messages)
        self._counts[channel] += len(messages)
        if len(self._chunk.content) >= self._chunk_bytes:
            self.flush()

    def flush(self) -> None:
        """Write the current chunk, so that all messages added so far can be read."""
        chunk, self._chunk = self._chunk, Chunk()
        if not chunk.content:
            return
        index, records = chunk.records(self._at, self._compressor)
        self._write(records)
        self._indexes.append(index)

    def close(self) -> None:
        """Write the remaining messages and the summary; no effect if the file is already closed."""
        if self._file.closed:
            return
        try:
            self.flush()
            self._write(_written(DataEnd(0)))
            self._write(self._summary())
        finally:
            self._file.close()

    def _summary(self) -> bytes:
        """Summary section, footer and closing magic bytes."""
        builder, offsets = RecordBuilder(), []
        groups: list[list[Any]] = [
            list(self._schemas.values()),
            list(self._channels.values()),
            [self._statistics()],
            self._indexes,
        ]
        opcodes = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX)
        for opcode, group in zip(opcodes, groups, strict=True):
            start = builder.count
            for record in group:
                record.write(builder)
            if group:
                offsets.append(SummaryOffset(opcode, self._at + start, builder.count - start))
        offsets_at = self._at + builder.count
        for offset in offsets:
            offset.write(builder)
        data: bytes = builder.end()
        crc = zlib.crc32(data + _written(Footer(self._at, offsets_at, 0))[:-4])
        return data + _written(Footer(self._at, offsets_at, crc)) + MAGIC

    def _statistics(self) -> Statistics:
        filled = [index for index in self._indexes if index.message_index_offsets]
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._indexes),
            message_count=sum(self._counts.values()),
            message_end_time=max((index.message_end_time for index in filled), default=0),
            message_start_time=min((index.message_start_time for index in filled), default=0),
            metadata_count=0,
            schema_count=len(self._schemas),
        )

    def _write(self, data: bytes) -> None:
        """Write all data; on failure, remove the part that was written."""
        left = memoryview(data)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            with suppress(OSError):  # a device cannot be truncated
                self._file.truncate(self._at)
                self._file.seek(self._at)
            raise RecordingError(str(self.path), "", f"cannot be written: {error.strerror}") from error
        self._at += len(data)


def _written(record: Any) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()
    return data
