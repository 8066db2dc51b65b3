"""Values over time: positions of a joint, torques."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats


@attrs.frozen(eq=False)
class Series:
    """Values over time, in order of their stamps.

    Attributes
    ----------
    time_s : (n,) array
        Since the first stamp of all recordings [s].
    value : (n,) array
    recording : (n,) array of int
        Index of the recording; an encoder may start anew in each.
    """

    time_s: Floats
    value: Floats
    recording: NDArray[np.int64]


def series(stamp_ns: NDArray[np.int64], value: Floats, recording: NDArray[np.int64], first_ns: int) -> Series:
    """Series of the finite values, in order of their stamps, each stamp once.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps [ns].
    value : (n,) array
    recording : (n,) array of int
    first_ns : int
        Stamp of time 0 [ns].
    """
    finite = np.isfinite(value)
    stamp_ns, value, recording = stamp_ns[finite], value[finite], recording[finite]
    stamps, chosen = np.unique(stamp_ns, return_index=True)
    return Series(np.asarray(1.0e-9 * (stamps - first_ns), np.float64), value[chosen], recording[chosen])
