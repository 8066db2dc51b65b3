"""What the measured drive torque shows of the clearances, compared with those that the monitor counts."""

from collections.abc import Mapping
from enum import Enum

import attrs

from leg_wear_monitor.estimate.cause import Change
from leg_wear_monitor.estimate.ground_load import GroundLoad
from leg_wear_monitor.estimate.signature import DIRECT, Channel


class DiagnosisState(Enum):
    """What the diagnosis can report; the value is the word that files contain."""

    OFF = "off"
    WAITING = "waiting"
    AS_COUNTED = "as_counted"
    CHANGED = "changed"


class NotUsed(Enum):
    """Why a gait cycle says nothing of the clearances; the value is the word that files contain."""

    CADENCE = "cadence"
    STANDSTILL = "standstill"
    GAP = "gap"
    JITTER = "jitter"
    TORQUE_CAUSE = "torque_cause"
    UNLIKE = "unlike"


@attrs.frozen
class Body:
    """Identified mass and length of a body, as factors on those of the mechanism file."""

    name: str
    mass: float
    length: float


@attrs.frozen(kw_only=True)
class Diagnosis:
    """Clearances estimated from the drive torque, and what has changed.

    Attributes
    ----------
    state : DiagnosisState
    reason : str
        Why there is no estimate yet, or why it is not to be believed now; empty otherwise.
    next_step : str
        What is known next, and after how many gait cycles; empty where walking adds nothing.
    cycles : int
        Gait cycles in the estimate.
    cycles_not_used : mapping of str to int
        Gait cycles of this run that were not used, by reason: another cadence; a stop and a start in it; a
        bridged gap, or too few torque samples; irregular stamps; a torque that is wrong as received; a crank
        that turns otherwise.
    clearance_m, sigma_m : tuple of float
        Estimated clearance of each clearance joint and its standard deviation; NaN where it is not
        observable.
    changes : tuple of Change
        Significant departures, the oldest first: those by which counted clearances were corrected, and, where
        the state is CHANGED, the one that is not settled yet.
    channel : Channel
        Delay, low-pass and load friction of the drive by the commissioned gait cycles; of a drive that adds
        nothing before.
    bodies : tuple of Body
        Identified masses and lengths that the wear is counted with; empty while it is counted as in the file.
    friction : float
        Factor on the friction in the joints that the wear is counted with.
    load : GroundLoad or None
        Force of the ground by the commissioned gait cycles, if the foot surely carries one.
    compliance : float
        Between the measured crank angle and the crank [rad/(N m)], that the wear is counted with; 0 if rigid.
    """

    state: DiagnosisState = DiagnosisState.OFF
    reason: str = ""
    next_step: str = ""
    cycles: int = 0
    cycles_not_used: Mapping[str, int] = attrs.field(factory=dict)
    clearance_m: tuple[float, ...] = ()
    sigma_m: tuple[float, ...] = ()
    changes: tuple[Change, ...] = ()
    channel: Channel = DIRECT
    bodies: tuple[Body, ...] = ()
    friction: float = 1.0
    load: GroundLoad | None = None
    compliance: float = 0.0
