"""Samples of the crank and of the drive torque, kept until their gait cycle ends."""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.signature import TorqueSensor, averaged
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.kept_samples import indices_within, is_valid, newest, of_crank
from leg_wear_monitor.twin.kinds import TORQUE
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile, cycle_profile
from leg_wear_monitor.twin.sample import Samples, brings

_LOST = 1.5  # periods of the sensor: in a longer time between two samples, some were lost
_LEAST_CRANK_SAMPLES = 40  # in a gait cycle, for its profile


@attrs.frozen(eq=False)
class TorqueSamples:
    """Stamps [ns] and crank angles [rad], stamps [ns] and drive torques [N m], in the order of arrival."""

    crank_ns: Ints
    crank_rad: Floats
    torque_ns: Ints
    torque_nm: Floats

    def extended(self, piece: Samples) -> "TorqueSamples":
        """With the valid ones of a piece."""
        crank = of_crank(piece)
        torque = piece[is_valid(piece) & brings(piece, TORQUE) & np.isfinite(piece["torque_nm"])]
        return TorqueSamples(
            np.concatenate([self.crank_ns, crank["stamp_ns"]]),
            np.concatenate([self.crank_rad, crank["crank_angle_rad"]]),
            np.concatenate([self.torque_ns, torque["stamp_ns"]]),
            np.concatenate([self.torque_nm, torque["torque_nm"]]),
        )

    def after(self, stamp_ns: int) -> "TorqueSamples":
        """Those from a stamp on."""
        crank, torque = newest(self.crank_ns, stamp_ns), newest(self.torque_ns, stamp_ns)
        return TorqueSamples(
            self.crank_ns[crank], self.crank_rad[crank], self.torque_ns[torque], self.torque_nm[torque]
        )


NO_TORQUE_SAMPLES = TorqueSamples(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


class CycleTorque(NamedTuple):
    """Drive torque over a gait cycle.

    ``angle`` (n,) crank angle [rad], ``torque`` (n,) [N m], ``step`` (n,) torque less that of the sample
    before [N m], NaN where that was lost; ``profile`` how the crank turned; ``period_s`` of the sensor;
    ``late`` from the begin to the first sample, in periods of the sensor; ``jitter`` median departure of the
    times between samples from that period, as a fraction of it.
    """

    angle: Floats
    torque: Floats
    step: Floats
    profile: CrankProfile
    period_s: float
    late: float
    jitter: float


def sensor_period_s(kept: TorqueSamples, begin_ns: int, end_ns: int) -> float:
    """Median time between the torque samples of a gait cycle; NaN where there are fewer than three."""
    stamps, _ = _between(kept.torque_ns, kept.torque_nm, begin_ns, end_ns)
    return float(np.median(np.diff(stamps))) * 1.0e-9 if len(stamps) > 2 else float("nan")


def cycle_torque(kept: TorqueSamples, begin_ns: int, end_ns: int, sensor: TorqueSensor) -> CycleTorque | None:
    """Drive torque between two passages of the crank's zero; None where samples are too few.

    Samples that come faster than signatures need are averaged.
    """
    crank_ns, crank = _between(kept.crank_ns, kept.crank_rad, begin_ns, end_ns)
    torque_ns, torque = _between(kept.torque_ns, kept.torque_nm, begin_ns, end_ns)
    if len(crank_ns) < _LEAST_CRANK_SAMPLES or len(torque_ns) < 2 * sensor.together:
        return None
    turned: Floats = np.asarray(np.unwrap(crank, period=TURN), dtype=np.float64)
    since_s = np.asarray(1.0e-9 * (crank_ns - begin_ns), dtype=np.float64)
    profile = cycle_profile(since_s, turned, 1.0e-9 * (end_ns - begin_ns))
    gap = np.diff(torque_ns, prepend=torque_ns[0]) > _LOST * 1.0e9 * sensor.period_s
    angle = np.interp(torque_ns, crank_ns, turned)
    if sensor.together > 1:
        angle = angle[sensor.together - 1 :: sensor.together]
        torque = averaged(torque, sensor.together)
        gap = averaged(gap.astype(float), sensor.together) > 0.0
        angle = angle[: len(torque)]
    step = np.diff(torque, prepend=np.nan)
    step[gap] = np.nan
    late = 1.0e-9 * float(torque_ns[0] - begin_ns) / sensor.period_s
    period_ns = 1.0e9 * sensor.period_s
    jitter = float(np.median(np.abs(np.diff(torque_ns) - period_ns))) / period_ns
    return CycleTorque(angle, torque, step, profile, sensor.period_s, late, jitter)


def _between(stamps: Ints, values: Floats, begin_ns: int, end_ns: int) -> tuple[Ints, Floats]:
    """Stamps and values of a time, in order."""
    which = indices_within(stamps, begin_ns, end_ns)
    return stamps[which], values[which]
