"""Causes of a measured drive torque: one enum of causes, named causes, changes and explanations."""

import math
from enum import Enum

import attrs

# No slow import is allowed here, because `--help` lists the alarms, which name causes.

# delays of a drive that are estimated: from an offset of 0.13 rad at 60 rpm to a lag of 40 ms
LEAST_DELAY_S, MOST_DELAY_S = -0.02, 0.04

SURE_LOG_ODDS = 5.0  # 150 to 1
# log odds against the runner-up: an error of the model affects all phases, and can favour a wrong joint.
# Under 300 N of load and twice the friction, B had 7 where G was open; right names had 15 and more there, 85
# and more in the air (2026-11-25)
SURE_OF_NAME = 10.0
# multiple of the modelled clearance: smaller openings get wrong names if masses are 5 % off (diagnosis.md)
CORRECTED_FROM = 1.3
SURE_SIGMAS = 2.0  # a clearance is surely above or below its limit by this number of standard deviations


class Cause(Enum):
    """Cause of a drive torque that is not as predicted; the value is human-readable.

    Attributes
    ----------
    fault_code : str
        Stable name, the same for every detector.
    """

    fault_code: str

    def __new__(cls, words: str, fault_code: str) -> "Cause":
        """Member whose value is its words."""
        member = object.__new__(cls)
        member._value_, member.fault_code = words, fault_code
        return member

    CLEARANCE = "clearance", "CLEARANCE_CHANGED"
    SEVERAL = "clearances of several joints", "CLEARANCE_CHANGED"
    SIGN = "sign of the torque sensor", "TORQUE_SIGN"
    SCALE = "scale of the torque sensor", "TORQUE_SCALE"
    # at one speed, the two cannot be distinguished
    TIMING = "crank offset or lag of the torque", "TORQUE_TIMING"
    LAG = "lag of the torque sensor", "TORQUE_TIMING"
    NOISE = "noise of the torque sensor", "TORQUE_NOISE"
    BIAS = "zero of the torque sensor", "TORQUE_BIAS"
    LOAD = "load at the foot", "TORQUE_LOAD"
    FRICTION = "friction of the drive", "FRICTION_CHANGED"
    LOAD_FRICTION = "friction of the drive under load", "FRICTION_CHANGED"
    JOINT_FRICTION = "friction in the joints", "FRICTION_CHANGED"
    MASS = "mass of a body", "TORQUE_MASS"
    LENGTH = "length of a body", "MECHANISM_CHANGED"
    UNKNOWN = "unknown", "MECHANISM_CHANGED"


INPUTS = (Cause.SIGN, Cause.SCALE, Cause.TIMING, Cause.LAG, Cause.NOISE)
"""Causes in the received signals, not in the leg."""


@attrs.frozen
class NamedCause:
    """A cause with its value and standard deviation.

    Attributes
    ----------
    cause : Cause
    value, sigma : float
        Clearance [m], the widest of several joints;
        measured over predicted torque (SIGN, SCALE); angle by which the crank is ahead of its
        measured angle (TIMING) [rad]; lag [s]; standard deviation of a sample (NOISE) [N m];
        constant torque beyond the bounds of friction,
        negative where it drives (BIAS) [N m]; change of the friction [N m], or of the fraction of the
        torque that it is (LOAD_FRICTION); load at the foot [N]; fraction by which a mass, a length or
        the friction in all joints (JOINT_FRICTION) is larger.
    subject : str
        The joint, or the body, concerned; empty where there is none.
    joints : tuple of NamedCause
        The clearance of each of several joints; empty otherwise.
    """

    cause: Cause
    value: float
    sigma: float
    subject: str = ""
    joints: tuple["NamedCause", ...] = ()


@attrs.frozen(kw_only=True)
class Change(NamedCause):
    """A significant departure of the leg from the monitor's wear model.

    Attributes
    ----------
    since_ns : int
        Stamp of the first gait cycle that belongs to the change.
    counted : float
        Value in the monitor's model, in the unit of `value`.
    log_odds : float
        Natural logarithm of the odds against the leg as modelled.
    runner_up : str
        Next best explanation, human-readable; empty if there is none.
    runner_up_log_odds : float
        Natural logarithm of the odds against the runner-up.
    is_corrected : bool
        True if this change corrected the modelled clearance.
    """

    since_ns: int
    counted: float
    log_odds: float
    runner_up: str = ""
    runner_up_log_odds: float = math.inf
    is_corrected: bool = False

    @property
    def is_named(self) -> bool:
        """True if no other explanation is nearly as good."""
        return self.runner_up_log_odds >= SURE_OF_NAME

    @property
    def is_sure(self) -> bool:
        """True if a clearance has changed, much more probably than anything else."""
        return self.cause is Cause.CLEARANCE and self.log_odds >= SURE_LOG_ODDS and self.is_named

    @property
    def is_wide(self) -> bool:
        """True if a clearance is so much wider than modelled that the monitor corrects it."""
        return self.cause is Cause.CLEARANCE and self.value >= CORRECTED_FROM * self.counted


@attrs.frozen(kw_only=True)
class TorqueExplanation:
    """Explanation of a torque residual.

    Attributes
    ----------
    alternatives : tuple of NamedCause
        Each explains the torque as well as the others, the best first; empty: no single cause explains it.
    before, after : float
        Torque residual without and with the first alternative, as a fraction of the predicted RMS.
    after_sigma : float
    limit : float
        Fraction below which a torque counts as predicted.
    speed_radps : float
        Mean crank speed.
    """

    alternatives: tuple[NamedCause, ...] = ()
    before: float
    after: float
    after_sigma: float
    limit: float
    speed_radps: float

    @property
    def is_whole(self) -> bool:
        """True if the torque counts as predicted with the first alternative."""
        return self.after <= self.limit

    @property
    def named(self) -> NamedCause | None:
        """The cause, if no other cause fits and it explains most of the torque residual."""
        # a smaller fraction is part of an unknown cause
        sure = len(self.alternatives) == 1 and (self.is_whole or self.after <= 0.25 * self.before)
        return self.alternatives[0] if sure else None

    @property
    def is_input_fault(self) -> bool:
        """True if the torque or the crank angle is wrong as received."""
        return bool(self._possible) and all(one.cause in INPUTS for one in self._possible)

    @property
    def hides_leg(self) -> bool:
        """True if the received torque contains no information about the leg.

        A delay or an offset of the crank does not hide it, because the diagnosis estimates them with the leg.
        """
        return self.is_input_fault and not all(map(self._is_delay, self._possible))

    @property
    def _possible(self) -> tuple[NamedCause, ...]:
        """The alternatives; unless they explain everything, only the certain one."""
        return self.alternatives if self.is_whole else tuple(filter(None, (self.named,)))

    def _is_delay(self, one: NamedCause) -> bool:
        """True if the torque comes later by a delay that is estimated."""
        return one.cause is Cause.TIMING and LEAST_DELAY_S < -one.value / self.speed_radps < MOST_DELAY_S


def beyond_friction(constant_nm: float, sigma_nm: float, max_friction_nm: float) -> NamedCause:
    """Part of a constant torque along the motion that friction cannot be: it is negative, or too large."""
    beyond = min(constant_nm, 0.0) + max(constant_nm - max_friction_nm, 0.0)
    return NamedCause(Cause.BIAS, beyond, sigma_nm)
