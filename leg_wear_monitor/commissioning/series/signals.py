"""Joint positions and torques of a recording as time series, each a candidate for the crank or its torque."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats

WRENCH, FLOAT64, EFFORT = "wrench", "float64", "effort"


@attrs.frozen
class JointName:
    """A joint of a recording: its topic and its name in the messages."""

    topic: str
    joint: str


@attrs.frozen
class TorqueSource:
    """A torque of a recording.

    Attributes
    ----------
    source : str
        Value of `drive_torque.source`.
    topic : str
    component : str
        Axis of a wrench (x, y, z), joint of an effort; empty for a Float64.
    """

    source: str
    topic: str
    component: str = ""

    @property
    def label(self) -> str:
        """The torque in words."""
        if self.source == WRENCH:
            return f"wrench, axis {self.component}, of {self.topic}"
        if self.source == EFFORT:
            return f"effort of {self.component} in {self.topic}"
        return f"Float64 of {self.topic}"


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


@attrs.frozen(eq=False)
class Signals:
    """All candidates of one or more recordings."""

    joints: dict[JointName, Series]
    torques: dict[TorqueSource, Series]


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
