"""Decompression that trusts no length and no checksum before it has seen it hold."""

import zlib
from pathlib import Path
from typing import IO

from leg_wear_monitor.recording.findings import DamageError, RecordingError

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
LARGEST = 2**31
"""Bytes that one chunk may have; a damaged length must not fill the memory."""


def expand(data: bytes, compression: str, size: int) -> bytes:
    """Content of a chunk.

    Raises
    ------
    DamageError
        Where the data are not what their head says.
    """
    if size > LARGEST:
        raise DamageError(f"claims {size} bytes")
    if compression == "zstd":
        content = _zstd(data, size)
    elif compression == "lz4":
        content = _lz4(data, size)
    elif compression == "":
        content = data
    else:
        raise DamageError(f"has compression {compression!r}, expected zstd, lz4 or none")
    if len(content) != size:
        raise DamageError(f"holds {len(content)} bytes, expected {size}")
    return content


def expand_part(data: bytes, compression: str, size: int) -> bytes:
    """As much of a chunk's content as can be had from its first bytes; empty where that is nothing."""
    import lz4.frame
    import zstandard

    if size > LARGEST:
        return b""
    if compression == "":
        return data
    try:
        if compression == "zstd":
            return zstandard.ZstdDecompressor().decompressobj().decompress(data)[:size]
        if compression == "lz4":
            part: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, size)
            return part
    except (zstandard.ZstdError, RuntimeError):
        return b""
    return b""


def check(content: bytes, crc: int) -> None:
    """Compare a chunk's content with its checksum; 0 stands for none.

    Raises
    ------
    DamageError
    """
    if crc and zlib.crc32(content) != crc:
        raise DamageError("does not match its checksum")


def expand_message(data: bytes) -> bytes:
    """Content of a message that was compressed by itself; other messages as they are."""
    import zstandard

    if not data.startswith(ZSTD_MAGIC):
        return data
    try:
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=2**24)
    except zstandard.ZstdError:
        return b""


def expand_file(source: Path, target: IO[bytes]) -> None:
    """Write the content of a file that was compressed as a whole.

    A file that is cut short, or damaged, gives what comes before.

    Raises
    ------
    RecordingError
        If it is no zstd file at all.
    """
    import zstandard

    with source.open("rb") as file:
        if file.read(4) != ZSTD_MAGIC:
            raise RecordingError(str(source), "", "is no zstd file, as its name says")
        file.seek(0)
        expander = zstandard.ZstdDecompressor().decompressobj()
        while not expander.eof and (part := file.read(2**18)):
            try:
                target.write(expander.decompress(part))
            except zstandard.ZstdError:
                break  # the reader finds that its file ends early
    target.flush()


def _zstd(data: bytes, size: int) -> bytes:
    import zstandard

    try:
        said = zstandard.frame_content_size(data)
        if said not in (-1, size):
            raise DamageError(f"holds {said} bytes, expected {size}")
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except zstandard.ZstdError as error:
        raise DamageError(f"cannot be decompressed: {error}") from error


def _lz4(data: bytes, size: int) -> bytes:
    import lz4.frame

    try:
        content: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1)
    except (RuntimeError, EOFError) as error:
        raise DamageError(f"cannot be decompressed: {error}") from error
    return content
