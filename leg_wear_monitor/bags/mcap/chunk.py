"""An MCAP chunk under construction, and its serialization as records."""

import struct
import zlib
from typing import Any

import attrs
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.bags.mcap.layout import HEAD

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
