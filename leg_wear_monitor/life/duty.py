"""Duty of a leg: hours a day that it walks under each load of the ground."""

import math
from collections.abc import Mapping

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import on_the_ground
from leg_wear_monitor.mechanism.spec import Mechanism

_MOST_N = 10_000.0  # of a peak: ten times a person's weight
_HOURS_OF_A_DAY = 24.0


def _check(_duty: object, _field: object, hours_by_peak: Mapping[float, float]) -> None:
    if not hours_by_peak:
        raise ConfigError("duty", "", "has no load, expected such as 0:2,300:5,600:1 (N:hours a day)")
    for peak, hours in hours_by_peak.items():
        if not 0.0 <= peak <= _MOST_N:
            raise ConfigError("duty", "", f"{peak:g} N is not a peak from 0 to {_MOST_N:g} N")
        if not (math.isfinite(hours) and hours > 0.0):
            raise ConfigError("duty", "", f"{hours:g} h at {peak:g} N is not a time above 0 h")
    whole = sum(hours_by_peak.values())
    if whole > _HOURS_OF_A_DAY:
        raise ConfigError("duty", "", f"{whole:g} h a day together are more than {_HOURS_OF_A_DAY:g} h")


@attrs.frozen
class Duty:
    """Hours a day that a leg walks under each load; only their shares matter for its wear in an hour.

    Attributes
    ----------
    hours_by_peak : mapping of float to float
        Hours a day, by the largest vertical force [N] of the ground on the foot; 0 is the leg in the air.

    Raises
    ------
    ConfigError
        For forces and times that cannot be.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> duty = lw.Duty({0.0: 2.0, 300.0: 5.0, 600.0: 1.0})
    >>> duty == lw.Duty.parse("0:2,300:5,600:1"), duty.hours_per_day
    (True, 8.0)
    """

    hours_by_peak: Mapping[float, float] = attrs.field(validator=_check)

    @classmethod
    def parse(cls, text: str) -> "Duty":
        """Duty of a text such as ``0:2,300:5,600:1``: peak [N] and hours a day of each part.

        Raises
        ------
        ConfigError
        """
        found: dict[float, float] = {}
        for part in text.split(","):
            try:
                peak, hours = (float(value) for value in part.split(":"))
            except ValueError:
                fault = f"{part!r} is not N:hours a day, expected such as 0:2,300:5,600:1"
                raise ConfigError("duty", "", fault) from None
            if peak in found:
                raise ConfigError("duty", "", f"{peak:g} N is there twice")
            found[peak] = hours
        return cls(found)

    @property
    def hours_per_day(self) -> float:
        """Hours a day under all loads."""
        return sum(self.hours_by_peak.values())

    @property
    def shares(self) -> Floats:
        """Fraction (parts,) of the gait cycles under each load."""
        return np.array(list(self.hours_by_peak.values())) / self.hours_per_day

    def to_dict(self) -> dict[str, list[float]]:
        """Plain object for JSON: peaks and hours of the parts."""
        return {"peak_n": list(self.hours_by_peak), "hours_per_day": list(self.hours_by_peak.values())}

    def mechanisms(self, mechanism: Mechanism) -> list[Mechanism]:
        """The mechanism under each load, which takes the place of a load named *ground* that it has.

        Raises
        ------
        ConfigError
            For a mechanism without a toe that moves to and fro.
        """
        return [on_the_ground(mechanism, peak) for peak in self.hours_by_peak]
