"""Checks of the measured torque for an impossible bias, drift or lag: bounds, values, causes."""

import math
from typing import TYPE_CHECKING

import attrs

from leg_wear_monitor.estimate.cause import Cause, NamedCause, beyond_friction

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.gait_evidence import TorqueRecord
    from leg_wear_monitor.monitor.reports import CycleReport


BIAS, DRIFT, LAG = "torque_bias", "torque_drift", "torque_lag"

# fractions of the predicted torque's RMS, if the parameters are 0: joints and gears lose some tenths of the
# transmitted torque; a tenth is also the limit of the mismatch
_FRICTION, _BIAS, _DRIFT = 0.3, 0.1, 0.15
_SURE = 3.0  # standard deviations


@attrs.frozen
class TorqueBounds:
    """Bounds of a drive: largest friction and lag, and limits of the excess and of a drift."""

    max_friction_nm: float
    max_lag_s: float
    bias_nm: float
    drift_nm: float


def torque_bounds(config: "MonitorConfig", size_nm: float, max_lag_s: float) -> TorqueBounds:
    """Bounds from the parameters; missing ones follow from the RMS of the predicted torque [N m]."""
    return TorqueBounds(
        max_friction_nm=config.drive_torque.max_friction_nm or _FRICTION * size_nm,
        max_lag_s=max_lag_s,
        bias_nm=config.limits.torque_bias_nm or _BIAS * size_nm,
        drift_nm=config.limits.torque_drift_nm or _DRIFT * size_nm,
    )


def torque_values(report: "CycleReport", record: "TorqueRecord", bounds: TorqueBounds) -> dict[str, float]:
    """Values of the alarms in their units, 0 unless significant (three sigma); empty without a torque."""
    if not report.torque_samples:
        return {}
    bias, drift = _bias(report, bounds), _drift(report, record)
    lag = NamedCause(Cause.LAG, report.torque_lag_s, report.torque_lag_sigma_s)
    return {name: _surely(one) for name, one in ((BIAS, bias), (DRIFT, drift), (LAG, lag))}


def torque_causes(
    raised: set[str], report: "CycleReport", record: "TorqueRecord", bounds: TorqueBounds
) -> dict[str, NamedCause]:
    """Cause of each alarm of the torque that is raised."""
    causes = {
        BIAS: _bias(report, bounds),
        DRIFT: _drift(report, record),
        LAG: _timing(report, record, bounds),
    }
    return {name: one for name, one in causes.items() if name in raised}


def _surely(one: NamedCause) -> float:
    """Size of a value beyond its uncertainty, 0 if it is less; NaN (unknown) stays NaN."""
    beyond = abs(one.value) - _SURE * one.sigma
    return beyond if not beyond < 0.0 else 0.0


def _bias(report: "CycleReport", bounds: TorqueBounds) -> NamedCause:
    return beyond_friction(report.friction_nm, report.friction_sigma_nm, bounds.max_friction_nm)


def _drift(report: "CycleReport", record: "TorqueRecord") -> NamedCause:
    sigma = math.hypot(report.friction_sigma_nm, record.sigma_nm)
    return NamedCause(Cause.FRICTION, report.friction_nm - record.friction_nm, sigma)


def _timing(report: "CycleReport", record: "TorqueRecord", bounds: TorqueBounds) -> NamedCause:
    """A lag or an offset of the crank, where the speed tells them apart."""
    split, speed = record.lag_and_offset, report.cadence_rpm * math.pi / 30.0
    if split is None:
        return NamedCause(Cause.TIMING, -report.torque_lag_s * speed, report.torque_lag_sigma_s * abs(speed))
    lag, offset = split
    return lag if abs(lag.value) > bounds.max_lag_s else offset


def offset_error_rad(report: "CycleReport", record: "TorqueRecord") -> float:
    """Error of crank.offset_rad [rad], if it causes all of the lag that is not known to be a time lag."""
    split = record.lag_and_offset
    return -split[1].value if split else report.torque_lag_s * report.cadence_rpm * math.pi / 30.0
