"""Content of the ledger: its leg, the wear at one instant (entry), and events between entries."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import Alarm, duration
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.state import Verdict
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.references import TorqueReference
from leg_wear_monitor.wear import SECTORS

_CLASS_N = 100  # resolution of foot loads

# fields of a mechanism that may change without a change of the worn parts
# (a person is in the masses of the bodies)
_FREE = ("name", "source", "drive", "loads", "clearance_joints", "clearances", "toe_point", "person_kg")
_FREE_OF_CLEARANCE = ("wear_coefficient", "material")  # the other settings contain the values of the pair
_FREE_OF_JOINTS = ("label",)


def fingerprint(mechanism: Mechanism) -> str:
    """Hash of the bodies, joints, springs and clearance joints of a mechanism, 16 hexadecimal digits.

    The hash excludes names, labels and comments of the file, drive, loads and wear coefficients: with a
    better value of these, the same wear is continued.
    """
    fields = {field.name: getattr(mechanism, field.name) for field in attrs.fields(Mechanism)}
    parts = {name: _plain(value) for name, value in fields.items() if name not in _FREE}
    for joint in mechanism.clearance_joints:
        settings = attrs.asdict(mechanism.clearances[joint])
        parts[f"clearance {joint}"] = {
            name: _plain(value) for name, value in settings.items() if name not in _FREE_OF_CLEARANCE
        }
    text = json.dumps(parts, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    if attrs.has(type(value)):
        return attrs.asdict(value, filter=lambda field, _: field.name not in _FREE_OF_JOINTS)
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    return value


def binding_of(mechanism: Mechanism, config: MonitorConfig) -> dict[str, str]:
    """Properties of a leg that must be equal for a ledger to be continued, as the ledger keeps them.

    Parameters
    ----------
    mechanism : Mechanism
        As `fitted` returned it.
    config : MonitorConfig
    """
    return {
        "hardware_id": config.hardware,
        "mechanism": mechanism.name,  # for messages
        "fingerprint": fingerprint(mechanism),
        "joints": ", ".join(sorted(mechanism.clearance_joints)),
        "wear_acceleration": str(config.wear_acceleration),
        "sectors": str(SECTORS),
    }


@attrs.frozen
class WalkedLoad:
    """Gait cycles under foot loads of about one size.

    Attributes
    ----------
    about_n : int
        Largest vertical foot load of each of the cycles, to the nearest 100 N.
    cycles : int
        Gait cycles.
    moving_s : float
        Time in motion.
    mean_n, sigma_n : float
        Mean and standard deviation of the largest vertical foot load of a gait cycle.
    """

    about_n: int
    cycles: int
    moving_s: float
    mean_n: float
    sigma_n: float

    @classmethod
    def of_cycle(cls, peak_n: float, moving_s: float) -> "WalkedLoad":
        """One gait cycle."""
        return cls(_CLASS_N * round(peak_n / _CLASS_N), 1, moving_s, peak_n, 0.0)


@attrs.frozen
class Run:
    """A run of the monitor.

    Attributes
    ----------
    number : int
        Number of the run, 0 before the first.
    closed : bool
        True if the run ended normally.
    interval_s : float
        Longest time in motion between two of its entries.
    epoch : int
        Epoch of the clock at the end of the run.
    boot_id : str
        Boot of the computer; empty if unknown.
    spans : tuple of (int, int, int)
        Begin and end [ns] of the time spans whose wear is modelled, and their clock epochs.
    loads : tuple of WalkedLoad
        Foot loads that acted.
    """

    number: int = 0
    closed: bool = True
    interval_s: float = 0.0
    epoch: int = 0
    boot_id: str = ""
    spans: tuple[tuple[int, int, int], ...] = ()
    loads: tuple[WalkedLoad, ...] = ()


def together(loads: Iterable[WalkedLoad]) -> tuple[WalkedLoad, ...]:
    """All cycles under loads of about one size as one, by rising loads."""
    found: dict[int, list[WalkedLoad]] = {}
    for load in loads:
        found.setdefault(load.about_n, []).append(load)
    return tuple(_one(found[about_n]) for about_n in sorted(found))


def _one(loads: list[WalkedLoad]) -> WalkedLoad:
    cycles, moving_s, mean_n, sigma_n = np.array([attrs.astuple(load)[1:] for load in loads]).T
    mean = float(np.average(mean_n, weights=cycles))
    variance = np.average(sigma_n**2 + (mean_n - mean) ** 2, weights=cycles)
    return WalkedLoad(
        loads[0].about_n, int(cycles.sum()), float(moving_s.sum()), mean, float(np.sqrt(variance))
    )


def walked_words(loads: Iterable[WalkedLoad]) -> str:
    """Such as ``walked 12.1 h at 290 N, 2 h at 0 N``, the longest first; empty for a leg in the air."""
    longest = sorted(loads, key=lambda load: -load.moving_s)
    if not any(load.about_n for load in longest):
        return ""
    return "walked " + ", ".join(f"{duration(load.moving_s)} at {load.mean_n:.0f} N" for load in longest)


@attrs.frozen(eq=False)
class JointWear:
    """A joint's worn surfaces, and their gait cycles and time in motion since the part was new.

    Attributes
    ----------
    name : str
    depth : (2, N) array, m
        Wear depth of bushing and journal, by sector.
    cycles : int
    moving_s : float
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    wear_coefficient_per_pa : float
        Wear coefficient of bushing and journal together that gave the last of this wear; 0 if it is not
        known.
    """

    name: str
    depth: Floats
    cycles: int = 0
    moving_s: float = 0.0
    replaced_ns: int = 0
    wear_coefficient_per_pa: float = 0.0

    @property
    def mean_m(self) -> float:
        """Mean depth of bushing and journal together, equal to the growth of the mean clearance [m]."""
        return float(self.depth.sum(axis=0).mean())


def one_part(before: JointWear, since: JointWear) -> JointWear:
    """The wear before a reset and the wear since, of a part that was not replaced."""
    return JointWear(
        before.name,
        before.depth + since.depth,
        before.cycles + since.cycles,
        before.moving_s + since.moving_s,
        before.replaced_ns,
        since.wear_coefficient_per_pa or before.wear_coefficient_per_pa,
    )


def clearance_limit_key(joint: str) -> str:
    """Name in the totals of the limit that the monitor has for a joint's clearance."""
    return f"clearance_limit_{joint}_m"


@attrs.frozen(eq=False)
class Entry:
    """The state of the wear at one instant.

    Attributes
    ----------
    stamp_ns : int
        Stamp up to which the wear is modelled.
    joints : tuple of JointWear
    totals : dict of str to float
        Counters over all runs, and values in force such as `clearance_limit_key`; each name ends in the unit.
    alarms : tuple of Alarm
        Those that are not OK.
    spans : tuple of (int, int, int)
        Begin and end [ns] of the time spans of this run whose wear is modelled, and their clock epochs.
    loads : tuple of WalkedLoad
        Foot loads that acted in this run.
    """

    stamp_ns: int
    joints: tuple[JointWear, ...]
    totals: dict[str, float]
    alarms: tuple[Alarm, ...] = ()
    spans: tuple[tuple[int, int, int], ...] = ()
    loads: tuple[WalkedLoad, ...] = ()

    @property
    def moving_s(self) -> float:
        """Counted time in motion, over all runs [s]."""
        return self.totals.get("moving_s", 0.0)


@attrs.frozen(eq=False)
class Audit:
    """An operator's change of the modelled wear, such as a reset.

    Attributes
    ----------
    stamp_ns : int
    who, what : str
    joint : JointWear or None
        State of the joint before the change.
    alarms : tuple of Alarm
        Alarms that the change cleared or eased, as they were before.
    """

    stamp_ns: int
    who: str
    what: str
    joint: JointWear | None = None
    alarms: tuple[Alarm, ...] = ()


@attrs.frozen
class AlarmEvent:
    """An alarm's shown level or acknowledgement changed at a stamp."""

    stamp_ns: int
    alarm: Alarm


@attrs.frozen
class VerdictEvent:
    """A changed verdict at a stamp."""

    stamp_ns: int
    verdict: Verdict


@attrs.frozen
class ClearancePoint:
    """A joint's clearance [m] after so many gait cycles."""

    stamp_ns: int
    cycle: int
    joint: str
    clearance_m: float
    clearance_max_m: float


@attrs.frozen
class Measurement:
    """A clearance measured by hand.

    Attributes
    ----------
    stamp_ns : int
        Time of the clock, for information only.
    joint : str
        Joint that was measured.
    who : str
        Who measured it.
    clearance_m : float
        Mean radial clearance.
    sigma_m : float
        Its standard deviation.
    wear_m : float
        Modelled wear of this part at that time.
    cycles : int
        Gait cycles of this part at that time.
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    expected_below : float
        Predicted probability of a smaller clearance.
    counts : bool
        True if the forecast uses it, unless it was withdrawn.
    withdrawn_ns : int
        When it was withdrawn; 0 if it was not.
    withdrawn_by : str
        By whom it was withdrawn; empty if it was not.
    id : int
        Number of its row in the ledger, 0 before it is written.
    """

    stamp_ns: int
    joint: str
    who: str
    clearance_m: float
    sigma_m: float
    wear_m: float
    cycles: int
    replaced_ns: int
    expected_below: float
    counts: bool
    withdrawn_ns: int = 0
    withdrawn_by: str = ""
    id: int = attrs.field(default=0, eq=False)

    @property
    def is_withdrawn(self) -> bool:
        """True if the measurement was withdrawn; it stays in the ledger, but is not used."""
        return self.withdrawn_ns != 0


@attrs.frozen
class CorrectedClearance:
    """A modelled clearance that was replaced by the one that the drive torque shows.

    Attributes
    ----------
    stamp_ns : int
    joint : str
    clearance_m : float
        Mean radial clearance after the correction.
    sigma_m : float
        Its standard deviation.
    before_m : float
        Modelled wear of this part.
    wear_m : float
        Wear in the twin after the correction, which gives this clearance.
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    """

    stamp_ns: int
    joint: str
    clearance_m: float
    sigma_m: float
    before_m: float
    wear_m: float
    replaced_ns: int


@attrs.frozen
class CoefficientSpan:
    """Wear of a part that was modelled with a different wear coefficient than the present one.

    Attributes
    ----------
    joint : str
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    from_m, to_m : float
        Modelled wear of this part at begin and end.
    factor : float
        Present coefficient over that one.
    """

    joint: str
    replaced_ns: int
    from_m: float
    to_m: float
    factor: float


Recount = CorrectedClearance | CoefficientSpan
"""Modelled wear of a part that a forecast takes otherwise than as worn with the present coefficient."""


def coefficient_spans(
    states: Iterable[JointWear], now_per_pa: Mapping[str, float]
) -> tuple[CoefficientSpan, ...]:
    """Wear that was modelled with other coefficients than the present coefficients; none if one is unknown.

    Parameters
    ----------
    states : iterable of JointWear
        Of all parts in the order of time, where their coefficient changed at the least, and the present ones.
    now_per_pa : mapping of str to float
        Present coefficients of bushing and journal together, by joint.
    """
    ends: dict[tuple[str, int], float] = {}
    spans = []
    for state in states:
        part, was, now = (
            (state.name, state.replaced_ns), state.wear_coefficient_per_pa, now_per_pa.get(state.name, 0.0)
        )  # fmt: skip
        begin_m, end_m = ends.get(part, 0.0), state.mean_m
        ends[part] = max(begin_m, end_m)
        if was > 0.0 and now > 0.0 and was != now and end_m > begin_m:
            spans.append(CoefficientSpan(*part, begin_m, end_m, now / was))
    return tuple(spans)


@attrs.frozen(eq=False)
class Commissioned:
    """Errors of further encoders, estimated while the clearances were known.

    Attributes
    ----------
    stamp_ns : int
        End of the last gait cycle of the estimate.
    encoders : tuple of str
        Identification of the m encoders: name, joint and sign.
    centre_rad : (m,) array
    mean : (1 + 2 m,) array
    covariance : array
        As in `EncoderErrors`.
    """

    stamp_ns: int
    encoders: tuple[str, ...]
    centre_rad: Floats
    mean: Floats
    covariance: Floats


@attrs.frozen
class IdentifiedLeg:
    """Parameters that the drive torque shows of a leg.

    Attributes
    ----------
    stamp_ns : int
    bodies : tuple of str
        Names of the bodies, in the order of the parameters.
    parameters : LegParameters
    """

    stamp_ns: int
    bodies: tuple[str, ...]
    parameters: LegParameters


@attrs.frozen(eq=False)
class SimulatedReference:
    """A torque reference that was simulated for this leg.

    Attributes
    ----------
    stamp_ns : int
    bodies : tuple of str
        Names of the bodies, in the order of its parameters.
    reference : TorqueReference
    """

    stamp_ns: int
    bodies: tuple[str, ...]
    reference: TorqueReference


Event = (
    Audit
    | AlarmEvent
    | ClearancePoint
    | Measurement
    | CorrectedClearance
    | Commissioned
    | CommissionedTorque
    | IdentifiedLeg
    | SimulatedReference
    | VerdictEvent
)
