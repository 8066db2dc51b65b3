"""Estimate of a joint's clearance from further encoders."""

import math
from enum import Enum

import attrs

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate

ESTIMATED_M = 1.0e-4  # largest standard deviation of an observable clearance
SURE_SIGMAS = 4.0
LEAST_M = 5.0e-5  # smallest departure that is reported


class ClearanceObservation(Enum):
    """Observability of a clearance; the value is human-readable."""

    WAITING = "not enough gait cycles with encoders yet"
    COMMISSIONING = "the encoders are being commissioned"
    NOT_OBSERVABLE = "not observable with these encoders"
    SEEN = "seen by encoders"


@attrs.frozen(kw_only=True)
class ClearanceEstimate:
    """A clearance estimated from encoders.

    Attributes
    ----------
    observation : ClearanceObservation
    clearance_m, sigma_m : float
        Clearance and its standard deviation; NaN unless it is estimated.
    departure_m : float
        Estimated minus counted clearance; NaN unless it is estimated.
    believed : bool
        Whether the forecast uses it: not if the model gives it a tail probability below 0.135 %.
    """

    observation: ClearanceObservation
    clearance_m: float = math.nan
    sigma_m: float = math.nan
    departure_m: float = math.nan
    believed: bool = False

    @property
    def is_other(self) -> bool:
        """Whether the clearance differs significantly from the counted one."""
        return abs(self.departure_m) >= max(LEAST_M, SURE_SIGMAS * self.sigma_m)

    @property
    def surely_m(self) -> float:
        """Size of a significant departure, 0 if there is none; NaN unless it is estimated."""
        return abs(self.departure_m) if self.is_other else 0.0 * self.departure_m


def clearance_estimates(found: Estimate, counted_m: Floats) -> tuple[ClearanceEstimate, ...]:
    """Estimates of each joint, compared with the counted clearances (k,) [m]."""
    return tuple(
        _estimate(float(clearance), float(sigma), float(counted))
        for clearance, sigma, counted in zip(found.clearance_m, found.sigma_m, counted_m, strict=True)
    )


def _estimate(clearance_m: float, sigma_m: float, counted_m: float) -> ClearanceEstimate:
    if sigma_m > ESTIMATED_M:
        return ClearanceEstimate(observation=ClearanceObservation.NOT_OBSERVABLE)
    return ClearanceEstimate(
        observation=ClearanceObservation.SEEN,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        departure_m=clearance_m - counted_m,
    )
