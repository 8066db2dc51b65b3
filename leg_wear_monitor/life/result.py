"""Result of a life: states of wear over gait cycles, and when a clearance reaches its limit."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from leg_wear_monitor.contact.geometry import doubt_under_load
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import data_frame, finite_or_none, json_text
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import bushing_of, regime_of
from leg_wear_monitor.mechanism.person import with_ground_reaction
from leg_wear_monitor.mechanism.spec import Mechanism

if TYPE_CHECKING:
    import pandas as pd


# Duty of a leg: hours per day that it walks under each load of the ground.


_MOST_N = 10_000.0  # largest peak: ten times a person's weight
_HOURS_OF_A_DAY = 24.0


def _check(_duty: object, _field: object, hours_by_peak: Mapping[float, float]) -> None:
    if not hours_by_peak:
        raise ConfigError("duty", "", "has no load. Expected for example 0:2,300:5,600:1 (N:hours per day)")
    for peak, hours in hours_by_peak.items():
        if not 0.0 <= peak <= _MOST_N:
            raise ConfigError("duty", "", f"{peak:g} N is not a peak from 0 to {_MOST_N:g} N")
        if not (math.isfinite(hours) and hours > 0.0):
            raise ConfigError("duty", "", f"{hours:g} h at {peak:g} N is not a time above 0 h")
    whole = sum(hours_by_peak.values())
    if whole > _HOURS_OF_A_DAY:
        raise ConfigError("duty", "", f"{whole:g} h per day in total are more than {_HOURS_OF_A_DAY:g} h")


@attrs.frozen
class Duty:
    """Hours per day that a leg walks under each load; only their proportions affect its wear per hour.

    Attributes
    ----------
    hours_by_peak : mapping of float to float
        Hours per day, by the largest vertical force [N] of the ground on the foot; 0 is the leg in the air.

    Raises
    ------
    ConfigError
        If a force or a time is impossible.

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
        """The duty in a text such as ``0:2,300:5,600:1``: peak [N] and hours per day of each part.

        Raises
        ------
        ConfigError
        """
        found: dict[float, float] = {}
        for part in text.split(","):
            try:
                peak, hours = (float(value) for value in part.split(":"))
            except ValueError:
                fault = f"{part!r} is not N:hours per day. Expected for example 0:2,300:5,600:1"
                raise ConfigError("duty", "", fault) from None
            if peak in found:
                raise ConfigError("duty", "", f"{peak:g} N occurs twice")
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
            If the mechanism has no toe that moves to and fro.
        """
        return [with_ground_reaction(mechanism, peak) for peak in self.hours_by_peak]


SCHEMA_VERSION = 1
"""Version of the JSON; counts up when a field is renamed, removed or means something else."""

_OF_JOINTS = ("clearance_m", "clearance_max_m", "worst_sector_deg", "peak_force_n", "growth_m_per_cycle")


@attrs.frozen(eq=False)
class Life:
    """A life as arrays over p points and k clearance joints.

    Attributes
    ----------
    clearance_joints : tuple of str
        The joints, in the order of all values.
    cycles : (p,) array
        Gait cycles since the life began.
    clearance_m : (p, k) array
        Mean radial clearance around the bushing.
    clearance_max_m : (p, k) array
        Largest value of the profiles of both surfaces combined.
    worst_sector_deg : (p, k) array
        Angle of the deepest wear of the bushing, in its own frame; NaN without wear.
    peak_force_n : (p, k) array
        Largest contact force of a cycle, mean over the simulated cycles; of a duty the load where it is most.
    growth_m_per_cycle : (p, k) array
        Growth of the mean clearance in a gait cycle.
    growth_error_m_per_cycle : (p, k) array
        Its standard error, from the scatter of the cycles.
    error_m : (p,) array
        Estimated error of the mean clearance in the jump to each point.
    depth : (p, k, 2, N) array, m
        Wear of bushing and journal, by sector.
    rubbing_j_per_cycle : (p, k) array
        Integral of ``F_N |v_t| dt`` over a gait cycle.
    period_s : float
        Duration of a gait cycle.
    duty : Duty or None
        Loads under which the leg walks; None for the loads of its mechanism alone.
    part_growth_m_per_cycle : (p, parts, k) array
        Growth of the mean clearance in a gait cycle under each load of the duty.
    """

    clearance_joints: tuple[str, ...]
    cycles: Floats
    clearance_m: Floats
    clearance_max_m: Floats
    worst_sector_deg: Floats
    peak_force_n: Floats
    growth_m_per_cycle: Floats
    growth_error_m_per_cycle: Floats
    error_m: Floats
    depth: Floats
    rubbing_j_per_cycle: Floats
    period_s: float
    duty: Duty | None
    part_growth_m_per_cycle: Floats

    def cycles_to(self, k: int, clearance_m: float) -> float:
        """Gait cycles at which joint k's mean clearance reaches a value; extrapolated with its last growth.

        Infinite if it does not grow, 0 if it was reached from the start.
        """
        clearance = self.clearance_m[:, k]
        if clearance_m <= clearance[0]:
            return 0.0
        if clearance_m <= clearance[-1]:
            return float(np.interp(clearance_m, clearance, self.cycles))
        rate = self.growth_m_per_cycle[-1, k]
        return float(self.cycles[-1] + (clearance_m - clearance[-1]) / rate) if rate > 0.0 else np.inf

    def end(self, limit_m: float) -> dict[str, dict[str, float | None]]:
        """Time until each joint reaches a mean clearance; for the leg, until the first joint does.

        The time has ``cycles``, ``hours`` of walking and, with a duty, ``days``; None if the joint never
        does.
        """
        cycles = [self.cycles_to(k, limit_m) for k in range(len(self.clearance_joints))]
        return {
            name: self._walking(until) for name, until in zip(self.clearance_joints, cycles, strict=True)
        } | {"leg": self._walking(min(cycles))}

    def _walking(self, cycles: float) -> dict[str, float | None]:
        hours = cycles * self.period_s / 3600.0
        found = {"cycles": cycles, "hours": hours}
        if self.duty:
            found["days"] = hours / self.duty.hours_per_day
        return {name: finite_or_none(value) for name, value in found.items()}

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON, joints by name; null for an unknown sector."""
        joints = {
            joint: {
                name: [finite_or_none(v) for v in getattr(self, name)[:, k].tolist()] for name in _OF_JOINTS
            }
            for k, joint in enumerate(self.clearance_joints)
        }
        for k, joint in enumerate(self.clearance_joints if self.duty else ()):
            joints[joint]["part_growth_m_per_cycle"] = self.part_growth_m_per_cycle[:, :, k].T.tolist()
        return {
            "schema_version": SCHEMA_VERSION,
            "cycles": self.cycles.tolist(),
            "error_m": self.error_m.tolist(),
            "joints": joints,
        }

    def to_json(self) -> str:
        """Text of `to_dict`; ``life --json`` writes the same fields and the settings they belong to."""
        return json_text(self.to_dict())

    def columns(self) -> dict[str, list[Any]]:
        """Columns of a table with a row for each joint at each point, joint by joint."""
        points, joints = self.clearance_m.shape
        return {
            "joint": [joint for joint in self.clearance_joints for _ in range(points)],
            "cycles": self.cycles.tolist() * joints,
            "error_m": self.error_m.tolist() * joints,
            **{name: getattr(self, name).T.ravel().tolist() for name in _OF_JOINTS},
            **(self._duty_columns(self.duty) if self.duty else {}),
        }

    def _duty_columns(self, duty: Duty) -> dict[str, list[Any]]:
        """Hours and days of the duty at each point, and growth under each of its loads."""
        hours = np.tile(self.cycles, len(self.clearance_joints)) * self.period_s / 3600.0
        growth = {
            f"growth_{peak_n:g}_n_m_per_cycle": self.part_growth_m_per_cycle[:, part].T.ravel().tolist()
            for part, peak_n in enumerate(duty.hours_by_peak)
        }
        return {"hours": hours.tolist(), "days": (hours / duty.hours_per_day).tolist(), **growth}

    def to_pandas(self) -> "pd.DataFrame":
        """Table of `columns`, by joint and gait cycles; requires pandas.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        return data_frame(self.columns(), index=["joint", "cycles"])


def validity(mechanism: Mechanism, life: Life) -> dict[str, Any]:
    """Validity of each joint's life for ``life --json``, by its load when new, whether it wears or not.

    The mean of pressure times sliding speed is W / (2 R w) over the period, with W the integral of F_N |v_t|
    dt over a gait cycle.
    """
    found = {}
    for k, joint in enumerate(life.clearance_joints):
        settings, bushing = mechanism.clearances[joint], bushing_of(mechanism, joint)
        load = float(life.rubbing_j_per_cycle[0, k]) / (bushing.area_m2 * life.period_s)
        found[joint] = {
            "holds_for": regime_of(settings),
            "mean_pressure_speed_pa_mps": load,
            "outside_limits": bushing.loaded(0.0, 0.0, 0.0, load).outside_limits,
            "outside_contact_law": doubt_under_load(settings, float(life.peak_force_n[0, k])),
        }
    return found
