"""Content of the ledger: the wear and related state at one instant (entry), and events between entries."""

import hashlib
import struct

import attrs
import numpy as np

from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.ledger.walked import WalkedLoad
from leg_wear_monitor.twin.reference.leg_parameters import COUPLING_DAMPING
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference
from leg_wear_monitor.wear.surfaces import SECTORS


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
    sampling_m2 : float
        Variance of the mean depth because sampled replays did not follow all gait cycles.
    """

    name: str
    depth: Floats
    cycles: int = 0
    moving_s: float = 0.0
    replaced_ns: int = 0
    sampling_m2: float = 0.0

    @property
    def mean_m(self) -> float:
        """Mean depth of bushing and journal together, which is what the mean clearance has grown by [m]."""
        return float(self.depth.sum(axis=0).mean())


def new_part(name: str) -> JointWear:
    """A joint whose part is new."""
    return JointWear(name, np.zeros((2, SECTORS)))


def one_part(before: JointWear, since: JointWear) -> JointWear:
    """The wear before a reset and the wear since, of a part that was not replaced."""
    return JointWear(
        before.name,
        before.depth + since.depth,
        before.cycles + since.cycles,
        before.moving_s + since.moving_s,
        before.replaced_ns,
        before.sampling_m2 + since.sampling_m2,
    )


@attrs.frozen(eq=False)
class Entry:
    """The state of the wear at one instant.

    Attributes
    ----------
    stamp_ns : int
        Stamp up to which the wear is counted.
    joints : tuple of JointWear
    totals : dict of str to float
        Counters over all runs; each name ends in the unit.
    alarms : tuple of Alarm
        Those that are not OK.
    spans : tuple of (int, int)
        Begin and end [ns] of the time spans of this run whose wear is counted.
    span_epochs : tuple of int
        Clock epoch of each span; empty if all spans are in epoch 0.
    loads : tuple of WalkedLoad
        Foot loads that acted in this run.
    """

    stamp_ns: int
    joints: tuple[JointWear, ...]
    totals: dict[str, float]
    alarms: tuple[Alarm, ...] = ()
    spans: tuple[tuple[int, int], ...] = ()
    span_epochs: tuple[int, ...] = ()
    loads: tuple[WalkedLoad, ...] = ()

    @property
    def moving_s(self) -> float:
        """Counted time in motion, over all runs [s]."""
        return self.totals.get("moving_s", 0.0)

    def digest(self) -> bytes:
        """Checksum of everything except epochs and loads, as stored in ledgers up to format 3."""
        sum_ = hashlib.sha256(struct.pack("<q", self.stamp_ns))
        for joint in sorted(self.joints, key=lambda joint: joint.name):
            sum_.update(repr((joint.name, joint.cycles, joint.moving_s, joint.replaced_ns)).encode())
            sum_.update(np.ascontiguousarray(joint.depth, dtype="<f8").tobytes())
        alarms = [
            (a.kind, a.subject, int(a.level), int(a.present), a.acknowledged, a.raised_ns)
            for a in self.alarms
        ]
        sum_.update(repr((sorted(self.totals.items()), sorted(alarms), self.spans)).encode())
        return sum_.digest()


@attrs.frozen(eq=False)
class Audit:
    """An operator's change of the counted wear, such as a reset.

    Attributes
    ----------
    stamp_ns : int
    who, what : str
    joint : JointWear or None
        State of the joint before the change.
    undoes : int or None
        The `id` of the change that this one reverts.
    id : int
        Number of its row in the ledger, 0 before it is written.
    """

    stamp_ns: int
    who: str
    what: str
    joint: JointWear | None = None
    undoes: int | None = None
    id: int = 0


@attrs.frozen
class AlarmEvent:
    """An alarm's shown level or acknowledgement changed at a stamp."""

    stamp_ns: int
    alarm: Alarm


@attrs.frozen(kw_only=True)
class VerdictEvent:
    """A changed verdict at a stamp; ``joints``, ``evidence`` and ``not_valid`` as JSON."""

    stamp_ns: int
    state: str
    fault_code: str
    joints: str
    since_ns: int
    why: str
    to_do: str
    evidence: str
    not_valid: str


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
        Wear that the twin had counted for this part at that time.
    cycles : int
        Gait cycles of this part at that time.
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    expected_below : float
        Predicted probability of a smaller clearance.
    counts : bool
        Whether the forecast uses it, unless it was withdrawn.
    withdrawn_ns : int
        When it was withdrawn; 0 if it was not.
    withdrawn_by : str
        By whom it was withdrawn; empty if it was not.
    wear_sigma_m : float
        Standard deviation of `wear_m` because sampled replays did not follow all gait cycles.
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
    wear_sigma_m: float = 0.0
    id: int = attrs.field(default=0, eq=False)

    @property
    def is_withdrawn(self) -> bool:
        """Whether the measurement was withdrawn; it stays in the ledger, but is not used."""
        return self.withdrawn_ns != 0


@attrs.frozen
class Withdrawal:
    """Withdrawal of a measurement, given by the `id` of its row: it is no longer used."""

    stamp_ns: int
    who: str
    measurement: int


@attrs.frozen
class CorrectedClearance:
    """A counted clearance that was replaced by the one that the drive torque shows.

    Attributes
    ----------
    stamp_ns : int
    joint : str
    clearance_m : float
        Mean radial clearance from then on.
    sigma_m : float
        Its standard deviation.
    before_m : float
        Wear that the twin had counted for this part.
    wear_m : float
        Wear in the twin from then on, which makes the clearance this one.
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
class ForecastPoint:
    """A joint's gait cycles to its limit (p10, p50, p90), as forecast after so many gait cycles."""

    stamp_ns: int
    cycle: int
    joint: str
    p10_cycles: float
    p50_cycles: float
    p90_cycles: float


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
        As in `commissioning.EncoderErrors`.
    """

    stamp_ns: int
    encoders: tuple[str, ...]
    centre_rad: Floats
    mean: Floats
    covariance: Floats

    def digest(self) -> bytes:
        """Checksum of all fields, as stored in ledgers of format 3."""
        sum_ = hashlib.sha256(repr((self.stamp_ns, self.encoders)).encode())
        for part in (self.centre_rad, self.mean, self.covariance):
            sum_.update(np.ascontiguousarray(part, dtype="<f8").tobytes())
        return sum_.digest()


@attrs.frozen
class IdentifiedLeg:
    """Masses, lengths and friction of a leg, as factors on those of its mechanism file, and its drive.

    Attributes
    ----------
    stamp_ns : int
    names : tuple of str
    mass, length : tuple of float
    friction : float
        In all joints.
    compliance, damping : float
        Between the measured crank angle and the crank [rad/(N m)]; of the critical damping.
    load : (n, 2) array
        Force of the ground on the toe at equal steps of the crank angle from 0 [N]; (0, 2) without one.
    """

    stamp_ns: int
    names: tuple[str, ...]
    mass: tuple[float, ...]
    length: tuple[float, ...]
    friction: float
    compliance: float = 0.0
    damping: float = COUPLING_DAMPING
    load: Floats = attrs.field(factory=lambda: np.zeros((0, 2)), eq=attrs.cmp_using(eq=np.array_equal))


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
    | Withdrawal
    | CorrectedClearance
    | ForecastPoint
    | Commissioned
    | CommissionedTorque
    | IdentifiedLeg
    | SimulatedReference
    | VerdictEvent
)
