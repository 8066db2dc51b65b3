"""Decompression of untrusted data: declared lengths and checksums are verified, sizes are bounded."""

import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import IO

from leg_wear_monitor.bags.findings import DamageError

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LARGEST_MESSAGE = 2**24
_PART = 2**18  # bytes per read
_BLOCK = 2**17  # bytes per decompression step: the size limit of a zstd block
_LARGEST_WINDOW = 2**27  # largest accepted window of a zstd frame [bytes]: the default limit of zstd


def expand(data: bytes, compression: str, size: int) -> bytes:
    """Decompress the content of a chunk.

    Parameters
    ----------
    data : bytes
    compression : str
    size : int
        Expected size [bytes]; decompression stops there, whatever size the data declare.

    Raises
    ------
    DamageError
        If the data do not match the chunk header.
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
        raise DamageError(f"contains {len(content)} bytes, expected {size}")
    return content


def expand_part(data: bytes, compression: str, size: int) -> bytes:
    """Decompress as much as possible of a truncated chunk; empty if nothing can be recovered."""
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
    """Decompress a zstd file in parts of bounded size, up to its end or the first damage."""
    import zstandard

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


def check(content: bytes, crc: int) -> None:
    """Verify the checksum of a chunk's content; 0 means that there is no checksum.

    Raises
    ------
    DamageError
    """
    if crc and zlib.crc32(content) != crc:
        raise DamageError("does not match its checksum")


def expand_message(data: bytes, most: int) -> bytes:
    """Decompress a message; uncompressed messages are returned unchanged, unusable ones as empty bytes.

    Parameters
    ----------
    data : bytes
    most : int
        Size limit of the content [bytes].
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
    """Concatenate parts up to a number of bytes."""
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
            raise DamageError(f"contains {said} bytes, expected {size}")
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
