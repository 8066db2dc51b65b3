"""Content of the ledger: its leg, the wear at one instant (entry), and events between entries."""

import hashlib
import json
from typing import Any

import attrs

from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.state import Verdict
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.references import TorqueReference
from leg_wear_monitor.wear import SECTORS

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
    """

    number: int = 0
    closed: bool = True
    interval_s: float = 0.0
    epoch: int = 0
    boot_id: str = ""
    spans: tuple[tuple[int, int, int], ...] = ()


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
    """

    stamp_ns: int
    joints: tuple[JointWear, ...]
    totals: dict[str, float]
    alarms: tuple[Alarm, ...] = ()
    spans: tuple[tuple[int, int, int], ...] = ()

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
    """A clearance from which on the wear of a part counts for the forecast.

    The drive torque has corrected the modelled clearance, or the wear coefficient has changed: the clearance
    is then the best estimate.

    Attributes
    ----------
    stamp_ns : int
    joint : str
    clearance_m : float
        Mean radial clearance.
    sigma_m : float
        Its standard deviation.
    wear_m : float
        Wear in the twin at this clearance.
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    measurements : int
        Number of measurements of this part before, including withdrawn ones.
    factor : float
        Present wear coefficient over the coefficient before.
    """

    stamp_ns: int
    joint: str
    clearance_m: float
    sigma_m: float
    wear_m: float
    replaced_ns: int
    measurements: int = 0
    factor: float = 1.0


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
