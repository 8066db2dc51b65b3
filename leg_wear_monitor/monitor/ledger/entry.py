"""What the ledger keeps: the wear and all that belongs to it at one instant, and what happened on the way."""

import hashlib
import struct

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.wear.surfaces import SECTORS


@attrs.frozen(eq=False)
class JointWear:
    """A joint's worn surfaces and what they have seen since the part was new.

    Attributes
    ----------
    name : str
    depth : (2, N) array, m
        Of bushing and journal.
    cycles : int
    moving_s : float
    replaced_ns : int
        When the part was replaced, 0 if it never was.
    """

    name: str
    depth: Floats
    cycles: int = 0
    moving_s: float = 0.0
    replaced_ns: int = 0


def new_part(name: str) -> JointWear:
    """A joint whose part is new."""
    return JointWear(name, np.zeros((2, SECTORS)))


@attrs.frozen(eq=False)
class Entry:
    """The state of the wear at one instant.

    Attributes
    ----------
    stamp_ns : int
        Up to where it is counted.
    joints : tuple of JointWear
    totals : dict of str to float
        Counters over all runs, by names that end in their unit.
    alarms : tuple of Alarm
        Those that are not OK.
    spans : tuple of (int, int)
        Begin and end [ns] of the stretches of this run that are counted.
    span_epochs : tuple of int
        Epoch of the clock of each span; none if all are of epoch 0.
    """

    stamp_ns: int
    joints: tuple[JointWear, ...]
    totals: dict[str, float]
    alarms: tuple[Alarm, ...] = ()
    spans: tuple[tuple[int, int], ...] = ()
    span_epochs: tuple[int, ...] = ()

    @property
    def moving_s(self) -> float:
        """Time in motion that is counted, over all runs."""
        return self.totals.get("moving_s", 0.0)

    def digest(self) -> bytes:
        """Checksum of everything but epochs, as ledgers up to format 3 keep it."""
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
    """Somebody did something to the wear.

    Attributes
    ----------
    stamp_ns : int
    who, what : str
    joint : JointWear or None
        As it was before.
    undoes : int or None
        The `id` of what this undid.
    id : int
        Of its row, 0 before it is written.
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
        By the clock; nothing follows from it.
    joint, who : str
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation.
    wear_m : float
        What the twin had counted for this part then.
    cycles, replaced_ns : int
        Of the part, as in `JointWear`.
    expected_below : float
        Probability with which a smaller one was expected.
    counts : bool
        Whether the forecast believes it, unless it was withdrawn.
    withdrawn_ns, withdrawn_by : int, str
        When and by whom it was withdrawn; 0 and empty if it was not.
    id : int
        Of its row in the ledger, 0 before it is written.
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
        """Whether it was; it stays in the ledger, and does not count."""
        return self.withdrawn_ns != 0


@attrs.frozen
class Withdrawal:
    """A measurement, by the `id` of its row, does not count any more."""

    stamp_ns: int
    who: str
    measurement: int


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
    """Errors of further encoders, as found while the clearances were known.

    Attributes
    ----------
    stamp_ns : int
        End of the last gait cycle that they were found from.
    encoders : tuple of str
        What tells the m encoders from one another.
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
        """Checksum of everything, as ledgers of format 3 keep it."""
        sum_ = hashlib.sha256(repr((self.stamp_ns, self.encoders)).encode())
        for part in (self.centre_rad, self.mean, self.covariance):
            sum_.update(np.ascontiguousarray(part, dtype="<f8").tobytes())
        return sum_.digest()


Event = Audit | AlarmEvent | ClearancePoint | Measurement | Withdrawal | ForecastPoint | Commissioned
