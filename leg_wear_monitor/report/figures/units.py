"""Units in which values are easy to read."""

_LENGTHS = ((1.0e12, "pm"), (1.0e9, "nm"), (1.0e6, "µm"), (1.0e3, "mm"))


def length_unit(greatest_m: float) -> tuple[float, str]:
    """Factor from metres, and name, of the smallest unit in which a length [m] is below 1000."""
    return next(((scale, unit) for scale, unit in _LENGTHS if scale * greatest_m < 1000.0), _LENGTHS[-1])


def time_unit(longest_s: float) -> tuple[float, str]:
    """Factor from seconds, and name, of a unit in which a time [s] is of a handy size."""
    if longest_s > 3.0 * 3600.0:
        return 1.0 / 3600.0, "h"
    return (1.0 / 60.0, "min") if longest_s > 300.0 else (1.0, "s")
