"""What is wrong with a recording: told, and counted, while the rest of it is read."""

from enum import Enum
from pathlib import Path

import attrs

from leg_wear_monitor.errors import ConfigError


class RecordingError(ConfigError):
    """A recording of which nothing can be used: names the file, the topic where there is one, and why."""


class Weight(Enum):
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
        One line: what, and where in bytes.
    weight : Weight
    """

    file: Path
    text: str
    weight: Weight = Weight.LOSS

    def __str__(self) -> str:
        return f"{self.file}: {self.text}"


class DamageError(Exception):
    """A part of a file that cannot be used; its reader makes a finding of it and goes on."""
