"""A gear's ratio is that of two numbers of teeth: the simplest fraction within a measurement's error."""

from leg_wear_monitor.errors import LegWearError

_LARGEST_DENOMINATOR = 20
_BY_CHANCE = 0.1  # fractions that may lie within the error by chance


def exact_ratio(measured: float, error: float) -> float | None:
    """The simplest fraction within a relative error, if it is not one of many.

    Parameters
    ----------
    measured : float
        Gear ratio; below 1, its inverse is taken for a fraction.
    error : float
        Largest relative error.

    Returns
    -------
    float or None
        None if no simple fraction lies within the error, or if one would by chance.
    """
    if not measured > 0.0:
        raise LegWearError(f"{measured!r} is no gear ratio, expected one above 0")
    if measured < 1.0:
        inverse = exact_ratio(1.0 / measured, error)
        return None if inverse is None else 1.0 / inverse
    fractions = 0
    for denominator in range(1, _LARGEST_DENOMINATOR + 1):
        fractions += denominator
        if 2.0 * error * measured * fractions > _BY_CHANCE:
            return None
        numerator = round(measured * denominator)
        if abs(numerator / denominator / measured - 1.0) <= error:
            return numerator / denominator
    return None
