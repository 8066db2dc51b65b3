"""From messages to gait samples: which joint is the crank, where the torque comes from, signs and scales."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.quantity import choice, described, quantity
from leg_wear_monitor.recording.cdr import MESSAGE, decode
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, NO_FAULT, ZERO_STAMP, Samples

AXES = ("x", "y", "z")
TORQUE_SOURCES = ("wrench", "float64", "effort")


def _not_zero(value: float) -> str | None:
    return None if value else f"{value!r} is zero"


@attrs.frozen
class Conversion:
    """How messages become samples: angle = scale · position + offset, torque = scale · what was measured."""

    crank_joint: str = described("name of the crank in joint_states", default="crank")
    crank_scale: float = quantity(
        "", "turns of the crank a turn of the joint, with sign", default=1.0, check=_not_zero
    )
    crank_offset_rad: float = quantity("rad", "crank angle where the joint reads zero", default=0.0)
    torque_source: str = choice(TORQUE_SOURCES, "where the drive torque comes from", default="wrench")
    torque_axis: str = choice(AXES, "axis of the wrench that the crank turns about", default="z")
    torque_scale: float = quantity(
        "", "torque on the crank a unit measured, with sign", default=1.0, check=_not_zero
    )


class Decoder:
    """Samples from messages, one by one or many at a time, with the same numbers.

    Parameters
    ----------
    conversion : Conversion
    """

    def __init__(self, conversion: Conversion) -> None:
        self.conversion = conversion
        self._crank = np.frombuffer(conversion.crank_joint.encode(), np.uint8)
        self._axis = AXES.index(conversion.torque_axis)
        self._effort = conversion.torque_source == "effort"

    def many(self, data: NDArray[np.uint8], messages: NDArray[np.void]) -> Samples:
        """Samples of messages, in their order; one that cannot be used becomes a sample with a fault.

        Parameters
        ----------
        data : (bytes,) array of uint8
        messages : (n,) array of MESSAGE

        Returns
        -------
        (n,) array of GAIT_SAMPLE
        """
        conversion = self.conversion
        samples = np.empty(len(messages), GAIT_SAMPLE)
        decode(data, messages, self._crank, self._axis, self._effort, samples)
        samples["crank_angle_rad"] *= conversion.crank_scale
        samples["crank_angle_rad"] += conversion.crank_offset_rad
        samples["crank_velocity_radps"] *= conversion.crank_scale
        samples["torque_nm"] *= conversion.torque_scale
        return mark_zero_stamps(samples)

    def one(self, raw: bytes, kind: int, log_time_ns: int = 0) -> Samples:
        """Sample of one message as it came.

        Parameters
        ----------
        raw : bytes
        kind : int
            A code of `cdr.TYPES`.
        log_time_ns : int
            Time it came, which stamps a type without a header [ns].

        Returns
        -------
        (1,) array of GAIT_SAMPLE
        """
        message = np.zeros(1, MESSAGE)
        message[0] = (0, len(raw), log_time_ns, log_time_ns, kind)
        return self.many(np.frombuffer(raw, np.uint8), message)


def mark_zero_stamps(samples: Samples) -> Samples:
    """Mark, in place, samples that are well but for a stamp of zero: a clock that had not started."""
    zero = (samples["stamp_ns"] == 0) & (samples["fault"] == NO_FAULT)
    if zero.any():
        samples["fault"][zero] = ZERO_STAMP
    return samples
