"""Files and messages that are compressed as a whole with zstd, expanded in parts of bounded size."""

from collections.abc import Iterator
from io import BytesIO
from typing import IO

import zstandard

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_LARGEST_WINDOW = 2**27  # largest accepted window of a zstd frame [bytes]: the default limit of zstd


def expanded(file: IO[bytes]) -> Iterator[bytes]:
    """Decompress a zstd file in parts, up to its end or the first damage."""
    parts = zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW).read_to_iter(file)
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
    if data[:4] != ZSTD_MAGIC:
        return data
    content = bytearray()
    for part in expanded(BytesIO(data)):
        content += part[: most - len(content)]
        if len(content) >= most:
            break
    return bytes(content)
