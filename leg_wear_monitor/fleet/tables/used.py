"""How much of a clearance is used up."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

_Values = TypeVar("_Values", float, NDArray[np.float64])


def used_fraction(clearance_m: _Values, new_m: float, limit_m: float) -> _Values:
    """Fraction of the clearance from new to limit that is used up; above 1 beyond the limit."""
    return (clearance_m - new_m) / (limit_m - new_m)
