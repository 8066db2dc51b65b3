"""Report of a gait cycle."""

import math
from collections.abc import Sequence

from leg_wear_monitor.files import with_same_fields
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate
from leg_wear_monitor.monitor.counted_leg import CountedLeg
from leg_wear_monitor.monitor.forecast.forecast import Forecast
from leg_wear_monitor.monitor.forecast.growth import growth_rate
from leg_wear_monitor.monitor.reports import CycleReport, JointReport
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueStatistics


def cycle_report(
    leg: CountedLeg,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
    estimates: Sequence[KnownClearance | None],
) -> CycleReport:
    """Report of a gait cycle.

    Parameters
    ----------
    leg : CountedLeg
    statistics : CycleStatistics
    forecast : Forecast
    seen : sequence of ClearanceEstimate or None
        Clearances by encoders; None without encoders.
    estimates : sequence of (KnownClearance or None)
        The surest estimate of each clearance.
    """
    torque, joints = statistics.torque, range(len(leg.clearance_joints))
    return with_same_fields(
        CycleReport,
        torque,
        statistics,
        cycle=leg.accounting.cycles,
        joints=tuple(_joint_report(leg, k, statistics, forecast, seen, estimates[k]) for k in joints),
        torque_samples=torque.samples,
        measured_torque_rms_nm=float(torque.measured_rms_nm),
        predicted_torque_rms_nm=float(torque.predicted_rms_nm),
        residual_torque_rms_nm=float(torque.residual_rms_nm),
        torque_mismatch=_mismatch(torque),
        forecast=forecast.leg,
    )


def _mismatch(torque: TorqueStatistics) -> float:
    """Torque residual without load, frictions and lag, as a fraction of the prediction; NaN if not known."""
    predicted_nm = torque.predicted_rms_nm
    return float(torque.unexplained_rms_nm / predicted_nm) if predicted_nm > 0.0 else math.nan


def _joint_report(
    leg: CountedLeg,
    k: int,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
    estimate: KnownClearance | None,
) -> JointReport:
    joint, rate = leg.clearance_joints[k], growth_rate(leg.growth[k])
    mean_n, p99_n = float(statistics.mean_force_n[k]), float(statistics.p99_force_n[k])
    rubbing_w = float(statistics.archard_j[k] / statistics.moving_s)
    error_m = rate.error_m(leg.model_error.relative(k, rate.per_cycle_m)) if rate else None
    return JointReport(
        joint=joint,
        clearance_m=float(statistics.clearance_mean_m[k]),
        clearance_max_m=float(statistics.clearance_max_m[k]),
        growth_m_per_cycle=rate.per_cycle_m if rate else None,
        growth_mps=rate.per_second_m if rate else None,
        growth_error_m_per_cycle=error_m,
        forecast=forecast.joints[k],
        seen=seen[k] if seen else None,
        measured=leg.measured[k],
        peak_force_n=float(statistics.peak_force_n[k]),
        p99_force_n=p99_n,
        mean_force_n=mean_n,
        impacts=int(statistics.impacts[k]),
        load=leg.bushings[joint].load(mean_n, p99_n, rubbing_w),
        estimated_m=estimate.clearance_m if estimate else None,
        estimated_sigma_m=estimate.sigma_m if estimate else None,
    )
