"""MCAP files, read and written.

The mcap library defines the records; this module finds the messages of a chunk, because the library makes an
object of each message, and takes ten times as long.
"""

import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import IO

import attrs
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Schema, Statistics
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import Writer
from numpy.typing import NDArray

from leg_wear_monitor.errors import one_line, system_asked
from leg_wear_monitor.recordings.cdr import MESSAGE
from leg_wear_monitor.recordings.findings import (
    Channel,
    DamageError,
    Due,
    Finding,
    Piece,
    RecordingError,
    check_size,
)
from leg_wear_monitor.recordings.streams import RELIABLE, Qos, definition, types

MAGIC = b"\x89MCAP0\r\n"
_UNREADABLE = (
    McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, OverflowError, MemoryError,
    RuntimeError, EOFError,
)  # fmt: skip
"""Errors that the libraries raise over damaged bytes."""

_RECORD = struct.Struct("<BQ")
_HEAD = np.dtype(
    [("channel", "<u2"), ("sequence", "<u4"), ("log_time_ns", "<u8"), ("publish_time_ns", "<u8")]
)
_BYTES_PER_MESSAGE = 400  # memory of decoding one message into a sample [bytes]
_WINDOW = 2**20  # bytes of messages outside of chunks that are read at once
_LATEST_NS = 2**63 - 1
_DEFINITIONS = (Opcode.SCHEMA, Opcode.CHANNEL)


@attrs.define
class _Segment:
    """A chunk, or messages outside of chunks.

    Attributes
    ----------
    at, stored : int
        Offset and size in the file [bytes].
    is_chunk : bool
    start_ns : int
        First log time [ns].
    """

    at: int
    stored: int
    is_chunk: bool
    start_ns: int


class McapFile:
    """An open MCAP file; its faults are listed in `findings`.

    The reader first reads the heads of all records. They replace the index, so a file without an index needs
    no special treatment.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : binary file
        Seekable.

    Raises
    ------
    RecordingError
        If the file is not an MCAP file.
    """

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        self.path, self._file = path, file
        self.size = file.seek(0, 2)
        self.findings: list[Finding] = []
        self._read = 0
        self._counts: dict[int, int] | None = None
        self._segments: list[_Segment] = []
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, ChannelRecord] = {}
        file.seek(0)
        if (start := file.read(len(MAGIC))) != MAGIC:
            fault = f"begins with {start!r}" if start else "is empty"
            fault = f"{fault}. Expected an MCAP file, which begins with {MAGIC!r}"
            raise RecordingError(str(path), "", fault)
        self._scan()
        schemas = {channel.schema_id for channel in self._channels.values()}
        if not self._channels or not schemas <= {0, *self._schemas}:
            self._search_chunks()
        self._segments.sort(key=lambda segment: (segment.start_ns, segment.at))

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels by channel number, with the names of their schemas."""
        found = {}
        for number, one in self._channels.items():
            schema = self._schemas.get(one.schema_id)
            found[number] = Channel(one.topic, schema.name if schema else "", one.message_encoding)
        return found

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels, for lazy loading; damaged parts are skipped and become findings.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        codes = np.zeros(2**16, np.int64)
        codes[list(types)] = list(types.values())
        for segment in self._segments:
            yield segment.start_ns, partial(self._piece, segment, codes)
        expected = self._read if self._counts is None else sum(self._counts.get(one, 0) for one in types)
        if expected != self._read:
            self._find(f"{self._read} messages could be read of the {expected} that it counts")

    def _scan(self) -> None:
        """Find chunks, messages outside of chunks, and definitions, up to the footer or a cut."""
        at, opcode = len(MAGIC), 0
        try:
            while opcode != Opcode.FOOTER:
                self._file.seek(at)
                opcode, length = _RECORD.unpack(self._file.read(_RECORD.size))
                end = at + _RECORD.size + length
                if not opcode or end > self.size:
                    raise EOFError
                self._add(opcode, at, end)
                at = end
        except _UNREADABLE:
            self._find(f"is cut off or damaged at byte {at} of {self.size}: the rest is lost")

    def _add(self, opcode: int, at: int, end: int) -> None:
        """Add a record whose head has just been read."""
        if opcode == Opcode.CHUNK:
            (start_ns,) = struct.unpack("<Q", self._file.read(8))
            self._segments.append(_Segment(at, end - at, True, min(start_ns, _LATEST_NS)))
        elif opcode == Opcode.MESSAGE:
            (head,) = np.frombuffer(self._file.read(_HEAD.itemsize), _HEAD)
            self._add_message(_Segment(at, end - at, False, int(min(head["log_time_ns"], _LATEST_NS))))
        elif opcode in _DEFINITIONS or opcode == Opcode.STATISTICS:
            check_size(end - at)
            self._define(opcode, self._file.read(end - at - _RECORD.size))

    def _define(self, opcode: int, data: bytes) -> None:
        stream = ReadDataStream(BytesIO(data))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = ChannelRecord.read(stream)
            self._channels.setdefault(channel.id, channel)
        else:
            self._counts = Statistics.read(stream).channel_message_counts

    def _search_chunks(self) -> None:
        """Find definitions that are in the chunks only, as in a file without a summary."""
        for segment in self._segments:
            if not segment.is_chunk:
                continue
            try:
                data = self._content(segment)
                opcodes, begins, ends, _ = _records(data)
                for k in np.flatnonzero(np.isin(opcodes, _DEFINITIONS)).tolist():
                    self._define(opcodes[k], data[begins[k] : ends[k]])
            except (DamageError, *_UNREADABLE):  # the reader of the pieces reports it
                continue

    def _add_message(self, one: _Segment) -> None:
        """Add a message outside of chunks to the preceding segment, if that is close and small."""
        last = self._segments[-1] if self._segments else one
        if last is not one and not last.is_chunk and one.at + one.stored - last.at <= _WINDOW:
            last.stored = one.at + one.stored - last.at
            last.start_ns = min(last.start_ns, one.start_ns)
        else:
            self._segments.append(one)

    def _piece(self, segment: _Segment, codes: NDArray[np.int64]) -> Piece | None:
        """Messages of a segment; None if it is damaged."""
        try:
            data = self._content(segment)
            messages = self._messages(segment, data, codes)
        except (DamageError, *_UNREADABLE) as error:
            self._find(f"chunk at byte {segment.at} {one_line(error)}: its messages are lost")
            return None
        self._read += len(messages)
        return Piece(segment.start_ns, np.frombuffer(data, np.uint8), messages, segment.stored)

    def _content(self, segment: _Segment) -> bytes:
        """Records of a segment."""
        check_size(segment.stored)
        self._file.seek(segment.at)
        if not segment.is_chunk:
            return self._file.read(segment.stored)
        stored = self._file.read(segment.stored)
        return self._expanded(Chunk.read(ReadDataStream(BytesIO(stored[_RECORD.size :]))))

    def _expanded(self, chunk: Chunk) -> bytes:
        """Records of a chunk; its size and checksum must be right."""
        try:
            check_size(len(chunk.data) + chunk.uncompressed_size)
            stream, length = get_chunk_data_stream(chunk, validate_crc=True)
            if length != chunk.uncompressed_size:
                raise DamageError(f"contains {length} bytes. Expected {chunk.uncompressed_size}")
            return stream.read(length)
        except _UNREADABLE as error:
            raise DamageError(f"cannot be read: {one_line(error)}") from error

    def _messages(self, segment: _Segment, data: bytes, codes: NDArray[np.int64]) -> NDArray[np.void]:
        """Messages of the requested channels in a segment."""
        opcodes, begins, ends, read = _records(data)
        is_message = (opcodes == Opcode.MESSAGE) & (ends - begins >= _HEAD.itemsize)
        begins, ends = begins[is_message], ends[is_message]
        heads = _heads(np.frombuffer(data, np.uint8), begins)
        wanted = codes[heads["channel"]] != 0
        check_size(segment.stored + len(data) + _BYTES_PER_MESSAGE * int(wanted.sum()))
        messages = np.zeros(int(wanted.sum()), MESSAGE)
        messages["begin"], messages["end"] = begins[wanted] + _HEAD.itemsize, ends[wanted]
        messages["log_time_ns"] = np.minimum(heads["log_time_ns"][wanted], _LATEST_NS)
        messages["type"] = codes[heads["channel"][wanted]]
        if read < len(data):
            rest = len(data) - read
            self._find(f"chunk at byte {segment.at} holds {rest} bytes that are not records: they are lost")
        return messages

    def _find(self, text: str) -> None:
        self.findings.append(Finding(self.path, text))


_Places = NDArray[np.int64]


def _records(data: bytes) -> tuple[_Places, _Places, _Places, int]:
    """Opcode, begin and end of each whole record, and the bytes that these records have."""
    opcodes, begins, ends, at, end = [], [], [], 0, len(data)
    while at + _RECORD.size <= end:
        opcode, length = _RECORD.unpack_from(data, at)
        begin = at + _RECORD.size
        if length > end - begin:
            break
        at = begin + length
        opcodes.append(opcode)
        begins.append(begin)
        ends.append(at)
    return np.array(opcodes, np.int64), np.array(begins, np.int64), np.array(ends, np.int64), at


def _heads(data: NDArray[np.uint8], begins: _Places) -> NDArray[np.void]:
    """Channels and times of messages, by their offsets."""
    raw = data[begins[:, None] + np.arange(_HEAD.itemsize)]
    return np.asarray(np.ascontiguousarray(raw).view(_HEAD).reshape(-1))


# Writing, with the mcap library, of files of the ros2 profile.


PROFILE, LIBRARY = "ros2", "leg_wear_monitor"


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
        If writing to the disk fails, here and in every method that writes. The file is then closed without an
        index; its earlier chunks stay readable.
    """

    def __init__(self, path: str | Path, *, chunk_bytes: int = 2**17) -> None:
        self.path = Path(path)
        with self._asked():
            self._file = self.path.open("wb")
            self._writer = Writer(self._file, chunk_size=chunk_bytes)
            self._writer.start(PROFILE, LIBRARY)
            self._file.flush()
        self._schemas: dict[str, int] = {}

    @contextmanager
    def _asked(self) -> Iterator[None]:
        """Name the file in an error of the disk, after which nothing more is written."""
        try:
            with system_asked(self.path, "cannot be written", error_of=RecordingError):
                yield
        except RecordingError:
            with suppress(AttributeError, OSError):  # it was not opened, or has bytes that do not fit
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
        if type_name not in self._schemas:
            text = definition(type_name).encode()
            self._schemas[type_name] = self._writer.register_schema(type_name, "ros2msg", text)
        digest = types().hash_rihs01(type_name)
        metadata = {"offered_qos_profiles": qos.text(), "topic_type_hash": digest}
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
        with self._asked():
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
        with self._asked():
            for k, time_ns in enumerate(np.asarray(log_time_ns).tolist()):
                self._writer.add_message(channel, time_ns, data[k * size : (k + 1) * size], time_ns)

    def flush(self) -> None:
        """Write the current chunk, so that all messages added so far can be read."""
        with self._asked():
            self._writer.flush()

    def close(self) -> None:
        """Write the remaining messages and the index; no effect if the file is already closed."""
        if not self._file.closed:
            with self._asked():
                self._writer.finish()
                self._file.close()
