"""Result of a play measurement."""

from typing import Any

import attrs

from leg_wear_monitor.json_text import json_text

SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class Play:
    """Play of a joint in one posture.

    Attributes
    ----------
    joint : str
        Name of the angle.
    load : str
        Signal that gave the side; empty if the angle itself did.
    play_rad : float
        Distance between the plateaus on both sides of the load's reversals.
    sigma_rad : float
        Standard uncertainty of the play, from the scatter of the repeats and the encoder's count.
    count_rad : float
        Count of the encoder.
    noise_rad : float
        Standard deviation of the angle within a plateau.
    scatter_rad : float
        Standard deviation between the plateaus of a side.
    drift_rad : float
        Range of the drift that was removed.
    plateaus : tuple of int
        Plateaus that count, on either side.
    moving : int
        Pushes left out because the angle still moved at their end.
    short : int
        Pushes left out because the angle stopped short of the others.
    outside : int
        Pushes left out because the angle went beyond the others.
    findings : tuple of str
        What makes the result doubtful, and the remedy.
    notes : tuple of str
        Further information.
    """

    joint: str
    load: str
    play_rad: float
    sigma_rad: float
    count_rad: float
    noise_rad: float
    scatter_rad: float
    drift_rad: float
    plateaus: tuple[int, int]
    moving: int = 0
    short: int = 0
    outside: int = 0
    findings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON."""
        plain = {key: list(value) if isinstance(value, tuple) else value for key, value in self._fields()}
        return {"schema_version": SCHEMA_VERSION, **plain}

    def to_json(self) -> str:
        """Text of `to_dict`."""
        return json_text(self.to_dict())

    def _fields(self) -> list[tuple[str, Any]]:
        return list(attrs.asdict(self, recurse=False).items())
