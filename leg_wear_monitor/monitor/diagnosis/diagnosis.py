"""What the measured drive torque shows of the clearances, compared with those that the monitor counts."""

import math
from collections.abc import Mapping
from enum import Enum

import attrs

SURE_LOG_ODDS = 5.0  # 150 to 1


class DiagnosisState(Enum):
    """What the diagnosis can report; the value is the word that files contain."""

    OFF = "off"
    WAITING = "waiting"
    AS_COUNTED = "as_counted"
    CHANGED = "changed"


class Cause(Enum):
    """What explains a change of the drive torque; the value is human-readable."""

    CLEARANCE = "clearance"
    LOAD = "load at the foot"
    FRICTION = "friction of the drive"
    SCALE = "scale of the torque sensor"
    LAG = "lag of the torque sensor"
    CRANK_OFFSET = "offset of the crank encoder"
    MASS = "mass of a body"
    LENGTH = "length of a body"
    UNKNOWN = "unknown"


class NotUsed(Enum):
    """Why a gait cycle says nothing of the clearances; the value is the word that files contain."""

    CADENCE = "cadence"
    GAP = "gap"
    JITTER = "jitter"
    TORQUE_CAUSE = "torque_cause"
    UNLIKE = "unlike"


@attrs.frozen(kw_only=True)
class Change:
    """A significant departure of the leg from the one that the monitor counts.

    Attributes
    ----------
    cause : Cause
    subject : str
        The joint, or the body, concerned; empty where there is none.
    since_ns : int
        Stamp of the first gait cycle that belongs to the change.
    value, sigma : float
        Estimated value and its standard deviation: clearance [m], load [N], friction [N m], fraction of the
        scale, lag [s], offset [rad], fraction of the mass or length.
    counted : float
        Value that the monitor supposes, in the same unit.
    log_odds : float
        Natural logarithm of the odds against the leg as counted.
    runner_up : str
        Next best explanation, human-readable; empty if there is none.
    runner_up_log_odds : float
        Natural logarithm of the odds against the runner-up.
    is_corrected : bool
        Whether the counted clearance was corrected by it.
    """

    cause: Cause
    subject: str = ""
    since_ns: int
    value: float
    sigma: float
    counted: float
    log_odds: float
    runner_up: str = ""
    runner_up_log_odds: float = math.inf
    is_corrected: bool = False

    @property
    def is_sure(self) -> bool:
        """Whether a clearance has changed, much more probably than anything else."""
        odds = min(self.log_odds, self.runner_up_log_odds)
        return self.cause is Cause.CLEARANCE and odds >= SURE_LOG_ODDS


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
    cycles : int
        Gait cycles in the estimate.
    cycles_not_used : mapping of str to int
        Gait cycles of this run that were not used, by reason: another cadence; standstill, or too few torque
        samples; irregular stamps; a torque that is wrong as received; a crank that turns otherwise.
    clearance_m, sigma_m : tuple of float
        Estimated clearance of each clearance joint and its standard deviation; NaN where it is not
        observable.
    changes : tuple of Change
        Significant departures, the oldest first: those by which counted clearances were corrected, and, where
        the state is CHANGED, the one that is not settled yet.
    bodies : tuple of Body
        Identified masses and lengths that the wear is counted with; empty while it is counted as in the file.
    friction : float
        Factor on the friction in the joints that the wear is counted with.
    """

    state: DiagnosisState = DiagnosisState.OFF
    reason: str = ""
    cycles: int = 0
    cycles_not_used: Mapping[str, int] = attrs.field(factory=dict)
    clearance_m: tuple[float, ...] = ()
    sigma_m: tuple[float, ...] = ()
    changes: tuple[Change, ...] = ()
    bodies: tuple[Body, ...] = ()
    friction: float = 1.0
