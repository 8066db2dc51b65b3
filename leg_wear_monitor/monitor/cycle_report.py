"""A gait cycle's statistics from the twin, as a report with growth and remaining life."""

import math
from collections.abc import Sequence

from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.forecast.forecast import Forecast
from leg_wear_monitor.monitor.forecast.measurement import growth_rate
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import CycleReport, JointReport, shown_by_torque
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueStatistics


def cycle_report(
    parts: Parts,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
) -> CycleReport:
    """Report of a gait cycle that is counted.

    Parameters
    ----------
    parts : Parts
    statistics : CycleStatistics
    forecast : Forecast
    seen : sequence of ClearanceEstimate or None
        None without encoders.
    """
    torque, diagnosis = statistics.torque, parts.diagnosis
    joints = range(len(parts.clearance_joints))
    return CycleReport(
        cycle=parts.accounting.state.cycles,
        begin_ns=statistics.begin_ns,
        stamp_ns=statistics.stamp_ns,
        cadence_rpm=statistics.cadence_rpm,
        moving_s=statistics.moving_s,
        bridged_s=statistics.bridged_s,
        joints=tuple(_joint_report(parts, k, statistics, forecast, seen, diagnosis) for k in joints),
        torque_samples=torque.samples,
        measured_torque_rms_nm=float(torque.measured_rms_nm),
        predicted_torque_rms_nm=float(torque.predicted_rms_nm),
        residual_torque_rms_nm=float(torque.residual_rms_nm),
        torque_mismatch=_mismatch(torque),
        load_n=float(torque.load_n),
        load_sigma_n=float(torque.load_sigma_n),
        load_acting_n=float(torque.load_acting_n),
        friction_nm=float(torque.friction_nm),
        load_friction=float(torque.load_friction),
        load_friction_sigma=float(torque.load_friction_sigma),
        torque_lag_s=float(torque.torque_lag_s),
        friction_sigma_nm=float(torque.friction_sigma_nm),
        torque_lag_sigma_s=float(torque.torque_lag_sigma_s),
        forecast=forecast.leg,
        is_followed=statistics.is_followed,
    )


def _mismatch(torque: TorqueStatistics) -> float:
    """What load, frictions and lag do not explain, as a fraction of what was predicted; NaN if not known."""
    predicted_nm = torque.predicted_rms_nm
    return float(torque.unexplained_rms_nm / predicted_nm) if predicted_nm > 0.0 else math.nan


def _joint_report(
    parts: Parts,
    k: int,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
    diagnosis: Diagnosis,
) -> JointReport:
    joint, rate = parts.clearance_joints[k], growth_rate(parts.state.growth[k])
    mean_n, p99_n = float(statistics.mean_force_n[k]), float(statistics.p99_force_n[k])
    rubbing_w = float(statistics.archard_j[k] / statistics.moving_s)
    load = parts.bushings[joint].load(mean_n, p99_n, rubbing_w) if statistics.is_followed else None
    error_m = rate.error_m(parts.model_error.relative(k, rate.per_cycle_m)) if rate else None
    return JointReport(
        joint=joint,
        clearance_m=float(statistics.clearance_mean_m[k]),
        clearance_max_m=float(statistics.clearance_max_m[k]),
        growth_m_per_cycle=rate.per_cycle_m if rate else None,
        growth_mps=rate.per_second_m if rate else None,
        growth_error_m_per_cycle=error_m,
        forecast=forecast.joints[k],
        seen=seen[k] if seen else None,
        measured=parts.measured[k],
        peak_force_n=float(statistics.peak_force_n[k]),
        p99_force_n=p99_n,
        mean_force_n=mean_n,
        impacts=int(statistics.impacts[k]) if statistics.is_followed else None,
        load=load,
        sampling_sigma_m=float(parts.accounting.sampling_sigma_m[k]),
        shown=shown_by_torque(k, diagnosis),
    )
