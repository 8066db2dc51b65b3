"""Valid ranges of clearances and their limits, with a hint at the likely wrong unit of an invalid value."""

LEAST_FRACTION = 0.01  # least measured clearance over the new one: wear widens it, so less is a typing error
LEAST_SIGMA_M = 1.0e-8  # least standard deviation: no clearance gauge resolves 10 nm

_SLIPS = (1.0e-3, 1.0e3, 1.0e-6, 1.0e6)  # factors of wrong units: mm for m, m for mm, um for m, m for um


def limit_fault(joint: str, fresh_m: float, radius_m: float, limit_m: float) -> str | None:
    """Error message for an invalid limit of a joint's mean radial clearance.

    Parameters
    ----------
    joint : str
    fresh_m, radius_m : float
        Clearance when new and radius of the bushing: the limit must lie between them.
    limit_m : float

    Returns
    -------
    str or None
        None if the limit is valid.
    """
    if fresh_m < limit_m < radius_m:
        return None
    meant = _meant(limit_m, fresh_m, radius_m)
    hint = "" if meant is None else f"; did you mean {meant:g} m ({1.0e3 * meant:g} mm)?"
    return (
        f"{limit_m:g} m is not between {fresh_m:g} m, the new clearance of joint {joint}, "
        f"and {radius_m:g} m, the radius of its bushing{hint}"
    )


def measured_fault(joint: str, fresh_m: float, radius_m: float, measured_m: float) -> str | None:
    """Error message for an invalid measured radial clearance [m]; otherwise as `limit_fault`."""
    least_m = LEAST_FRACTION * fresh_m
    if least_m <= measured_m <= radius_m:
        return None
    meant = _meant(measured_m, least_m, radius_m)
    hint = "" if meant is None else f"; did you mean {1.0e3 * meant:g} mm?"
    return (
        f"{1.0e3 * measured_m:g} mm is not between {1.0e3 * least_m:g} mm, {100.0 * LEAST_FRACTION:g} % of "
        f"the new clearance of joint {joint}, and {1.0e3 * radius_m:g} mm, the radius of its bushing{hint}"
    )


def sigma_fault(radius_m: float, sigma_m: float) -> str | None:
    """Error message for an invalid standard deviation [m] of a measured clearance; None if it is valid."""
    if LEAST_SIGMA_M <= sigma_m <= radius_m:
        return None
    bounds = f"from {1.0e3 * LEAST_SIGMA_M:g} mm to {1.0e3 * radius_m:g} mm, the bushing's radius"
    return f"{1.0e3 * sigma_m:g} mm is not a standard deviation {bounds}"


def _meant(value_m: float, above_m: float, below_m: float) -> float | None:
    """The value [m] in another unit of length that lies between the bounds; None if there is none."""
    return next((value_m * slip for slip in _SLIPS if above_m < value_m * slip < below_m), None)
