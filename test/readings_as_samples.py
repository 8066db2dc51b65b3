"""Readings of the synthetic leg as what a monitor takes, without messages between."""

import math
from collections.abc import Iterable

import numpy as np

from leg_wear_monitor.gait.sensors import Reading, stamp_ns
from leg_wear_monitor.twin.sample import ENCODERS, GAIT_SAMPLE, Samples


def samples(block: Iterable[Reading], start_ns: int) -> Samples:
    """Convert readings to input samples of a monitor, (n,) of GAIT_SAMPLE; time 0 is ``start_ns``."""
    rows = [
        (
            stamp_ns(reading, start_ns),
            reading.kind,
            reading.fault,
            *reading[4:7],
            (math.nan,) * ENCODERS,
            reading.foot_force_n,
            math.nan,  # a synthetic drive has no temperature
        )
        for reading in block
    ]
    return np.array(rows, dtype=GAIT_SAMPLE)
