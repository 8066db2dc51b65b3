"""Shared parts of the readers of recordings: findings and errors, opening of files, clocks.

A recording may be damaged. A reader reads the usable part and lists the faults; only an unusable recording
raises an error.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import IO

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.recordings.streams import JOINT_STATE, STREAMS
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

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


@contextmanager
def reading(paths: Iterable[Path]) -> Iterator[None]:
    """System errors while reading recordings that make them unusable, such as a bad sector.

    Raises
    ------
    RecordingError
    """
    try:
        yield
    except OSError as error:
        source = ", ".join(map(str, paths))
        raise RecordingError(source, "", f"cannot be read: {error.strerror or error}") from error


class Severity(Enum):
    """Effect of a finding on the result."""

    NOTE = "note"
    """Worth knowing; all that was recorded is there."""
    LOSS = "loss"
    """Something that was recorded is not in the result, or may be wrong in it."""


@attrs.frozen
class Finding:
    """One fault or remark about one file.

    Attributes
    ----------
    file : pathlib.Path
    text : str
        One printable line: the problem, and its byte position.
    severity : Severity
    """

    file: Path
    text: str = attrs.field(converter=printable)
    severity: Severity = Severity.LOSS

    def __str__(self) -> str:
        return f"{printable(str(self.file))}: {self.text}"

    @property
    def line(self) -> str:
        """Line for the command line: a warning, or a note where no action is needed."""
        return f"{'note' if self.severity is Severity.NOTE else 'warning'}: {self}"


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


# Check that the clocks of a recording agree: header stamps against log times.


_FRACTION, _LEAST_NS = 0.05, 1_000_000_000


class Clocks:
    """First and last stamps and log times of each message type."""

    def __init__(self) -> None:
        self._ends: dict[int, NDArray[np.int64]] = {}

    def compare(self, samples: Samples, messages: NDArray[np.void]) -> None:
        """Update the times from messages and the samples decoded from them.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
            Stamped by their headers.
        messages : (n,) array of MESSAGE
        """
        good = samples["fault"] == NO_FAULT
        for code in np.unique(messages["type"][good]).tolist():
            chosen = good & (messages["type"] == code)
            ends = np.stack([samples["stamp_ns"][chosen], messages["log_time_ns"][chosen]])[:, [0, -1]]
            ends[:, 0] = self._ends.get(code, ends)[:, 0]
            self._ends[code] = ends

    def notes(self) -> list[str]:
        """Disagreements of the clocks, one line each."""
        found = []
        crank = self._ends.get(JOINT_STATE)
        for stream in (stream for stream in STREAMS if stream.code in self._ends):
            span, span_log = np.diff(self._ends[stream.code])[:, 0].tolist()
            if stream.has_stamp and abs(span - span_log) > max(_LEAST_NS, _FRACTION * abs(span_log)):
                found.append(
                    f"{stream.topic}: header stamps span {span / 1e9:.6g} s, log times "
                    f"{span_log / 1e9:.6g} s; header stamps are used, unless --time selects others"
                )
            if not stream.has_stamp and crank is not None:
                apart = int(crank[1, 1] - crank[0, 1])
                if abs(apart) > _LEAST_NS:
                    found.append(
                        f"{stream.topic} has no header, so its stamps are log times; they are "
                        f"{apart / 1e9:.6g} s after the header stamps of joint_states; try --time log"
                    )
        return found
