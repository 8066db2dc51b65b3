"""What explains a torque mismatch, as values: causes, alternatives, and what remains."""

import math
from enum import Enum

import attrs


class TorqueCause(Enum):
    """Kind of a cause; the value is that of the verdict's ``fault_code``."""

    SIGN = "TORQUE_SIGN"
    SCALE = "TORQUE_SCALE"
    TIMING = "TORQUE_TIMING"
    LOAD = "TORQUE_LOAD"
    MASS = "TORQUE_MASS"


INPUTS = (TorqueCause.SIGN, TorqueCause.SCALE, TorqueCause.TIMING)
"""Causes in what is received, not in the leg."""


@attrs.frozen
class NamedCause:
    """A cause with its value and standard deviation.

    Attributes
    ----------
    cause : TorqueCause
    value, sigma : float
        Measured over predicted torque (SIGN, SCALE); angle by which the crank is ahead of the received one
        [rad]; load at the foot [N]; fraction by which a body's mass is larger.
    subject : str
        The body of a mass.
    """

    cause: TorqueCause
    value: float
    sigma: float
    subject: str = ""


@attrs.frozen
class Timing:
    """Offset of the crank [rad] and lag of the torque [s] with standard deviations, from several speeds."""

    offset_rad: float
    offset_sigma_rad: float
    lag_s: float
    lag_sigma_s: float


@attrs.frozen(kw_only=True)
class TorqueExplanation:
    """Explanation of a torque mismatch.

    Attributes
    ----------
    alternatives : tuple of tuple of NamedCause
        Each explains the torque as well as the others, the best first, and is made of causes that hold at
        once; empty: nothing explains half of the mismatch.
    before, after : float
        What is not explained without and with the first alternative, as a fraction of the predicted RMS.
    after_sigma : float
    limit : float
        Fraction below which a torque counts as predicted.
    speed_radps : float
        Mean crank speed.
    timing : Timing or None
        None while the speeds are too similar.
    bias_nm, bias_sigma_nm : float
        Constant torque that friction cannot be, for the first alternative: it drives where it is negative.
    cycles : int
        Gait cycles in it.
    """

    alternatives: tuple[tuple[NamedCause, ...], ...] = ()
    before: float
    after: float
    after_sigma: float
    limit: float
    speed_radps: float
    timing: Timing | None = None
    bias_nm: float = 0.0
    bias_sigma_nm: float = math.nan
    cycles: int = 0

    @property
    def is_whole(self) -> bool:
        """Whether the torque counts as predicted with the first alternative."""
        return self.after <= self.limit

    @property
    def named(self) -> tuple[NamedCause, ...]:
        """The causes, where they are the only ones that fit and explain the mismatch for the most part."""
        # with less it is a part of a cause that is not among these
        sure = len(self.alternatives) == 1 and (self.is_whole or self.after <= 0.25 * self.before)
        return self.alternatives[0] if sure else ()

    @property
    def is_input_fault(self) -> bool:
        """Whether the torque or the crank angle is wrong as received, so that it says nothing of the leg."""
        found = self.alternatives if self.is_whole else (self.named,)
        return bool(found) and all(any(one.cause in INPUTS for one in each) for each in found)
