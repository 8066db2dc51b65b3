"""What explains a measured drive torque: one enum of causes, and a change by one of them."""

import math
from enum import Enum

import attrs

SURE_LOG_ODDS = 5.0  # 150 to 1


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
