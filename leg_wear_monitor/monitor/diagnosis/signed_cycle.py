"""Gait cycles with the signature of their torque, from the samples that an observer keeps."""

import math

import numpy as np

from leg_wear_monitor.estimate.signature import TorqueSensor, signatures
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.diagnosis import NotUsed
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle, TorqueState
from leg_wear_monitor.monitor.diagnosis.torque_samples import cycle_torque, sensor_period_s
from leg_wear_monitor.twin.settings import INSTANT

# of the sensor's period: steps between samples at times that are more irregular say nothing of its roughness
_JITTER = 0.15


def find_sensor(
    state: TorqueState, begin_ns: int, end_ns: int, config: MonitorConfig, size_nm: float
) -> None:
    """Find the sensor's period in the first gait cycle with torques."""
    if state.sensor is not None:
        return
    period_s = sensor_period_s(state.samples, begin_ns, end_ns)
    if math.isnan(period_s):
        return
    # as commanded: a reference, and all of its signatures, are for one cadence
    cycle_s = 60.0 / abs(config.cadence.commanded_rpm)
    is_instant = config.drive_torque.sampling == INSTANT
    state.sensor = TorqueSensor(float(f"{period_s:.2g}"), cycle_s, size_nm, is_instant)
    # those of a sensor with another rate do not count: the leg is commissioned anew
    size = 2 * state.sensor.phases
    state.baselines = tuple(one for one in state.baselines if one.signatures.shape[1] == size)


def signed_cycle(state: TorqueState, begin_ns: int, end_ns: int) -> SignedCycle | NotUsed:
    """A gait cycle between two stamps, or why it has no signature."""
    sensor = state.sensor
    if sensor is None or not sensor.phases:
        return NotUsed.GAP
    torque = cycle_torque(state.samples, begin_ns, end_ns, sensor)
    if torque is None:
        return NotUsed.GAP
    if torque.jitter > _JITTER:
        return NotUsed.JITTER
    first = np.zeros(len(torque.angle), np.int64)
    signature = signatures(first, torque.angle, torque.torque, torque.step, sensor)[0]
    if not np.isfinite(signature).all():
        return NotUsed.GAP
    return SignedCycle(begin_ns, end_ns, signature, torque.profile, torque.late)
