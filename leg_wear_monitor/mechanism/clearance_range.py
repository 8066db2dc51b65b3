"""Between which bounds a clearance of a joint can lie, and what a value outside them likely means."""

LEAST_FRACTION = 0.01  # of the new clearance: what is below it was not measured but mistyped
LEAST_SIGMA_M = 1.0e-8  # no gauge is that good

_SLIPS = (1.0e-3, 1.0e3, 1.0e-6, 1.0e6)  # mm for m, m for mm, um for m, m for um


def limit_fault(joint: str, fresh_m: float, radius_m: float, limit_m: float) -> str | None:
    """What is wrong with a limit of a joint's mean radial clearance.

    Parameters
    ----------
    joint : str
    fresh_m, radius_m : float
        Clearance when new and radius of the bushing: the first is there from the start, the second is
        never reached.
    limit_m : float

    Returns
    -------
    str or None
        None if nothing is wrong.
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
    """What is wrong with a measured radial clearance [m]; parameters and return value as of `limit_fault`."""
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
    """What is wrong with the standard deviation [m] of a measured clearance, None if nothing."""
    if LEAST_SIGMA_M <= sigma_m <= radius_m:
        return None
    bounds = f"from {1.0e3 * LEAST_SIGMA_M:g} mm to {1.0e3 * radius_m:g} mm, the bushing's radius"
    return f"{1.0e3 * sigma_m:g} mm is not a standard deviation {bounds}"


def _meant(value_m: float, above_m: float, below_m: float) -> float | None:
    """The value in another unit of length that lies between the bounds, None if there is none."""
    return next((value_m * slip for slip in _SLIPS if above_m < value_m * slip < below_m), None)
