"""Locations of the messages in an MCAP file, from its index; without a sound index, see `salvage`."""

import struct
import zlib
from collections.abc import Iterable, Iterator
from io import BytesIO
from itertools import pairwise
from typing import IO, Any

import attrs
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel as ChannelRecord
from mcap.records import ChunkIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.bags.mcap.records import CHANNEL, CHUNK, DATA_END, RECORD_HEAD, SCHEMA

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
UNREADABLE = (McapError, struct.error, UnicodeDecodeError, ValueError, KeyError, OverflowError, MemoryError)
"""What the library raises over records that are damaged."""

_OF_A_SUMMARY = 16  # memory of the parsed summary records per byte of the summary
_OF_USE = (ChannelRecord, ChunkIndex, Schema, Statistics)
_CHUNK_HEAD = struct.Struct("<QQQI")
_FOOTER = struct.Struct("<BQQQI")
_DATA_END = struct.Struct("<BQI")


@attrs.frozen
class Channel:
    """Topic, type and schema of a channel in one file; unknown texts are empty."""

    topic: str
    type: str
    encoding: str
    definition: str
    definition_encoding: str


@attrs.frozen
class Segment:
    """Contiguous records: a chunk, or messages outside of chunks.

    Attributes
    ----------
    at, data_at, stored : int
        File offset of the segment, file offset of its content, stored size of its content [bytes].
    size, compression, crc : int, str, int
        Uncompressed size [bytes], compression and checksum of the content; 0 means no checksum.
    start_ns, end_ns : int
        First and last log time declared by the file [ns].
    cut : bool
        Whether the file ends inside the segment.
    """

    at: int
    data_at: int
    stored: int
    size: int
    compression: str = ""
    crc: int = 0
    start_ns: int = 0
    end_ns: int = 0
    cut: bool = False


@attrs.define
class Layout:
    """Contents of a file and their locations.

    Attributes
    ----------
    segments : list of Segment
        In order of log time.
    channels : dict
        Channels by channel number.
    counts : dict, optional
        Expected number of messages by channel; None if the file does not declare it.
    data_end, data_crc : int
        End of the data section [bytes], and its checksum; 0 if there is none.
    losses, notes : list of str
    """

    segments: list[Segment]
    channels: dict[int, Channel]
    counts: dict[int, int] | None = None
    data_end: int = 0
    data_crc: int = 0
    losses: list[str] = attrs.Factory(list)
    notes: list[str] = attrs.Factory(list)


def by_index(file: IO[bytes], size: int, budget: Budget) -> Layout | None:
    """Layout from the summary of a file; None if there is no reliable summary."""
    records = _summary(file, size, budget.at_once // _OF_A_SUMMARY)
    if records is None:
        return None
    layout = Layout([], channels_of(records))
    layout.data_end, layout.data_crc = _data_end(file, _footer(file, size)[0])
    indexes = [record for record in records if isinstance(record, ChunkIndex)]
    statistics = next((record for record in records if isinstance(record, Statistics)), None)
    if statistics is not None:
        layout.counts = statistics.channel_message_counts
        if statistics.chunk_count != len(indexes) or statistics.channel_count > len(layout.channels):
            return None
    if not layout.channels or (not indexes and (statistics is None or statistics.message_count)):
        return None
    if _overlap(indexes):
        return None
    for index in sorted(indexes, key=lambda index: (index.message_start_time, index.chunk_start_offset)):
        at, head = index.chunk_start_offset, RECORD_HEAD + _CHUNK_HEAD.size + 4 + len(index.compression) + 8
        if at + index.chunk_length > size:
            return None
        layout.segments.append(_indexed(index, at + head))
    return layout


def _overlap(indexes: list[ChunkIndex]) -> bool:
    """Whether chunks overlap; a malicious index could list one chunk a million times."""
    spans = sorted((index.chunk_start_offset, index.chunk_length) for index in indexes)
    return any(at + length > after for (at, length), (after, _) in pairwise(spans))


def _indexed(index: ChunkIndex, data_at: int) -> Segment:
    return Segment(
        at=index.chunk_start_offset,
        data_at=data_at,
        stored=index.compressed_size,
        size=index.uncompressed_size,
        compression=index.compression,
        start_ns=index.message_start_time,
        end_ns=index.message_end_time,
    )


def _footer(file: IO[bytes], size: int) -> tuple[int, int]:
    """Start of the summary (0 if there is none) and its checksum."""
    file.seek(max(0, size - _FOOTER.size - len(MAGIC)))
    end = file.read()
    if len(end) != _FOOTER.size + len(MAGIC) or not end.endswith(MAGIC):
        return 0, 0
    opcode, length, start, _, crc = _FOOTER.unpack_from(end)
    return (start, crc) if (opcode, length) == (0x02, 20) and start < size else (0, 0)


def _summary(file: IO[bytes], size: int, most: int) -> list[Any] | None:
    """Relevant records of the summary; None if it is absent, damaged or larger than `most` bytes."""
    start, crc = _footer(file, size)
    if not start or size - start > most:
        return None
    file.seek(start)
    data = file.read()
    if crc and zlib.crc32(data[: -len(MAGIC) - 4]) != crc:
        return None
    try:
        # without emit_chunks, a chunk record in the summary would be decompressed without a size limit
        reader = StreamReader(BytesIO(data), skip_magic=True, record_size_limit=len(data), emit_chunks=True)
        return [record for record in reader.records if isinstance(record, _OF_USE)]
    except UNREADABLE:
        return None


def _data_end(file: IO[bytes], summary_start: int) -> tuple[int, int]:
    """End and checksum of the data section; zeros if no data-end record precedes the summary."""
    at = summary_start - _DATA_END.size
    if at < len(MAGIC):
        return 0, 0
    file.seek(at)
    opcode, length, crc = _DATA_END.unpack(file.read(_DATA_END.size))
    return (at, crc) if (opcode, length) == (DATA_END, 4) else (0, 0)


def chunk_head(file: IO[bytes], at: int, size: int) -> Segment:
    """Segment described by a chunk header.

    Raises
    ------
    DamageError
        If there is no chunk at this offset.
    """
    file.seek(at)
    head = file.read(RECORD_HEAD + _CHUNK_HEAD.size + 4 + 16 + 8)
    try:
        opcode, length = HEAD.unpack_from(head)
        start, end, expanded, crc = _CHUNK_HEAD.unpack_from(head, RECORD_HEAD)
        text_at = RECORD_HEAD + _CHUNK_HEAD.size + 4
        (text,) = struct.unpack_from("<I", head, text_at - 4)
        if opcode != CHUNK or text > 16:
            raise DamageError("is not a chunk")
        compression = head[text_at : text_at + text].decode("ascii")
        (stored,) = struct.unpack_from("<Q", head, text_at + text)
    except (struct.error, UnicodeDecodeError) as error:
        raise DamageError("is not a chunk") from error
    data_at = at + text_at + text + 8
    if stored != length - (data_at - at - RECORD_HEAD):
        raise DamageError("has lengths that contradict each other")
    available = max(0, min(stored, size - data_at))
    limit = 2**63 - 1  # keeps a damaged time within the range of a stamp
    return Segment(
        at,
        data_at,
        available,
        expanded,
        compression,
        crc,
        min(start, limit),
        min(end, limit),
        available < stored,
    )


def channels_of(records: Iterable[Any]) -> dict[int, Channel]:
    """Channels by channel number, with the names and definitions of their schemas."""
    records = list(records)
    schemas = {record.id: record for record in records if isinstance(record, Schema)}
    channels = {}
    for record in records:
        if isinstance(record, ChannelRecord):
            schema = schemas.get(record.schema_id, Schema(0, b"", "", ""))
            definition = schema.data.decode("utf-8", "replace")
            channels[record.id] = Channel(
                record.topic, schema.name, record.message_encoding, definition, schema.encoding
            )
    return channels


def definitions(data: bytes, positions: Iterable[int]) -> Iterator[Any]:
    """Schemas and channels at given positions of a segment; damaged ones are skipped."""
    for at in positions:
        opcode, length = HEAD.unpack_from(data, at)
        stream = ReadDataStream(BytesIO(data[at + RECORD_HEAD : at + RECORD_HEAD + length]))
        try:
            if opcode == SCHEMA:
                yield Schema.read(stream)
            elif opcode == CHANNEL:
                yield ChannelRecord.read(stream)
        except UNREADABLE:
            continue
