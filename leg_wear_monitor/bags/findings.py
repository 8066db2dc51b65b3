"""What is wrong with a recording: told, and counted, while the rest of it is read."""

from enum import Enum
from pathlib import Path

import attrs

from leg_wear_monitor.errors import ConfigError, printable


class RecordingError(ConfigError):
    """A recording of which nothing can be used: names the file, the topic where there is one, and why.

    What a recording holds may stand in it: it is made printable.
    """

    def __init__(self, source: str, key: str, fault: str) -> None:
        super().__init__(printable(source), printable(key), printable(fault))


class Severity(Enum):
    """What a finding means for the result."""

    NOTE = "note"
    """Worth knowing; all that was recorded is there."""
    LOSS = "loss"
    """Something that was recorded is not in the result, or may be wrong in it."""


@attrs.frozen
class Finding:
    """One thing found in one file.

    Attributes
    ----------
    file : pathlib.Path
    text : str
        One line: what, and where in bytes; it is made printable.
    weight : Severity
    """

    file: Path
    text: str = attrs.field(converter=printable)
    weight: Severity = Severity.LOSS

    def __str__(self) -> str:
        return f"{printable(str(self.file))}: {self.text}"


class DamageError(Exception):
    """A part of a file that cannot be used; its reader makes a finding of it and goes on."""
