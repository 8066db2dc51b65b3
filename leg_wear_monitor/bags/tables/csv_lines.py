"""Lines of a CSV file in blocks, in bounded memory, whatever the file contains."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO

import attrs

from leg_wear_monitor.bags.findings import Finding, RecordingError

_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_SEPARATORS = ",;\t"


@attrs.frozen
class Lines:
    """Complete lines of a file.

    Attributes
    ----------
    texts : list of str
        Without line breaks.
    first : int
        Number of the first line, from 1.
    stored : int
        Their bytes in the file.
    """

    texts: list[str]
    first: int
    stored: int


def blocks(path: Path, file: IO[bytes], size: int, findings: list[Finding]) -> Iterator[Lines]:
    """Complete lines, about `size` bytes at a time; what is not a complete line becomes a finding."""
    file.seek(0)
    number, rest, at = 1, b"", 0
    while part := file.read(size):
        text, found, rest = (rest + part).rpartition(b"\n")
        if found:
            if not at:
                text = text.removeprefix(_UTF8_MARK)
            texts = text.decode("utf-8", "surrogateescape").split("\n")
            yield Lines(texts, number, len(text) + 1)
            number += len(texts)
        elif len(rest) >= size:
            findings.append(
                Finding(path, f"line {number} has no end within {size} bytes: all from it on is lost")
            )
            return
        at += len(part)
    if rest.strip():
        fault = "it has no line break at its end, so it may be cut short"
        findings.append(Finding(path, f"line {number} is lost: {fault}"))


def separator_of(path: Path, header: str) -> str:
    """The separator of the cells: the most frequent of comma, semicolon and tab, else the space.

    Raises
    ------
    RecordingError
        If the file is not a text in UTF-8.
    """
    if header.encode("utf-8", "surrogateescape").startswith(_UTF16_MARKS) or "\0" in header:
        raise RecordingError(str(path), "", "is not a text in UTF-8, expected a CSV file in UTF-8")
    best = max(_SEPARATORS, key=header.count)
    return best if best in header else " "


def is_number(text: str) -> bool:
    """Whether a cell is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
