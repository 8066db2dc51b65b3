"""Series of a replay's summary over the time since the recording's begin."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.figures.units import length_unit, time_unit


def time_of(summary: ReplaySummary, stamps_ns: Ints) -> tuple[Floats, str]:
    """Stamps (n,) [ns] as times since the recording's begin, and their unit, common to all of a recording."""
    factor, unit = time_unit(summary.recording.duration_s)
    return np.asarray(factor * (stamps_ns - summary.recording.begin_ns) / 1.0e9, np.float64), unit


def opened(summary: ReplaySummary) -> tuple[dict[str, Floats], str]:
    """How much each clearance has opened since the first gait cycle, by joint, and the unit."""
    columns = summary.history.clearance_m if len(summary.history.stamp_ns) else {}
    metres = {joint: values - values[0] for joint, values in columns.items()}
    scale, unit = length_unit(max((_greatest(values) for values in metres.values()), default=0.0))
    return {joint: scale * values for joint, values in metres.items()}, unit


def _greatest(values: Floats) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if len(known) else 0.0
