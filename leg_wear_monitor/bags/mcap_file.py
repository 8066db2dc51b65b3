"""MCAP files, read by the mcap library: its index where there is one, else its reader of streams.

The messages of a chunk are found here: the library makes an object of each, and takes ten times as long.
"""

import struct
import zlib
from collections.abc import Iterable, Iterator
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import attrs
import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import FOOTER_SIZE, SeekingReader
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, DataEnd, Footer, Message, Schema
from mcap.stream_reader import MAGIC_SIZE, StreamReader, get_chunk_data_stream
from mcap.summary import Summary
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.piece import Channel, Due, Piece
from leg_wear_monitor.messages.cdr import MESSAGE

MAGIC = b"\x89MCAP0\r\n"
_UNREADABLE = (
    McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, OverflowError, MemoryError,
    RuntimeError, EOFError,
)  # fmt: skip
"""What the libraries raise over damaged bytes."""

_RECORD = struct.Struct("<BQ")
_HEAD = np.dtype(
    [("channel", "<u2"), ("sequence", "<u4"), ("log_time_ns", "<u8"), ("publish_time_ns", "<u8")]
)
_BYTES_PER_MESSAGE = 400  # memory of decoding one message into a sample [bytes]
_BYTES_PER_INDEX = 16  # memory of the parsed summary per byte of it
_WINDOW = 2**20  # bytes of messages outside of chunks that are read at once
_LATEST_NS = 2**63 - 1


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

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : binary file
        Seekable.
    budget : Budget

    Raises
    ------
    RecordingError
        If the file is empty or is not an MCAP file.
    """

    def __init__(self, path: Path, file: IO[bytes], budget: Budget) -> None:
        self.path, self._file, self._budget = path, file, budget
        self.size = file.seek(0, 2)
        self.findings: list[Finding] = []
        self._read, self._unchecked = 0, 0
        self._counts: dict[int, int] | None = None
        self._segments: list[_Segment] = []
        self._definitions: dict[tuple[type, int], Any] = {}
        file.seek(0)
        start = file.read(MAGIC_SIZE)
        if not self.size:
            raise RecordingError(str(path), "", "is empty, expected an MCAP file")
        if start != MAGIC:
            fault = f"begins with {start!r}, expected {MAGIC!r}: is not an MCAP file"
            raise RecordingError(str(path), "", fault)
        summary = self._summary()
        if summary is not None and _is_complete(summary):
            self._take(summary)
        else:
            self._scan()
        self._segments.sort(key=lambda segment: (segment.start_ns, segment.at))
        self.channels = _channels(self._definitions.values())

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
            yield Due(segment.start_ns, partial(self._piece, segment, codes))
        expected = self._read if self._counts is None else sum(self._counts.get(one, 0) for one in types)
        if expected != self._read:
            self._find(f"{self._read} messages could be read of the {expected} that it counts")
        if self._unchecked:
            text = f"has no checksum for {self._unchecked} of {len(self._segments)} chunks"
            self._find(f"{text}: a damaged number in them would not be detected", Severity.NOTE)

    def _summary(self) -> Summary | None:
        """The index, or None if there is none that can be relied on."""
        try:
            self._file.seek(-(FOOTER_SIZE + MAGIC_SIZE), 2)
            end = self._file.read()
            opcode, _ = _RECORD.unpack_from(end)
            if opcode != Opcode.FOOTER or not end.endswith(MAGIC):
                return None
            footer = Footer.read(ReadDataStream(BytesIO(end[_RECORD.size :])))
            length = self.size - footer.summary_start
            if not footer.summary_start or not 0 < length <= self._budget.part_limit // _BYTES_PER_INDEX:
                return None
            self._file.seek(footer.summary_start)
            checked = self._file.read(length - MAGIC_SIZE - 4)
            if footer.summary_crc and zlib.crc32(checked) != footer.summary_crc:
                return None
            self._file.seek(0)
            return SeekingReader(self._file, record_size_limit=self.size).get_summary()
        except (*_UNREADABLE, OSError):
            return None

    def _take(self, summary: Summary) -> None:
        """Take what the index says."""
        self._definitions |= {(Schema, number): one for number, one in summary.schemas.items()}
        self._definitions |= {(ChannelRecord, number): one for number, one in summary.channels.items()}
        if summary.statistics is not None:
            self._counts = dict(summary.statistics.channel_message_counts)
        for index in summary.chunk_indexes:
            start_ns = min(index.message_start_time, _LATEST_NS)
            self._segments.append(_Segment(index.chunk_start_offset, index.chunk_length, True, start_ns))

    def _scan(self) -> None:
        """Read all records from the first one on, as far as they can be read."""
        self._file.seek(0)
        reader = StreamReader(
            self._file, emit_chunks=True, validate_crcs=True, record_size_limit=self._budget.part_limit
        )
        at, is_ended = MAGIC_SIZE, False
        try:
            for record in reader.records:
                end = self._file.tell()
                if isinstance(record, Chunk):
                    self._add_chunk(record, end)
                elif isinstance(record, Message):
                    length = _RECORD.size + _HEAD.itemsize + len(record.data)
                    self._add_message(_Segment(end - length, length, False, min(record.log_time, _LATEST_NS)))
                elif isinstance(record, Schema | ChannelRecord):
                    self._definitions.setdefault((type(record), record.id), record)
                at, is_ended = end, isinstance(record, DataEnd)
                if is_ended:
                    break
        except _UNREADABLE as error:
            what = _one_line(error)
            if self._file.tell() >= self.size:
                what = "the recording was cut off before its closing records"
            self._find(f"is lost from byte {at} of {self.size} on: {what}")
            return
        if not self._definitions:
            return
        self._find("has no index, or a damaged one: read from start to end", Severity.NOTE)

    def _add_chunk(self, chunk: Chunk, end: int) -> None:
        """Add a chunk with its definitions and its first log time."""
        length = len(chunk.data) + len(chunk.compression) + 49
        segment = _Segment(end - length, length, True, min(chunk.message_start_time, _LATEST_NS))
        self._segments.append(segment)
        try:
            data = self._expanded(chunk)
        except DamageError:  # the reader of the pieces reports it
            return
        opcodes, begins, ends, _ = _records(data)
        for opcode, kind in ((Opcode.SCHEMA, Schema), (Opcode.CHANNEL, ChannelRecord)):
            for k in np.flatnonzero(opcodes == opcode).tolist():
                record: Any = kind.read(ReadDataStream(BytesIO(data[begins[k] : ends[k]])))
                self._definitions.setdefault((kind, record.id), record)
        heads = _heads(np.frombuffer(data, np.uint8), begins[opcodes == Opcode.MESSAGE])
        if len(heads):
            segment.start_ns = int(min(heads["log_time_ns"].min(), _LATEST_NS))

    def _add_message(self, one: _Segment) -> None:
        """Add a message outside of chunks to the segment before it, if that is near and small."""
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
            self._find(f"chunk at byte {segment.at} {_one_line(error)}: its messages are lost")
            return None
        self._read += len(messages)
        return Piece(segment.start_ns, np.frombuffer(data, np.uint8), messages, segment.stored)

    def _content(self, segment: _Segment) -> bytes:
        """Records of a segment."""
        self._budget.check(segment.stored)
        self._file.seek(segment.at)
        if not segment.is_chunk:
            return self._file.read(segment.stored)
        stored = self._file.read(segment.stored)
        opcode, length = _RECORD.unpack_from(stored)
        if opcode != Opcode.CHUNK or length != len(stored) - _RECORD.size:
            raise DamageError("is not the chunk that the index has")
        chunk = Chunk.read(ReadDataStream(BytesIO(stored[_RECORD.size :])))
        self._unchecked += not chunk.uncompressed_crc
        return self._expanded(chunk)

    def _expanded(self, chunk: Chunk) -> bytes:
        """Records of a chunk, whose size and checksum must be right."""
        try:
            size = _declared(chunk)
            self._budget.check(len(chunk.data) + max(size, chunk.uncompressed_size))
            stream, length = get_chunk_data_stream(chunk, validate_crc=True)
            if length != chunk.uncompressed_size:
                raise DamageError(f"contains {length} bytes, expected {chunk.uncompressed_size}")
            return stream.read(length)
        except _UNREADABLE as error:
            raise DamageError(f"cannot be read: {_one_line(error)}") from error

    def _messages(self, segment: _Segment, data: bytes, codes: NDArray[np.int64]) -> NDArray[np.void]:
        """Messages of the requested channels in a segment."""
        opcodes, begins, ends, read = _records(data)
        is_message = (opcodes == Opcode.MESSAGE) & (ends - begins >= _HEAD.itemsize)
        begins, ends = begins[is_message], ends[is_message]
        heads = _heads(np.frombuffer(data, np.uint8), begins)
        wanted = codes[heads["channel"]] != 0
        self._budget.check(segment.stored + len(data) + _BYTES_PER_MESSAGE * int(wanted.sum()))
        messages = np.zeros(int(wanted.sum()), MESSAGE)
        messages["begin"], messages["end"] = begins[wanted] + _HEAD.itemsize, ends[wanted]
        for name in ("log_time_ns", "publish_time_ns"):
            messages[name] = np.minimum(heads[name][wanted], _LATEST_NS)
        messages["type"] = codes[heads["channel"][wanted]]
        if read < len(data):
            rest = len(data) - read
            self._find(f"chunk at byte {segment.at} holds {rest} bytes that are not records: they are lost")
        return messages

    def _find(self, text: str, severity: Severity = Severity.LOSS) -> None:
        self.findings.append(Finding(self.path, text, severity))


def _is_complete(summary: Summary) -> bool:
    """Whether an index has channels, and a chunk for the messages that it counts."""
    has_messages = summary.statistics is None or summary.statistics.message_count > 0
    return bool(summary.channels and (summary.chunk_indexes or not has_messages))


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


def _declared(chunk: Chunk) -> int:
    """Bytes that the compressed content of a chunk declares; 0 if it does not say."""
    if chunk.compression == "zstd":
        return max(0, int(zstandard.frame_content_size(chunk.data)))
    if chunk.compression == "lz4":
        return int(lz4.frame.get_frame_info(chunk.data)["content_size"])
    return 0


def _channels(records: Iterable[Any]) -> dict[int, Channel]:
    """Channels by channel number, with the names and definitions of their schemas."""
    records = list(records)
    schemas = {record.id: record for record in records if isinstance(record, Schema)}
    channels = {}
    for record in records:
        if isinstance(record, ChannelRecord):
            schema = schemas.get(record.schema_id, Schema(0, b"", "", ""))
            text = schema.data.decode("utf-8", "replace")
            channels[record.id] = Channel(
                record.topic, schema.name, record.message_encoding, text, schema.encoding
            )
    return channels


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
