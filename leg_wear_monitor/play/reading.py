"""Angles and loads of recordings: joints and torques of a bag, columns of a table."""

from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.bags.bag import TABLES, Recordable, find_files
from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.bags.series.reading import read_signals
from leg_wear_monitor.bags.series.signals import EFFORT, WRENCH, JointName, Signals, TorqueSource
from leg_wear_monitor.bags.topics import listed
from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.torque_fit.series import Series
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_OPTIONS = {
    "input.columns.stamp": "--time",
    "input.columns.crank_angle": "--joint",
    "input.columns.drive_torque": "--load",
}
_NOT_ZERO = "1970-01-02T00:00:00Z"  # only differences of times count, and a stamp of 0 is one of no clock
_STALE = 3.0  # sampling intervals after which the last load no longer counts


@attrs.frozen(eq=False)
class Rocked:
    """A joint that was rocked: times [s], angles [rad], and the load at these times if there is one."""

    time_s: Floats
    angle_rad: Floats
    load: Floats | None
    findings: tuple[Finding, ...]


def read_rocked(
    recording: Recordable,
    config: MonitorConfig,
    joint: str,
    loads: Sequence[str] = (),
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Rocked:
    """Read the angle of a joint, and the sum of the loads.

    Parameters
    ----------
    recording : path or table in memory
        MCAP, .db3, CSV or Parquet file, bag directory, columns by name.
    config : MonitorConfig
        Column of the time and units of tables.
    joint : str
        Name of a joint in a bag, of a column in a table.
    loads : sequence of str
        ``effort``, ``effort:JOINT``, ``TOPIC``, ``TOPIC:AXIS`` or ``TOPIC:JOINT`` in a bag, a column in a
        table. Two that push to one side each add up.
    progress : callable
        Takes the fraction read.

    Raises
    ------
    RecordingError
        If the recording cannot be read, or has no such joint or load.
    """
    files, _ = find_files([recording])
    name = ", ".join(str(one.path) for one in files)
    if files[0].storage in TABLES:
        return _of_table(recording, config, joint, loads, progress)
    signals, findings = read_signals([recording], MonitorConfig(), progress=progress)
    angle = _joint(signals, joint, name)
    return _aligned(angle, {load: _load(signals, joint, load, name) for load in loads}, name, findings)


def _of_table(
    table: Recordable,
    config: MonitorConfig,
    joint: str,
    loads: Sequence[str],
    progress: Callable[[float], None],
) -> Rocked:
    name = str(table) if isinstance(table, str | Path) else "table"
    found: dict[str, Series] = {}
    for load in loads or [""]:
        columns = attrs.evolve(config.input.columns, crank_angle=joint, crank_speed="", drive_torque=load)
        given = attrs.evolve(config.input, columns=columns, start=config.input.start or _NOT_ZERO)
        try:
            signals, findings = read_signals(
                [table], MonitorConfig(crank_joint=joint, input=given), progress=progress
            )
        except RecordingError as error:
            key = _OPTIONS.get(error.key, error.key)
            raise RecordingError(
                error.source, key, error.fault.removesuffix(', or "" if there is none')
            ) from error
        sources = signals.torques.items()
        if load and not sources:
            raise RecordingError(name, "--load", f"column {load!r} has no value")
        if load:
            found[load] = next(each for source, each in sources if source.component in ("", "z"))
    return _aligned(_joint(signals, joint, name), found, name, [_named(one, joint, load) for one in findings])


def _named(finding: Finding, joint: str, load: str) -> Finding:
    """A finding with the names of the columns: a rocked joint is no crank."""
    text = finding.text.replace("crank_angle is", f"{joint} is").replace("drive_torque is", f"{load} is")
    return attrs.evolve(finding, text=text.replace("; the leg was not monitored in between", ""))


def _joint(signals: Signals, joint: str, name: str) -> Series:
    """Series of a joint; of several topics, the one with the most samples."""
    found = [each for key, each in signals.joints.items() if key.joint == joint]
    if not found:
        known = {key.joint for key in signals.joints}
        fault = f"{joint!r} is not a joint of the recording, it has {listed(known)}"
        raise RecordingError(name, "--joint", fault + did_you_mean(joint, sorted(known)))
    return max(found, key=lambda each: len(each.time_s))


def _load(signals: Signals, joint: str, load: str, name: str) -> Series:
    """Series of a load by its name."""
    named = {label: each for key, each in signals.torques.items() for label in _labels(key, joint)}
    named |= {f"{key.topic}:{key.joint}": each for key, each in signals.joints.items()}
    for label in (load, f"/{load}"):
        if label in named:
            return named[label]
    raise RecordingError(name, "--load", f"{load!r} is not in the recording, expected one of {listed(named)}")


def _labels(key: JointName | TorqueSource, joint: str) -> list[str]:
    """Names by which ``--load`` finds a torque."""
    if isinstance(key, JointName):
        return []
    if key.source == EFFORT:
        return [f"effort:{key.component}", *(["effort"] if key.component == joint else [])]
    return [f"{key.topic}:{key.component}"] if key.source == WRENCH else [key.topic]


def _aligned(angle: Series, loads: dict[str, Series], name: str, findings: list[Finding]) -> Rocked:
    """Sum of the loads at the times of the angle: the last ones received, unless that is too old."""
    total, known = np.zeros(len(angle.time_s)), np.ones(len(angle.time_s), bool)
    for label, load in loads.items():
        if len(load.time_s) < 2:
            raise ConfigError(name, "--load", f"{label!r} has {len(load.time_s)} values, expected a signal")
        last = np.searchsorted(load.time_s, angle.time_s, side="right") - 1
        interval = float(np.median(np.diff(load.time_s)))
        # a step of the angle may be longer than one of the load
        longest = _STALE * max(
            interval, float(np.median(np.diff(angle.time_s))) if len(angle.time_s) > 1 else 0.0
        )
        known &= (last >= 0) & (angle.time_s - load.time_s[np.maximum(last, 0)] <= longest)
        if not known.any():
            fault = f"{label!r} was not recorded at the same time as the joint"
            raise ConfigError(name, "--load", fault)
        total += load.value[np.maximum(last, 0)]
    return Rocked(angle.time_s[known], angle.value[known], total[known] if loads else None, tuple(findings))
