"""Table of the gait cycles of a recording: a row a minute, or a row a gait cycle."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.fleet.tables.used import used_fraction
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, JOINT_COLUMNS, History

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult

Columns = dict[str, NDArray[Any]]

_MINUTE_NS = 60 * 10**9
_LAST = ("cycle", "clearance_m", "clearance_max_m", "growth_m_per_cycle")
_SUM = ("moving_s", "bridged_s", "impacts")
_MAX = ("peak_force_n",)
_EXACT = ("cycle", "clearance_m", "clearance_max_m", "growth_m_per_cycle")  # others as 32 bits
_WHOLE = ("cycle", "impacts")


def cycle_columns(result: "ReplayResult", row: str) -> Columns:
    """Columns of the table of a replay; a joint's value after a dot: ``clearance_m.A``.

    Parameters
    ----------
    result : ReplayResult
    row : str
        ``minute``: of the gait cycles that end in a minute, the last counter, clearance and growth; the
        sum of times and impacts; the maximum of peak forces; the mean of the rest. ``cycle``: each gait
        cycle.
    """
    history, monitor = result.history, result.monitor
    begins = _begins(history.stamp_ns, row)
    ends = np.append(begins[1:], len(history)) - 1 if len(history) else begins
    columns: Columns = {
        "stamp_ns": history.stamp_ns[ends],
        "cycles": np.diff(np.append(begins, len(history))).astype(np.int32),
    }
    for name in CYCLE_COLUMNS:
        columns[name] = _reduced(name, history.column(name), begins, ends)
    for name in JOINT_COLUMNS:
        values = history.joint_column(name)
        for k, joint in enumerate(history.clearance_joints):
            columns[f"{name}.{joint}"] = _reduced(name, values[:, k], begins, ends)
    return columns | _used(history, monitor.mechanism, monitor.clearance_limits_m, ends)


def _used(history: History, mechanism: Any, limits_m: Any, ends: NDArray[np.int64]) -> Columns:
    """Fraction of the clearance from new to limit that is used up, by joint."""
    clearance = history.joint_column("clearance_m")[ends]
    columns: Columns = {}
    for k, joint in enumerate(history.clearance_joints):
        new = mechanism.clearances[joint].radial_clearance
        used = used_fraction(clearance[:, k], new, limits_m[k])
        columns[f"used_fraction.{joint}"] = used.astype(np.float32)
    return columns


def _begins(stamp_ns: NDArray[np.int64], row: str) -> NDArray[np.int64]:
    """Index of the first gait cycle of each row."""
    if row == "cycle" or not len(stamp_ns):
        return np.arange(len(stamp_ns))
    minute = stamp_ns // _MINUTE_NS
    return np.concatenate([[0], np.flatnonzero(np.diff(minute)) + 1])


def _reduced(
    name: str, values: NDArray[np.float64], begins: NDArray[np.int64], ends: NDArray[np.int64]
) -> NDArray[Any]:
    """Values of the rows of a column, NaN where none is known."""
    if not len(values) or name in _LAST:
        reduced = values[ends]
    elif name in _SUM:
        reduced = np.add.reduceat(np.nan_to_num(values), begins)  # of cycles that were followed
    elif name in _MAX:
        reduced = np.fmax.reduceat(values, begins)
    else:
        is_known = np.isfinite(values)
        count = np.add.reduceat(is_known.astype(float), begins)
        with np.errstate(invalid="ignore"):
            reduced = np.add.reduceat(np.where(is_known, values, 0.0), begins) / count
    if name in _WHOLE:
        return np.asarray(reduced.astype(np.int64))
    return np.asarray(reduced if name in _EXACT else reduced.astype(np.float32))
