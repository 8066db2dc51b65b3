"""Checks of the measured torque for an impossible bias, drift or lag; bounds, values and sentences."""

import math
from typing import TYPE_CHECKING

import attrs

from leg_wear_monitor.monitor.verdict.words import amount, estimate

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.evaluation.torque_record import TorqueRecord
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


def torque_bounds(config: "MonitorConfig", size_nm: float) -> TorqueBounds:
    """Bounds from the parameters; missing ones follow from the RMS of the predicted torque [N m]."""
    return TorqueBounds(
        max_friction_nm=config.drive_torque.max_friction_nm or _FRICTION * size_nm,
        max_lag_s=config.drive_torque.max_lag_s,
        bias_nm=config.limits.torque_bias_nm or _BIAS * size_nm,
        drift_nm=config.limits.torque_drift_nm or _DRIFT * size_nm,
    )


def torque_values(report: "CycleReport", record: "TorqueRecord", bounds: TorqueBounds) -> dict[str, float]:
    """Values of the alarms in their units, 0 unless significant (three sigma); empty without a torque."""
    if not report.torque_samples:
        return {}
    bias, sigma = bias_of(report, bounds), _SURE * report.friction_sigma_nm
    change, either = report.friction_nm - record.friction_nm, math.hypot(sigma, _SURE * record.sigma_nm)
    lag_s = abs(report.torque_lag_s) - _SURE * report.torque_lag_sigma_s
    # NaN (unknown) stays NaN
    return {
        BIAS: abs(bias) - sigma if abs(bias) > sigma else 0.0 * sigma,
        DRIFT: abs(change) - either if abs(change) > either else 0.0 * (change + either),
        LAG: lag_s if lag_s > 0.0 else 0.0 * lag_s,
    }


def bias_of(report: "CycleReport", bounds: TorqueBounds) -> float:
    """Part of the constant torque that cannot be friction [N m]: negative, or above the largest friction."""
    friction_nm = report.friction_nm
    return min(friction_nm, 0.0) + max(friction_nm - bounds.max_friction_nm, 0.0)


def torque_causes(
    raised: set[str], report: "CycleReport", record: "TorqueRecord", bounds: TorqueBounds
) -> list[str]:
    """Sentences on possible causes of raised torque alarms."""
    causes = []
    constant = f"a constant torque of {estimate(report.friction_nm, report.friction_sigma_nm, 'N m')}"
    if BIAS in raised and report.friction_nm < 0.0:
        causes.append(
            f"{constant} drives the crank; friction cannot drive: the sensor's offset is not zeroed, "
            "or drive_torque.sign is wrong"
        )
    elif BIAS in raised:
        causes.append(
            f"{constant} exceeds the largest friction of the drive, {amount(bounds.max_friction_nm, 'N m')}: "
            "the sensor's offset is not zeroed, drive_torque.sign, scale or gear_ratio is wrong, or friction "
            "has increased"
        )
    if DRIFT in raised:
        causes.append(
            f"the constant torque is {estimate(report.friction_nm, report.friction_sigma_nm, 'N m')} and "
            f"was {amount(record.friction_nm, 'N m')} when this leg was commissioned: the friction of the "
            "drive or the offset of the sensor has changed"
        )
    if LAG in raised:
        causes.append(_lag_cause(record, bounds))
    return causes


def _lag_cause(record: "TorqueRecord", bounds: TorqueBounds) -> str:
    split = record.lags.split
    if split is None:
        return (
            "the torque is late or early by more than drive_torque.max_lag_s, or crank.offset_rad is wrong: "
            "at one speed the two cannot be distinguished"
        )
    if abs(split[0]) > bounds.max_lag_s:
        return "the torque is late or early by more than drive_torque.max_lag_s, at every speed"
    return "crank.offset_rad is wrong: the lag of the torque corresponds to a constant crank angle"


def offset_error_rad(report: "CycleReport", record: "TorqueRecord") -> float:
    """Error of crank.offset_rad [rad], if it causes all of the lag that is not known to be a time lag."""
    split = record.lags.split
    return split[1] if split else report.torque_lag_s * report.cadence_rpm * math.pi / 30.0
