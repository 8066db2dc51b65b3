"""Check that the drive torque is about the axis that is read; otherwise report the axis that carries one."""

import struct
from collections.abc import Iterable

import numpy as np

_AXES = "xyz"
_TORQUE = (struct.Struct(">3d"), struct.Struct("<3d"))  # the end of a wrench, by the byte order's bit
_KEPT = 400
_LEAST = 40
_SWINGS = 0.3  # RMS of a drive's torque, as a fraction of the predicted one
_STILL = 0.02  # Largest RMS of noise and crosstalk between a sensor's axes, as a fraction


class WrenchAxis:
    """Compares the three torques of wrenches.

    Parameters
    ----------
    axis : str
        Axis that is read, ``x``, ``y`` or ``z``.
    predicted_nm : float, optional
        RMS of the predicted torque at the sensor.
    """

    def __init__(self, axis: str, predicted_nm: float = 0.0) -> None:
        self._axis, self._predicted_nm = _AXES.index(axis), predicted_nm
        self._torques: list[tuple[float, float, float]] = []

    def add(self, wrenches: Iterable[bytes]) -> None:
        """Add sound messages of geometry_msgs/WrenchStamped."""
        for raw in wrenches:
            self._torques.append(_TORQUE[raw[1] & 1].unpack_from(raw, len(raw) - _TORQUE[0].size))
        del self._torques[:-_KEPT]

    def report(self) -> str:
        """Report that a different axis carries the torque; empty if the axis that is read carries one."""
        if len(self._torques) < _LEAST:
            return ""
        with np.errstate(over="ignore", invalid="ignore"):  # a torque may be any finite number
            rms = np.nan_to_num(np.std(self._torques, axis=0))
        largest = int(np.argmax(rms))
        is_still = rms[largest] <= _SWINGS * self._predicted_nm
        if is_still or rms[self._axis] > _STILL * rms[largest]:
            return ""
        # without values, for each change of a message is a line of the log
        return (
            f"the torque about {_AXES[self._axis]} does not change, the one about {_AXES[largest]} does; "
            f"if that is the drive's, set drive_torque.axis to {_AXES[largest]}"
        )
