"""Gait cycles with the signature of their drive torque, from the samples that an observer keeps."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.estimate.signature import TorqueSensor, averaged, signatures
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    UNUSABLE_CYCLES,
    UNUSED_CYCLES,
    NotUsed,
    SignedCycle,
    TorqueSamples,
    TorqueState,
    mean_of,
)
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile
from leg_wear_monitor.twin.sample import INSTANT, within

_LOST = 1.5  # periods of the sensor: in a longer time between two samples, some were lost
_LEAST_CRANK_SAMPLES = 40  # least number of samples in a gait cycle for its profile

# largest jitter as a fraction of the sensor's period; beyond it, steps between samples do not show the
# roughness
_JITTER = 0.15

# A period near a rounding boundary may round either way between runs, so both are tried.
_ROUNDED = (1.0, 0.995, 1.005)


class CycleTorque(NamedTuple):
    """Drive torque over a gait cycle.

    ``angle`` (n,) crank angle [rad], ``torque`` (n,) [N m], ``step`` (n,) torque minus the torque of the
    sample before [N m], NaN if the sample before was lost; ``profile`` how the crank turned; ``jitter``
    median departure of the times between samples from the sensor's period, as a fraction of it;
    ``temperature_c`` mean temperature of the drive, NaN if it is not measured.
    """

    angle: Floats
    torque: Floats
    step: Floats
    profile: CrankProfile
    jitter: float
    temperature_c: float


def _jitter(between_ns: Ints, period_ns: float) -> float:
    """Median departure of times between samples (n,) from a period, as a fraction of it."""
    return float(np.median(np.abs(between_ns - period_ns))) / period_ns


def cycle_torque(kept: TorqueSamples, begin_ns: int, end_ns: int, sensor: TorqueSensor) -> CycleTorque | None:
    """Drive torque between two passages of the crank's zero; None if there are too few samples.

    Samples at a higher rate than signatures need are averaged.
    """
    cranks, torques = within(kept.crank, begin_ns, end_ns), within(kept.torque, begin_ns, end_ns)
    crank_ns, crank = cranks["stamp_ns"], cranks["crank_angle_rad"]
    torque_ns, torque = torques["stamp_ns"], torques["torque_nm"]
    if len(crank_ns) < _LEAST_CRANK_SAMPLES or len(torque_ns) < 2 * sensor.together:
        return None
    turned: Floats = np.asarray(np.unwrap(crank, period=TURN), dtype=np.float64)
    since_s = np.asarray(1.0e-9 * (crank_ns - begin_ns), dtype=np.float64)
    profile = cycle_profile(since_s, turned, 1.0e-9 * (end_ns - begin_ns))
    gap = np.diff(torque_ns, prepend=torque_ns[0]) > _LOST * 1.0e9 * sensor.period_s
    # the ends are passages of zero, which torques may be nearer to than the first and the last crank angle
    ends = TURN * np.round(turned[[0, -1]] / TURN)
    place = np.concatenate([[begin_ns], crank_ns, [end_ns]])
    angle = np.interp(torque_ns, place, np.concatenate([ends[:1], turned, ends[1:]]))
    if sensor.together > 1:
        angle = angle[sensor.together - 1 :: sensor.together]
        torque = averaged(torque, sensor.together)
        gap = averaged(gap.astype(float), sensor.together) > 0.0
        angle = angle[: len(torque)]
    step = np.diff(torque, prepend=np.nan)
    step[gap] = np.nan
    jitter = _jitter(np.diff(torque_ns), 1.0e9 * sensor.period_s)
    return CycleTorque(angle, torque, step, profile, jitter, mean_of(torques["temperature_c"]))


def find_sensor(
    state: TorqueState, begin_ns: int, end_ns: int, config: MonitorConfig, size_nm: float
) -> None:
    """Find the sensor's period in the first gait cycle with torques, and again where its rate has changed.

    A short disturbance does not discard the knowledge of the leg, or a change that was found.
    """
    own = state.sensor
    is_known = state.reference is not None or len(state.waiting) >= FIRST_CYCLES
    last = (NotUsed.JITTER,) * (UNUSED_CYCLES if is_known else UNUSABLE_CYCLES)
    if own is not None and (state.changes or state.unused[-len(last) :] != last):
        return
    between_ns = np.diff(within(state.samples.torque, begin_ns, end_ns)["stamp_ns"])
    period_ns = float(np.median(between_ns)) if len(between_ns) > 1 else math.nan
    if math.isnan(period_ns) or (own is not None and _jitter(between_ns, period_ns) > _JITTER):
        return
    near = [float(f"{part * (1.0e-9 * period_ns):.2g}") for part in _ROUNDED]
    known = {one.period_s for one in state.baselines}
    period_s = next((one for one in near if one in known), near[0])
    # cycles at the commanded cadence only, because a reference is for one cadence
    cycle_s = 60.0 / abs(config.cadence.commanded_rpm)
    if own is None or own.period_s != period_s:
        is_instant = config.drive_torque.sampling == INSTANT
        state.measure_with(TorqueSensor(period_s, cycle_s, size_nm, is_instant))


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
    return SignedCycle(begin_ns, end_ns, signature, torque.profile, torque.temperature_c)
