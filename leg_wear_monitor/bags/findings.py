"""Findings: faults of a recording, reported while the remainder of the recording is read."""

from enum import Enum
from pathlib import Path

import attrs

from leg_wear_monitor.errors import ConfigError, printable


class RecordingError(ConfigError):
    """The recording is unusable; the message names the file, the topic (if any) and the reason.

    The message may quote content of the recording; unprintable characters are escaped.
    """

    def __init__(self, source: str, key: str, fault: str) -> None:
        super().__init__(printable(source), printable(key), printable(fault))


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
        One printable line: what was found, and at which byte.
    severity : Severity
    """

    file: Path
    text: str = attrs.field(converter=printable)
    severity: Severity = Severity.LOSS

    def __str__(self) -> str:
        return f"{printable(str(self.file))}: {self.text}"

    @property
    def line(self) -> str:
        """What the command line prints: a warning, or a note, which no user needs to act on."""
        return f"{'note' if self.severity is Severity.NOTE else 'warning'}: {self}"


class DamageError(Exception):
    """A part of a file is unusable; the reader records a finding and continues."""
