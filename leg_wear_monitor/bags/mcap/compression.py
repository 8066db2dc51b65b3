"""Decompression that trusts no length and no checksum before it has seen it hold."""

import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import IO

from leg_wear_monitor.bags.findings import DamageError

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LARGEST_MESSAGE = 2**24
_PART = 2**18  # bytes that are read together
_BLOCK = 2**17  # bytes that are expanded together: zstd's own blocks have no more
_LARGEST_WINDOW = 2**27  # bytes a zstd frame may look back; what zstd itself expands unless told otherwise


def expand(data: bytes, compression: str, size: int) -> bytes:
    """Content of a chunk.

    Parameters
    ----------
    data : bytes
    compression : str
    size : int
        Bytes that it should have; no more are expanded, whatever the data claim.

    Raises
    ------
    DamageError
        Where the data are not what their head says.
    """
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

    if compression == "":
        return data[:size]
    if compression == "zstd":
        return _join(expanded(BytesIO(data)), size)
    if compression == "lz4":
        try:
            part: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, size)
        except RuntimeError:
            return b""
        return part
    return b""


def expanded(file: IO[bytes]) -> Iterator[bytes]:
    """Content of a zstd file in parts of bounded size, until it ends or is damaged."""
    import zstandard

    expander = zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW)
    parts = expander.read_to_iter(file, read_size=_PART, write_size=_BLOCK)
    while True:
        try:
            part = next(parts, b"")
        except zstandard.ZstdError:
            return  # whoever reads the content finds that it ends early
        if not part:
            return
        yield part


def check(content: bytes, crc: int) -> None:
    """Compare a chunk's content with its checksum; 0 stands for none.

    Raises
    ------
    DamageError
    """
    if crc and zlib.crc32(content) != crc:
        raise DamageError("does not match its checksum")


def expand_message(data: bytes, most: int) -> bytes:
    """Content of a message that was compressed by itself, other messages as they are; empty where none is.

    Parameters
    ----------
    data : bytes
    most : int
        Bytes that it may have.
    """
    import zstandard

    if not data.startswith(ZSTD_MAGIC):
        return data
    most = min(most, _LARGEST_MESSAGE)
    try:
        if zstandard.frame_content_size(data) > most:
            return b""
    except zstandard.ZstdError:
        return b""
    return _join(expanded(BytesIO(data)), most)


def _join(parts: Iterator[bytes], most: int) -> bytes:
    """Parts in one, as many bytes as asked for."""
    content = bytearray()
    for part in parts:
        content += part[: most - len(content)]
        if len(content) >= most:
            break
    return bytes(content)


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
