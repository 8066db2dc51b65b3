"""Shared parts of the readers of recordings: findings and errors, opening of files, pieces.

A recording may be damaged. A reader reads the usable part and lists the faults; only an unusable recording
raises an error.
"""

from collections.abc import Callable, Iterable
from enum import Enum
from pathlib import Path
from typing import IO

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.twin.sample import Samples

# Findings and errors: a reader lists faults as findings and goes on; `RecordingError` ends the reading, and
# `DamageError` gives up one part of a file.


class RecordingError(ConfigError):
    """The recording is unusable; the message names the file, the topic (if any) and the reason.

    The message may quote content of the recording; unprintable characters are escaped.
    """

    def __init__(self, source: str, key: str, fault: str) -> None:
        super().__init__(printable(source), printable(key), printable(fault))

    @property
    def is_passing(self) -> bool:
        """True if the system is at fault, such as a permission or a network, and not the recording."""
        return isinstance(self.__cause__, OSError) and bool(self.__cause__.errno)


class Severity(Enum):
    """Effect of a finding on the result."""

    NOTE = "note"
    """A remark; nothing that was recorded is lost."""
    LOSS = "loss"
    """Something that was recorded is not in the result, or may be wrong in it."""


def _shown(path: Path | str) -> str:
    return printable(str(path))


@attrs.frozen
class Finding:
    """One fault or remark about one file.

    Attributes
    ----------
    file : str
        File with the issue.
    text : str
        Description of the issue, on one line.
    weight : Severity
        Effect on the result: ``loss`` if data are lost or may be wrong.
    """

    file: str = attrs.field(converter=_shown)
    text: str = attrs.field(converter=printable)
    weight: Severity = Severity.LOSS

    def __str__(self) -> str:
        return f"{self.file}: {self.text}"

    @property
    def line(self) -> str:
        """Line for the command line: a warning, or a note where no action is needed."""
        return f"{'note' if self.weight is Severity.NOTE else 'warning'}: {self}"


class DamageError(Exception):
    """A part of a file is unusable; the reader records a finding and continues."""


MOST_BYTES = 256_000_000
"""Memory for one part of a file while it is read, whatever size the file declares."""


def check_size(needed: int) -> None:
    """Check that a part of a file fits into memory.

    Raises
    ------
    DamageError
        If it does not; the text is a predicate that follows the name of the part.
    """
    if needed > MOST_BYTES:
        text = f"needs {needed / 1e6:.0f} MB to be read. Expected at most {MOST_BYTES / 1e6:.0f} MB"
        raise DamageError(text)


CSV, PARQUET = ".csv", ".parquet"
_RENAME = "not read under this name. Rename it to {path.stem}.csv if it is a table"
_EXPORT = "a spreadsheet. Save it as CSV (UTF-8)"
REMEDIES = dict.fromkeys((".txt", ".tsv", ".dat", ".log"), _RENAME)
REMEDIES |= dict.fromkeys((".xlsx", ".xls", ".ods"), _EXPORT)
REMEDIES |= dict.fromkeys((".zstd", ".zst"), "compressed as a whole. Run: zstd -d {path} -o {path.stem}")
REMEDIES[".bag"] = "a ROS 1 bag. Convert it: rosbags-convert --src {path} --dst {path.stem}"
"""Remedy for a file that is not read, by the end of its name."""


def is_table_name(name: str) -> bool:
    """True if a file is a table by its name, or a recording of a kind that is refused with a remedy."""
    return Path(name).suffix.lower() in (CSV, PARQUET, *REMEDIES)


def listed(names: Iterable[str]) -> str:
    """Names as text, the first 20 of them."""
    names = list(names)
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return (", ".join(printable(name, 100) for name in names[:20]) or "none") + more


_POINTER = b"version https://git-lfs.github.com/spec/"


def open_recording(path: Path) -> IO[bytes]:
    """Open a file for reading.

    Raises
    ------
    RecordingError
        If it is a pointer of git-LFS.
    OSError
        If it cannot be opened.
    """
    file = path.open("rb")
    if file.read(len(_POINTER)) == _POINTER:
        file.close()
        raise RecordingError(str(path), "", "a pointer of git-LFS, not the file itself. Run: git lfs pull")
    file.seek(0)
    return file


# Messages of one step of reading, and the topic that they belong to.


@attrs.frozen
class Channel:
    """Topic, type and encoding of a channel in one file; an unknown type is empty."""

    topic: str
    type: str
    encoding: str = "cdr"


@attrs.frozen(eq=False)
class Piece:
    """Messages that are read in one step.

    Attributes
    ----------
    start_ns : int
        Lower bound of the log times in this piece and all later pieces of the file [ns].
    data : (bytes,) array of uint8
    messages : (n,) array of MESSAGE
    stored : int
        Bytes that the piece occupies in the file.
    samples : (n,) array of GAIT_SAMPLE, optional
        The messages as samples, without sign, scale and offset; a table has no other content of messages.
    """

    start_ns: int
    data: NDArray[np.uint8]
    messages: NDArray[np.void]
    stored: int
    samples: Samples | None = None

    def raw(self, number: int) -> bytes:
        """Bytes of a message."""
        message = self.messages[number]
        return self.data[message["begin"] : message["end"]].tobytes()


Due = tuple[int, Callable[[], Piece | None]]
"""A piece that is not loaded yet, so that a merge of many files has few pieces in memory.

Its `start_ns` [ns], and a function that returns it, or None if it is damaged; to be called before the next
piece is requested.
"""
