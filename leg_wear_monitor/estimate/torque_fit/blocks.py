"""Means over a twelfth of a turn: impacts of joints with clearance average out, the leg's torque stays.

With 0.3 mm in five joints, single torque samples differ from the ideal leg's by as much as that torque
itself; such means by a tenth of it or less.
"""

import attrs
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from leg_wear_monitor.estimate.torque_fit.pairing import Pair
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

BINS = 48  # of a turn
# A flight and the impact after it cancel within a twelfth of a turn; with fewer bins or sharp edges, impacts
# at the same angle in every turn would turn up as a slow torque
_WEIGHTS = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]) / 16.0


@attrs.frozen(eq=False)
class Blocks:
    """Runs of samples in an equal part of a turn of the crank.

    Attributes
    ----------
    first : (m,) array of int
        Index of each run's first sample.
    length : (m,) array of int
    kept : (m,) array of bool
        Whether a run is long enough to be used.
    part : (m,) array of int
        Which part of a turn, counted on over turns.
    """

    first: NDArray[np.int64]
    length: NDArray[np.int64]
    kept: NDArray[np.bool_]
    part: NDArray[np.int64]

    def mean(self, values: Floats) -> Floats:
        """Means (..., kept runs) of values (..., n), low-passed over their neighbours.

        Both sides of an equation are averaged alike, so it does no harm where neighbours are not next to each
        other.
        """
        means = (np.add.reduceat(values, self.first, axis=-1) / self.length)[..., self.kept]
        reach = len(_WEIGHTS) // 2
        ends = [means[..., :1]] * reach, [means[..., -1:]] * reach
        padded = np.concatenate([*ends[0], means, *ends[1]], axis=-1)
        return np.asarray(sliding_window_view(padded, len(_WEIGHTS), axis=-1) @ _WEIGHTS)

    @property
    def bin(self) -> NDArray[np.int64]:
        """Part of the turn of each kept run, from 0 to BINS - 1."""
        return np.asarray(self.part[self.kept] % BINS)

    @property
    def turn(self) -> NDArray[np.int64]:
        """Turn of each kept run, counted from 0 over all recordings."""
        turns = self.part[self.kept] // BINS
        changes = np.abs(np.diff(turns)) > 0
        return np.concatenate([[0], np.cumsum(changes)]) if len(turns) else turns


def blocks_of(pair: Pair, ratio: float) -> Blocks:
    """Blocks of a pair, with the ratio of the crank's angle to the joint's."""
    part = np.floor(ratio * pair.position_rad * (BINS / TURN)).astype(np.int64)
    change = (np.diff(part) != 0) | (np.diff(pair.recording) != 0)
    first = np.concatenate([[0], 1 + np.flatnonzero(change)])
    length = np.diff(np.concatenate([first, [len(part)]]))
    return Blocks(first, length, length >= 0.5 * np.median(length), part[first])
