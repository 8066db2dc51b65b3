"""Samples that are kept until their gait cycle ends."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

_MOST = 20_000  # samples of each kind: ten seconds at 2 kHz


class KeepsSamples:
    """Base of an observer that evaluates whole gait cycles; ``state.samples`` is what it keeps."""

    state: Any

    def add_samples(self, piece: Samples) -> None:
        """Add samples in the order of arrival."""
        self.state.samples = self.state.samples.extended(piece)


def of_crank(piece: Samples) -> Samples:
    """Samples of the crank that have a valid angle."""
    crank: Samples = piece[(piece["kind"] == CRANK) & is_valid(piece) & np.isfinite(piece["crank_angle_rad"])]
    return crank


def is_valid(piece: Samples) -> NDArray[np.bool_]:
    """Mask (n,) of the samples without a fault, with a stamp."""
    return np.asarray((piece["fault"] == NO_FAULT) & (piece["stamp_ns"] > 0))


def newest(stamp_ns: Ints, since_ns: int) -> Ints:
    """Indices of the samples (n,) from a stamp on, of the last ten seconds at 2 kHz at most."""
    return np.flatnonzero(stamp_ns >= since_ns)[-_MOST:]


def indices_within(stamp_ns: Ints, begin_ns: int, end_ns: int) -> Ints:
    """Indices of the samples (n,) from one stamp to another, in order; of equal stamps the first one."""
    _, first = np.unique(stamp_ns, return_index=True)
    return np.asarray(first[(stamp_ns[first] >= begin_ns) & (stamp_ns[first] < end_ns)])
