"""Check that the drive's torque is on the axis that is read; otherwise report the axis that carries one."""

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import deserialize_message

from leg_wear_monitor.messages.streams import WRENCH_STAMPED
from leg_wear_monitor.ros.inputs.inbox import Arrival
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

_AXES = "xyz"
_OF_A_BLOCK = 4  # messages that are read whole, so that this costs little
_KEPT = 400
_LEAST = 40
_SWINGS = 0.3  # RMS of a drive's torque, as a fraction of the predicted one
_STILL = 0.02  # RMS of noise and of what a sensor's axes take from each other, as a fraction of the largest


class WrenchAxis:
    """Compares the three torques of wrenches.

    Parameters
    ----------
    axis : str
        The one that is read, ``x``, ``y`` or ``z``.
    predicted_nm : float
        RMS of the predicted torque, as the sensor has it.
    """

    def __init__(self, axis: str, predicted_nm: float) -> None:
        self._axis, self._predicted_nm = _AXES.index(axis), predicted_nm
        self._torques: list[tuple[float, float, float]] = []

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Read some of the messages, given the samples decoded from them."""
        wrenches = [
            one.raw
            for one, fault in zip(arrivals, samples["fault"], strict=True)
            if one.kind == WRENCH_STAMPED and fault == NO_FAULT
        ]
        for raw in wrenches[-_OF_A_BLOCK:]:
            torque = deserialize_message(raw, WrenchStamped).wrench.torque
            self._torques.append((torque.x, torque.y, torque.z))
        del self._torques[:-_KEPT]

    def report(self) -> str:
        """Report that another axis than the one that is read carries a torque; empty if that is not so."""
        if len(self._torques) < _LEAST:
            return ""
        rms = np.std(self._torques, axis=0)
        largest = int(np.argmax(np.nan_to_num(rms)))
        if rms[largest] < _SWINGS * self._predicted_nm or rms[self._axis] > _STILL * rms[largest]:
            return ""
        # without values, for each change of a message is a line of the log
        return (
            f"the torque about {_AXES[self._axis]} does not change, the one about {_AXES[largest]} does; "
            f"if that is the drive's, set drive_torque.axis to {_AXES[largest]}"
        )
