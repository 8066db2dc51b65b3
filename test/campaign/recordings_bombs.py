"""Files of a few kilobytes that claim, or expand to, more than any machine should give them."""

import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard

from campaign import recordings_stored
from campaign.case import Case
from campaign.recordings_damaged import compared

Generator = np.random.Generator
_SIZE = 1_200_000_000  # bytes: more than twice the budget
_MAGIC = b"\x89MCAP0\r\n"
_CHUNK, _MESSAGE, _DATA_END, _FOOTER = 0x06, 0x05, 0x0F, 0x02


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk(data: bytes, compression: str, size: int, stored: int | None = None) -> bytes:
    """A chunk record that claims what it is told to."""
    name = compression.encode()
    head = (
        struct.pack("<QQQII", recordings_stored.START_NS, recordings_stored.START_NS, size, 0, len(name))
        + name
    )
    length = len(data) if stored is None else stored
    body = head + struct.pack("<Q", length)
    return struct.pack("<BQ", _CHUNK, len(body) + length) + body + data


@cache
def zstd_bomb(says_so: bool) -> bytes:
    compressor = zstandard.ZstdCompressor(level=1)
    part = bytes(2**22)
    parts, left = [], _SIZE
    writer = compressor.compressobj(size=_SIZE) if says_so else compressor.compressobj()
    while left:
        parts.append(writer.compress(part[: min(left, len(part))]))
        left -= min(left, len(part))
    return b"".join([*parts, writer.flush()])


@cache
def lz4_bomb() -> bytes:
    part, left = bytes(2**22), _SIZE
    with lz4.frame.LZ4FrameCompressor() as compressor:
        parts = [compressor.begin()]
        while left > 0:
            parts.append(compressor.compress(part))
            left -= len(part)
        return b"".join([*parts, compressor.flush()])


@cache
def body() -> bytes:
    """A sound file up to the end of its data."""
    name, files = recordings_stored.stored()["mcap, no index"]
    content = files[name]
    return content[: content.rindex(struct.pack("<BQ", _DATA_END, 4))]


def closed(content: bytes, summary: int = 0) -> bytes:
    """Close a file without a summary, or with a footer that points anywhere."""
    end = record(_DATA_END, bytes(4)) + record(_FOOTER, struct.pack("<QQI", summary, 0, 0))
    return content + end + _MAGIC


def in_a_chunk(compression: str, data: bytes, size: int, is_cut: bool) -> bytes:
    """A sound recording with a bomb in its last chunk."""
    if is_cut:
        return body() + chunk(data[: len(data) * 9 // 10], compression, size, stored=len(data))
    return closed(body() + chunk(data, compression, size))


def _chunk_bomb(rng: Generator) -> tuple[str, str, bytes]:
    compression = ("zstd", "zstd", "lz4")[int(rng.integers(3))]
    data = lz4_bomb() if compression == "lz4" else zstd_bomb(bool(rng.integers(2)))
    size = (_SIZE, 50_000_000, 2**31, 2**63, 0)[int(rng.integers(5))]
    is_cut = bool(rng.integers(2))
    text = f"{compression} chunk that claims {size} bytes and has {_SIZE}{', cut' if is_cut else ''}"
    return text, "x.mcap", in_a_chunk(compression, data, size, is_cut)


def _file_bomb(rng: Generator) -> tuple[str, str, bytes]:
    kind = (".mcap", ".db3")[int(rng.integers(2))]
    says_so = bool(rng.integers(2))
    return f"{kind}.zstd of {_SIZE} bytes", f"x{kind}.zstd", zstd_bomb(says_so)


def _sparse(rng: Generator) -> tuple[str, str, bytes]:
    size = int(rng.integers(2**31, 2**34))
    opcode = (_MESSAGE, _CHUNK, 0x03, 0x09, 0x0B)[int(rng.integers(5))]
    head = struct.pack("<BQ", opcode, size)
    if opcode == _CHUNK:
        head = chunk(b"", "", size - 32, stored=size - 32)
    return f"hole of {size} bytes in a record {opcode:#x}", f"x.mcap+{size}", body() + head


def _footer(rng: Generator) -> tuple[str, str, bytes]:
    content = body()
    at = int(rng.integers(len(content)))
    return f"footer that points to byte {at}", "x.mcap", closed(content, at)


def _many_messages(rng: Generator) -> tuple[str, str, bytes]:
    """Small messages without end in one chunk: each costs more than its bytes."""
    number = int(rng.integers(1_000_000, 4_000_000))
    channel = int(rng.integers(3))
    one = record(_MESSAGE, struct.pack("<HIQQ", channel, 0, recordings_stored.START_NS, 0))
    data = zstandard.compress(one * number)
    size = len(one) * number
    return f"{number} empty messages in a chunk", "x.mcap", closed(body() + chunk(data, "zstd", size))


def _message_bombs(rng: Generator) -> tuple[str, str, bytes]:
    """Each message a bomb by itself, in a bag that is compressed message by message."""
    bomb = zstandard.compress(bytes(2**24)) if rng.integers(2) else zstd_bomb(bool(rng.integers(2)))
    bomb = bomb[: 40_000 if len(bomb) > 40_000 else len(bomb)]
    message = record(_MESSAGE, struct.pack("<HIQQ", 1, 0, recordings_stored.START_NS, 0) + bomb)
    data = message * (4_000_000 // len(message))
    return (
        f"message of {len(bomb)} bytes that expands",
        "bag/x.mcap",
        closed(body() + chunk(data, "", len(data))),
    )


_BOMBS: tuple[Callable[[Generator], tuple[str, str, bytes]], ...] = (
    _chunk_bomb, _file_bomb, _sparse, _footer, _many_messages, _message_bombs, _chunk_bomb, _sparse
)  # fmt: skip

_BY_MESSAGE = """rosbag2_bagfile_information:
  relative_file_paths: [x.mcap]
  compression_mode: MESSAGE
"""


def bomb(seed: int) -> Case:
    """A case of a bomb; memory is what counts, and that the sound part is read or the whole refused."""
    rng = np.random.default_rng(seed)
    what, name, content = _BOMBS[seed % len(_BOMBS)](rng)
    name, _, size = name.partition("+")

    def prepare(directory: Path) -> None:
        files = {name: content}
        if "/" in name:
            files["bag/metadata.yaml"] = _BY_MESSAGE.encode()
        recordings_stored.lay_out(directory, files)
        if size:
            with (directory / name).open("r+b") as file:
                file.truncate(len(content) + int(size))

    return Case(
        description=f"bomb: {what}",
        prepare=prepare,
        run=lambda directory: compared(directory / name.split("/")[0]),
        memory_mb=560.0,
    )
