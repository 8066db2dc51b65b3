"""What commissioning found, as classes."""

import math
from typing import Any

import attrs

from leg_wear_monitor.monitor.config.settings import MonitorConfig

SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class Item:
    """One thing that was looked for.

    Attributes
    ----------
    name : str
        A parameter of the monitor, or what else was measured.
    value : str, int or float
        NaN if it cannot be told.
    unit : str
    sigma : float, optional
        Standard deviation, in the unit.
    mismatch : float, optional
        RMS of the torque that this leaves unexplained, as a fraction of the torque's.
    other : str, int, float or None
        The runner-up.
    other_mismatch : float, optional
        Its mismatch.
    remark : str
    """

    name: str
    value: str | int | float
    unit: str = ""
    sigma: float | None = None
    mismatch: float | None = None
    other: str | int | float | None = None
    other_mismatch: float | None = None
    remark: str = ""


@attrs.frozen(kw_only=True)
class Commissioning:
    """Result of commissioning.

    Attributes
    ----------
    items : tuple of Item
    not_told : tuple of str
        What the recording is not enough to tell, and why.
    findings : tuple of str
        What does not fit, and what to do.
    notes : tuple of str
        What is worth knowing.
    config : MonitorConfig or None
        The proposed parameters; None if a choice between alternatives is not sure.
    turns : float
        Turns of the crank in the recording.
    """

    items: tuple[Item, ...]
    not_told: tuple[str, ...]
    findings: tuple[str, ...]
    notes: tuple[str, ...]
    config: MonitorConfig | None
    turns: float

    @property
    def is_sure(self) -> bool:
        """Whether everything could be told, and all fits."""
        return self.config is not None and not self.not_told and not self.findings

    def item(self, name: str) -> Item:
        """The item of a name; raises KeyError if there is none."""
        return {each.name: each for each in self.items}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON; null for what cannot be told."""
        return {
            "schema_version": SCHEMA_VERSION,
            "turns": self.turns,
            "is_sure": self.is_sure,
            "items": [
                {key: _plain(value) for key, value in attrs.asdict(each).items()} for each in self.items
            ],
            "not_enough_to_tell": list(self.not_told),
            "findings": list(self.findings),
            "notes": list(self.notes),
        }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
