"""Decoding of messages to gait samples: selects crank, torque and foot load, and applies signs and scales."""

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.messages.cdr import MESSAGE, decode
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, NO_FAULT, ZERO_STAMP, Samples
from leg_wear_monitor.twin.settings import CONTACT

_AXES = {"x": 0, "y": 1, "z": 2}


class Decoder:
    """Decodes messages to samples, singly or in bulk, with identical results; used live and in replay.

    Parameters
    ----------
    config : MonitorConfig
        The decoder uses `crank_joint`, `crank`, `encoders`, `drive_torque` and `foot_load`.
    """

    def __init__(self, config: MonitorConfig) -> None:
        crank, torque = config.crank, config.drive_torque
        self._crank = np.frombuffer(config.crank_joint.encode(), np.uint8)
        self._crank_scale = crank.sign / crank.gear_ratio
        self._offset_rad = crank.offset_rad
        self._torque_scale = torque.sign * torque.scale * torque.gear_ratio
        self._axis = _AXES[torque.axis]
        self._effort = torque.source == "effort"
        load = config.foot_load
        self._force_scale = 1.0 if load.source == CONTACT else load.sign * load.scale
        names = [name.encode() for name in config.encoders.names]
        self._encoders = np.frombuffer(b"".join(names), np.uint8)
        self._ends = np.cumsum([len(name) for name in names], dtype=np.int64)
        self._signs = np.array(config.encoders.signs or (1.0,) * len(names))

    def many(self, data: NDArray[np.uint8], messages: NDArray[np.void]) -> Samples:
        """Decode messages in order; an unusable message becomes a sample with a fault.

        Parameters
        ----------
        data : (bytes,) array of uint8
        messages : (n,) array of MESSAGE

        Returns
        -------
        (n,) array of GAIT_SAMPLE
        """
        samples = np.empty(len(messages), GAIT_SAMPLE)
        angles = np.empty((len(messages), len(self._ends)))
        force = np.empty((len(messages), 2))
        out = samples, angles, force
        decode(data, messages, self._crank, self._encoders, self._ends, self._axis, self._effort, *out)
        samples["foot_force_n"] = force * self._force_scale
        samples["encoder_rad"] = np.nan
        samples["encoder_rad"][:, : len(self._ends)] = angles * self._signs
        samples["crank_angle_rad"] *= self._crank_scale
        samples["crank_angle_rad"] += self._offset_rad
        samples["crank_velocity_radps"] *= self._crank_scale
        samples["torque_nm"] *= self._torque_scale
        return mark_zero_stamps(samples)

    def one(self, raw: bytes, kind: int, log_time_ns: int = 0) -> Samples:
        """Decode one serialized message.

        Parameters
        ----------
        raw : bytes
        kind : int
            Code of the message's stream.
        log_time_ns : int
            Time of arrival [ns]; stamps messages without a header.

        Returns
        -------
        (1,) array of GAIT_SAMPLE
        """
        message = np.zeros(1, MESSAGE)
        message[0] = (0, len(raw), log_time_ns, log_time_ns, kind)
        return self.many(np.frombuffer(raw, np.uint8), message)


def mark_zero_stamps(samples: Samples) -> Samples:
    """Mark, in place, otherwise valid samples with a stamp of zero: their clock had not started."""
    zero = (samples["stamp_ns"] == 0) & (samples["fault"] == NO_FAULT)
    if zero.any():
        samples["fault"][zero] = ZERO_STAMP
    return samples
