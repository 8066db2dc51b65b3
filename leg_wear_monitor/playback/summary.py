"""Results of a replay as plain data (summary.json), from which its page can be generated again."""

import math
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.alarms.words import ADVICE, state_of
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceEstimate
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, JOINT_COLUMNS, History
from leg_wear_monitor.playback.replay import ReplayResult
from leg_wear_monitor.playback.schema import SCHEMA_VERSION
from leg_wear_monitor.wear.surfaces import BUSHING, JOURNAL

POINTS = 1000
"""Points that a history is thinned to; the peaks of forces are kept."""


def summary(result: ReplayResult, wall_s: float) -> dict[str, Any]:
    """Results of a replay in SI units; unknown values are null.

    Parameters
    ----------
    result : ReplayResult
    wall_s : float
        Wall-clock duration of the replay [s].
    """
    record = {
        "schema_version": SCHEMA_VERSION,
        "recording": _recording(result),
        "monitor": _monitor(result),
        "wall_s": wall_s,
        "real_time_factor": result.duration_s / wall_s,
        "cycles": len(result.history),
        "gait": {
            "believable_cycles": result.evidence.believable,
            "doubtful_cycles": result.evidence.doubtful,
            "missing": printable(result.evidence.missing()) if result.is_unusable else "",
            "is_counted": result.monitor.is_all_counted,
        },
        "joints": _joints(result) if result.is_believable else {},
        "forecast": _leg(result) if result.is_believable else None,
        "measurements": [attrs.asdict(measurement) for measurement in result.monitor.measurements],
        "alarms": {
            "now": [_alarm(alarm) for alarm in result.monitor.alarms.alarms],
            "changes": [{"stamp_ns": stamp, **_alarm(alarm)} for stamp, alarm in result.history.changes],
        },
        "status": [
            {**attrs.asdict(status), "level": status.level.name} for status in result.monitor.status()
        ],
        "lost": attrs.asdict(result.monitor.lost),
        "history": _history(result.history),
        "wear_depth_m": _wear(result),
        "advice": ADVICE,
    }
    known: dict[str, Any] = _known(record)
    return known


def _recording(result: ReplayResult) -> dict[str, Any]:
    return {
        "files": [printable(str(path)) for path in result.files],
        "topics": {role: printable(topic) for role, topic in result.topics.items()},
        "time": result.time,
        "is_partial": result.is_partial,
        "findings": [
            {"file": printable(str(finding.file)), "text": finding.text, "weight": finding.weight.value}
            for finding in result.findings
        ],
        "crank_samples": result.crank_samples,
        "torque_samples": result.torque_samples,
        "begin_ns": result.begin_ns,
        "end_ns": result.end_ns,
        "duration_s": result.duration_s,
    }


def _monitor(result: ReplayResult) -> dict[str, Any]:
    config = result.monitor.config
    return {
        "mechanism": result.monitor.mechanism.name,
        "hardware_id": config.hardware,
        "clearance_joints": list(result.monitor.clearance_joints),
        "commanded_rpm": config.cadence.commanded_rpm,
        "wear_acceleration": config.wear_acceleration,
        "bushing_radius_m": {
            joint: result.monitor.mechanism.clearances[joint].bushing_radius
            for joint in result.monitor.clearance_joints
        },
        "limits": attrs.asdict(config.limits),
        "duty_hours_per_day": config.forecast.duty_hours_per_day,
    }


def _joints(result: ReplayResult) -> dict[str, Any]:
    """Last values of each joint, and the maximum and the mean of its forces."""
    history, last = result.history, result.history.last
    if last is None:
        return {}
    joints = {}
    for k, joint in enumerate(last.joints):
        clearance = history.joint_column("clearance_m")[:, k]
        joints[joint.joint] = {
            "clearance_m": {"first": clearance[0], "last": clearance[-1], "max": joint.clearance_max_m},
            "growth_m_per_cycle": joint.growth_m_per_cycle,
            "growth_error_m_per_cycle": joint.growth_error_m_per_cycle,
            "growth_mps": joint.growth_mps,
            "forecast": None if joint.forecast is None else _forecast(joint.forecast),
            "peak_force_n": history.joint_column("peak_force_n")[:, k].max(),
            "mean_force_n": history.joint_column("mean_force_n")[:, k].mean(),
            **({"seen": _seen(joint.seen)} if joint.seen else {}),
            "impacts": int(history.joint_column("impacts")[:, k].sum()),
        }
    return joints


def _seen(seen: ClearanceEstimate) -> dict[str, Any]:
    return {**attrs.asdict(seen), "observation": seen.observation.value, "is_other": seen.is_other}


def _leg(result: ReplayResult) -> dict[str, Any] | None:
    """Forecast of the leg's end of life: the first joint to reach its limit."""
    last = result.history.last
    if last is None or last.forecast is None:
        return None
    return {**_forecast(last.forecast), "first": last.forecast.first}


def _forecast(told: JointForecast | LegForecast) -> dict[str, Any]:
    return {**attrs.asdict(told), "answer": told.answer.value}


def _alarm(alarm: Alarm) -> dict[str, Any]:
    return {
        "name": alarm.name,
        "level": alarm.level.name,
        "state": state_of(alarm),
        "value": alarm.value,
        "limit": alarm.limit,
        "unit": alarm.unit,
        "worst": alarm.worst,
        "raised_ns": alarm.raised_ns,
    }


def _history(history: History) -> dict[str, Any]:
    """Columns over groups of gait cycles: last value of each; maximum of peaks, sum of impacts."""
    stamps = history.stamp_ns
    last = _ends(len(stamps))
    begins = np.concatenate([[0], last[:-1] + 1]) if len(last) else last
    record: dict[str, Any] = {"stamp_ns": stamps[last].tolist()}
    record |= {name: history.column(name)[last].tolist() for name in CYCLE_COLUMNS}
    for name in JOINT_COLUMNS:
        column = history.joint_column(name)
        if name == "peak_force_n" and len(last):
            thinned = np.maximum.reduceat(column, begins)
        elif name == "impacts" and len(last):
            thinned = np.add.reduceat(column, begins)
        else:
            thinned = column[last]
        record[name] = {joint: thinned[:, k].tolist() for k, joint in enumerate(history.clearance_joints)}
    return record


def _ends(n: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Last index of each of at most `POINTS` groups of n cycles."""
    groups = min(n, POINTS)
    return np.asarray((np.arange(groups) + 1) * n // max(groups, 1) - 1, np.int64)


def _wear(result: ReplayResult) -> dict[str, Any]:
    depth: Floats = result.monitor.wear_depth_m
    return {
        joint: {"bushing": depth[k, BUSHING].tolist(), "journal": depth[k, JOURNAL].tolist()}
        for k, joint in enumerate(result.monitor.clearance_joints)
    }


def _known(value: Any) -> Any:
    """Replace numbers that JSON lacks (NaN, infinity) by null."""
    if isinstance(value, dict):
        return {key: _known(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_known(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
