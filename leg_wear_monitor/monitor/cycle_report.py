"""A gait cycle's statistics from the twin, as a report with growth and remaining life."""

import math
from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.mechanism.materials.load import Bushing
from leg_wear_monitor.monitor.diagnosis.diagnosis import Diagnosis
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceEstimate
from leg_wear_monitor.monitor.forecast.forecast import Forecast, JointForecast
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow, growth_rate
from leg_wear_monitor.monitor.forecast.model_error import ModelError
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.reports import CycleReport, JointReport
from leg_wear_monitor.monitor.verdict.situation import SeenClearance
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueStatistics


def cycle_report(
    statistics: CycleStatistics,
    cycle: int,
    bushings: Mapping[str, Bushing],
    growth: Sequence[GrowthWindow],
    model: ModelError,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None = None,
    measured: Sequence[Measurement | None] | None = None,
    sampling_sigma_m: Sequence[float] | None = None,
    diagnosis: Diagnosis | None = None,
) -> CycleReport:
    """Report of a gait cycle.

    Parameters
    ----------
    statistics : CycleStatistics
    cycle : int
        Its number over all runs.
    bushings : mapping of str to Bushing
        Those of the clearance joints, in their order.
    growth : sequence of GrowthWindow
        Of each of them, this cycle included.
    model : ModelError
        What the growth of each may be off beside its scatter.
    forecast : Forecast
    seen : sequence of ClearanceEstimate, optional
    measured : sequence of Measurement or None, optional
        Last measurement of each joint's part.
    sampling_sigma_m : sequence of float, optional
        Standard deviation of each mean clearance, because not all gait cycles were followed; default 0.
    diagnosis : Diagnosis, optional
        Clearances that the drive torque shows.
    """
    torque = statistics.torque
    return CycleReport(
        cycle=cycle,
        begin_ns=statistics.begin_ns,
        stamp_ns=statistics.stamp_ns,
        cadence_rpm=statistics.cadence_rpm,
        moving_s=statistics.moving_s,
        bridged_s=statistics.bridged_s,
        joints=tuple(
            _joint_report(
                statistics,
                k,
                joint,
                bushing,
                growth[k],
                model,
                forecast.joints[k],
                seen[k] if seen else None,
                measured[k] if measured else None,
                float(sampling_sigma_m[k]) if sampling_sigma_m is not None else 0.0,
                _shown(k, diagnosis),
            )
            for k, (joint, bushing) in enumerate(bushings.items())
        ),
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


def latest(report: CycleReport, followed: CycleReport | None) -> CycleReport:
    """A gait cycle; one that was tracked only, with forces and torques of the last one that was followed."""
    if report.is_followed or followed is None:
        return report
    own = ("cycle", "begin_ns", "stamp_ns", "cadence_rpm", "moving_s", "bridged_s", "forecast")
    joints = tuple(
        attrs.evolve(
            new,
            peak_force_n=old.peak_force_n,
            p99_force_n=old.p99_force_n,
            mean_force_n=old.mean_force_n,
            impacts=old.impacts,
            load=old.load,
        )
        for new, old in zip(report.joints, followed.joints, strict=True)
    )
    return attrs.evolve(followed, joints=joints, **{name: getattr(report, name) for name in own})


def with_forecast(
    report: CycleReport,
    forecast: Forecast,
    measured: Sequence[Measurement | None],
    sampling_sigma_m: Sequence[float],
) -> CycleReport:
    """The same gait cycle with a newer forecast, its measurements, and newer errors by sampling."""
    joints = zip(report.joints, forecast.joints, measured, sampling_sigma_m, strict=True)
    renewed = tuple(
        attrs.evolve(joint, forecast=new, measured=by, sampling_sigma_m=sigma_m)
        for joint, new, by, sigma_m in joints
    )
    return attrs.evolve(report, joints=renewed, forecast=forecast.leg)


def _joint_report(
    statistics: CycleStatistics,
    k: int,
    joint: str,
    bushing: Bushing,
    window: GrowthWindow,
    model: ModelError,
    forecast: JointForecast,
    seen: ClearanceEstimate | None,
    measured: Measurement | None,
    sampling_sigma_m: float,
    shown: SeenClearance | None,
) -> JointReport:
    rate = growth_rate(window)
    mean_n, p99_n = float(statistics.mean_force_n[k]), float(statistics.p99_force_n[k])
    rubbing_w = float(statistics.archard_j[k] / statistics.moving_s)
    return JointReport(
        joint=joint,
        clearance_m=float(statistics.clearance_mean_m[k]),
        clearance_max_m=float(statistics.clearance_max_m[k]),
        growth_m_per_cycle=rate.per_cycle_m if rate else None,
        growth_mps=rate.per_second_m if rate else None,
        growth_error_m_per_cycle=rate.error_m(model.relative(k, rate.per_cycle_m)) if rate else None,
        forecast=forecast,
        seen=seen,
        measured=measured,
        peak_force_n=float(statistics.peak_force_n[k]),
        p99_force_n=p99_n,
        mean_force_n=mean_n,
        impacts=int(statistics.impacts[k]) if statistics.is_followed else None,
        load=bushing.load(mean_n, p99_n, rubbing_w) if statistics.is_followed else None,
        sampling_sigma_m=sampling_sigma_m,
        shown=shown,
    )


def _shown(k: int, diagnosis: Diagnosis | None) -> SeenClearance | None:
    """The clearance of joint k that the drive torque shows."""
    if diagnosis is None or not diagnosis.clearance_m or not math.isfinite(diagnosis.clearance_m[k]):
        return None
    return SeenClearance("torque", diagnosis.clearance_m[k], diagnosis.sigma_m[k])
