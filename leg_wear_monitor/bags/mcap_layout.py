"""Layout of an MCAP file: records, chunks, compression."""

import struct
import zlib
from collections.abc import Iterable, Iterator
from io import BytesIO
from itertools import pairwise
from typing import IO, Any

import attrs
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel as ChannelRecord
from mcap.records import ChunkIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.bags.piece import Channel
from leg_wear_monitor.compiled.kernel import entry, kernel

# Decompression of untrusted data: declared lengths and checksums are verified, sizes are bounded.


ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LARGEST_MESSAGE = 2**24
_PART = 2**18  # bytes per read
_BLOCK = 2**17  # bytes per decompression step: the size limit of a zstd block
_LARGEST_WINDOW = 2**27  # largest accepted window of a zstd frame [bytes]: the default limit of zstd


def expand(data: bytes, compression: str, size: int, is_cut: bool) -> bytes:
    """Decompress the content of a chunk.

    Parameters
    ----------
    data : bytes
    compression : str
    size : int
        Expected size [bytes]; decompression stops there, whatever size the data declare.
    is_cut : bool
        Whether the chunk is truncated: then as much as possible is decompressed.

    Raises
    ------
    DamageError
        If the data do not match the chunk header.
    """
    import lz4.frame

    try:
        if compression == "zstd" and is_cut:
            content = _join(expanded(BytesIO(data)), size)
        elif compression == "zstd":
            declared = zstandard.frame_content_size(data)
            if declared not in (-1, size):
                raise DamageError(f"contains {declared} bytes, expected {size}")
            content = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
        elif compression == "lz4":
            content = lz4.frame.LZ4FrameDecompressor().decompress(data, size if is_cut else size + 1)
        elif compression == "":
            content = data[:size] if is_cut else data
        else:
            raise DamageError(f"has compression {compression!r}, expected zstd, lz4 or none")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise DamageError(f"cannot be decompressed: {error}") from error
    if len(content) != size and not is_cut:
        raise DamageError(f"contains {len(content)} bytes, expected {size}")
    return content


def expanded(file: IO[bytes]) -> Iterator[bytes]:
    """Decompress a zstd file in parts of bounded size, up to its end or the first damage."""
    expander = zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW)
    parts = expander.read_to_iter(file, read_size=_PART, write_size=_BLOCK)
    while True:
        try:
            part = next(parts, b"")
        except zstandard.ZstdError:
            return  # the reader of the content detects the truncation
        if not part:
            return
        yield part


def expand_message(data: bytes, most: int) -> bytes:
    """Decompress a message, up to a number of bytes; an uncompressed message is returned unchanged."""
    return _join(expanded(BytesIO(data)), min(most, _LARGEST_MESSAGE)) if data[:4] == ZSTD_MAGIC else data


def _join(parts: Iterator[bytes], most: int) -> bytes:
    """Concatenate parts up to a number of bytes."""
    content = bytearray()
    for part in parts:
        content += part[: most - len(content)]
        if len(content) >= most:
            break
    return bytes(content)


# Records of an MCAP chunk, found in one pass over its bytes (https://mcap.dev/spec).


SCHEMA, CHANNEL, MESSAGE_RECORD, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
ATTACHMENT, METADATA_RECORD = 0x09, 0x0C
RECORD_HEAD = 9  # opcode and length
_MESSAGE_HEAD = 22  # channel, sequence, log time, publish time

UNKNOWN, IGNORED = 0, -1
"""Roles of a channel beside the codes of streams: not defined in the file, and not asked for."""

_COUNTED = (
    "wanted", "definitions", "unknown_channel", "foreign", "first_log_time_ns", "last_log_time_ns", "read",
)  # fmt: skip
COUNTS = np.dtype([(name, "i8") for name in _COUNTED])
"""What a walk met: messages asked for, schemas and channels, messages of no channel, records of no known
kind, the range of log times of all messages, and how many bytes hold whole records."""


@kernel
def unsigned(data, at, size):
    """Little-endian integer of up to eight bytes; what does not fit into int64 is its largest."""
    value = np.int64(0)
    for i in range(size - 1):
        value |= np.int64(data[at + i]) << (8 * i)
    top = np.int64(data[at + size - 1])
    if size == 8 and top >= 128:
        return np.int64(2**63 - 1)
    return value | top << (8 * (size - 1))


@entry
def walk(data, roles, out_messages, out_definitions, out_counts):
    """Find messages and definitions among records; give what was met.

    Parameters
    ----------
    data : (bytes,) array of uint8
    roles : (65536,) array of int64
        What a channel's messages are, by its number: `UNKNOWN`, `IGNORED` or a stream's code.
    out_messages : (any,) array of MESSAGE
        Messages asked for, as many as fit; empty to count them only.
    out_definitions : (any,) array of int64
        Positions of schemas and channels, as many as fit.
    out_counts : (1,) array of COUNTS
    """
    at, end, counts = np.int64(0), np.int64(data.shape[0]), out_counts[0]
    counts["wanted"], counts["definitions"], counts["unknown_channel"], counts["foreign"] = 0, 0, 0, 0
    counts["first_log_time_ns"], counts["last_log_time_ns"] = 2**63 - 1, -1
    while at + RECORD_HEAD <= end:
        opcode, length = data[at], unsigned(data, at + 1, 8)
        body = at + RECORD_HEAD
        if length > end - body or opcode in (CHUNK, DATA_END):
            break
        if opcode == MESSAGE_RECORD and length >= _MESSAGE_HEAD:
            log_time = unsigned(data, body + 6, 8)
            counts["first_log_time_ns"] = min(counts["first_log_time_ns"], log_time)
            counts["last_log_time_ns"] = max(counts["last_log_time_ns"], log_time)
            role = roles[unsigned(data, body, 2)]
            if role == UNKNOWN:
                counts["unknown_channel"] += 1
            elif role != IGNORED:
                if counts["wanted"] < out_messages.shape[0]:
                    message = out_messages[counts["wanted"]]
                    message["begin"], message["end"] = body + _MESSAGE_HEAD, body + length
                    message["log_time_ns"], message["type"] = log_time, role
                    message["publish_time_ns"] = unsigned(data, body + 14, 8)
                counts["wanted"] += 1
        elif opcode in (SCHEMA, CHANNEL):
            if counts["definitions"] < out_definitions.shape[0]:
                out_definitions[counts["definitions"]] = at
            counts["definitions"] += 1
        # rosbag2 writes metadata beside the messages of a file without chunks; private records stand anywhere
        elif opcode not in (ATTACHMENT, METADATA_RECORD) and opcode < 0x80:
            counts["foreign"] += 1
        at = body + length
    counts["read"] = at


# Locations of the messages in an MCAP file, from its index; without a sound one, see `mcap_file.by_scan`.


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
class Segment:
    """Contiguous records: a chunk, or messages outside of chunks.

    Attributes
    ----------
    at, data_at, stored : int
        File offset of the segment, file offset of its content, stored size of its content [bytes].
    size, compression, crc : int, str, int
        Uncompressed size [bytes], compression and checksum of the content; 0 means no checksum.
    start_ns : int
        First log time declared by the file [ns].
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
    losses : list of str
    """

    segments: list[Segment]
    channels: dict[int, Channel]
    counts: dict[int, int] | None = None
    data_end: int = 0
    data_crc: int = 0
    losses: list[str] = attrs.Factory(list)


def by_index(file: IO[bytes], size: int, budget: Budget) -> Layout | None:
    """Layout from the summary of a file; None if there is no reliable summary."""
    records = _summary(file, size, budget.part_limit // _OF_A_SUMMARY)
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
        at = index.chunk_start_offset
        if at + index.chunk_length > size:
            return None
        try:
            head = chunk_head(file, at, size)
            if (head.stored, head.size, head.compression) != (
                index.compressed_size,
                index.uncompressed_size,
                index.compression,
            ):
                raise DamageError("differs from the index")
        except DamageError as error:
            layout.losses.append(f"chunk at byte {at} {error}: its messages are lost")
        else:
            layout.segments.append(attrs.evolve(head, start_ns=index.message_start_time))
    return layout


def _overlap(indexes: list[ChunkIndex]) -> bool:
    """Whether chunks overlap; a malicious index could list one chunk a million times."""
    spans = sorted((index.chunk_start_offset, index.chunk_length) for index in indexes)
    return any(at + length > after for (at, length), (after, _) in pairwise(spans))


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
        start, _, expanded, crc = _CHUNK_HEAD.unpack_from(head, RECORD_HEAD)
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
    start = min(start, 2**63 - 1)  # keeps a damaged time within the range of a stamp
    return Segment(at, data_at, available, expanded, compression, crc, start, available < stored)


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
