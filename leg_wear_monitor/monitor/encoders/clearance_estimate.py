"""What further encoders say of a joint's clearance."""

import math
from enum import Enum

import attrs

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate

ESTIMATED_M = 1.0e-4  # standard deviation of a clearance that is seen, at most
SURE_SIGMAS = 4.0
LEAST_M = 5.0e-5  # a departure that is worth telling


class ClearanceObservation(Enum):
    """Whether encoders show a clearance; the value is human-readable."""

    WAITING = "not enough gait cycles with encoders yet"
    COMMISSIONING = "the encoders are being commissioned"
    NOT_OBSERVABLE = "not observable with these encoders"
    SEEN = "seen by encoders"


@attrs.frozen(kw_only=True)
class ClearanceEstimate:
    """A clearance as encoders show it.

    Attributes
    ----------
    observation : ClearanceObservation
    clearance_m, sigma_m : float
        And its standard deviation; NaN unless it is seen.
    departure_m : float
        By how much it is larger than the one that is counted; NaN unless it is seen.
    believed : bool
        Whether the forecast takes it in: not, if that holds it next to impossible.
    """

    observation: ClearanceObservation
    clearance_m: float = math.nan
    sigma_m: float = math.nan
    departure_m: float = math.nan
    believed: bool = False

    @property
    def is_other(self) -> bool:
        """Whether the clearance surely is another than the one that is counted."""
        return abs(self.departure_m) >= max(LEAST_M, SURE_SIGMAS * self.sigma_m)

    @property
    def surely_m(self) -> float:
        """Size of a sure departure, 0 if there is none; NaN unless it is seen."""
        return abs(self.departure_m) if self.is_other else 0.0 * self.departure_m


def clearance_estimates(found: Estimate, counted_m: Floats) -> tuple[ClearanceEstimate, ...]:
    """What an estimate says of each joint, beside the clearances (k,) that are counted [m]."""
    return tuple(
        _seen(float(clearance), float(sigma), float(counted))
        for clearance, sigma, counted in zip(found.clearance_m, found.sigma_m, counted_m, strict=True)
    )


def _seen(clearance_m: float, sigma_m: float, counted_m: float) -> ClearanceEstimate:
    if sigma_m > ESTIMATED_M:
        return ClearanceEstimate(observation=ClearanceObservation.NOT_OBSERVABLE)
    return ClearanceEstimate(
        observation=ClearanceObservation.SEEN,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        departure_m=clearance_m - counted_m,
    )
