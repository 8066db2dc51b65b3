"""Evaluation periods: a quarter of the commanded gait cycle each, at whose end alarms are evaluated.

They follow from the samples in their order of arrival alone: however those are cut into blocks, the monitor
looks at the same instants. A beat ends when two samples in a row lie outside of it; one alone may have a
stray stamp. It also ends after many samples that bring no time, or a stream of such would never be judged.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.kernel import entry
from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.twin.sample import Samples

A_CYCLE = 4
IDLE_LIMIT, LIMIT = 50, 50_000  # samples without time, samples in all

BEGIN, NEWEST, IDLE, OUTSIDE, COUNT = range(5)


@entry
def find_beat(stamp, first, length, state):  # type: ignore[no-untyped-def]
    """Index after the sample, from ``first`` on, that ends the beat; -1 if none does.

    ``stamp`` (n,) [ns], not above 0 where a sample has none; ``length`` of a beat [ns]; ``state`` (5,) is
    changed: begin of the beat, newest stamp in it, samples since that, whether the last lay outside, samples.
    """
    for i in range(first, stamp.shape[0]):
        at = stamp[i]
        state[IDLE] += 1
        state[COUNT] += 1
        if at > 0:
            if state[BEGIN] == 0:
                state[BEGIN], state[NEWEST] = at, at
            since = at - state[BEGIN]  # of two stamps above 0: it cannot overflow
            outside = since >= length or since < -length
            if at > state[NEWEST] and not outside:
                state[NEWEST], state[IDLE] = at, 0
            if outside and state[OUTSIDE] > 0:
                state[BEGIN], state[NEWEST] = at, at
                state[IDLE], state[OUTSIDE], state[COUNT] = 0, 0, 0
                return i + 1
            state[OUTSIDE] = 1 if outside else 0
        if state[IDLE] >= IDLE_LIMIT or state[COUNT] >= LIMIT:
            state[IDLE], state[COUNT] = 0, 0
            return i + 1
    return -1


class EvaluationPeriods:
    """Cuts a stream of samples at its beats.

    Parameters
    ----------
    length_ns : int
        Of a beat.
    """

    def __init__(self, length_ns: int) -> None:
        self._length = length_ns
        self.state: Ints = np.zeros(5, dtype=np.int64)

    def pieces(self, samples: Samples) -> Iterator[tuple[Samples, bool]]:
        """Pieces of a block, and whether a beat ends with each."""
        stamp: NDArray[np.int64] = np.ascontiguousarray(samples["stamp_ns"])
        begin = 0
        while begin < len(samples):
            end = int(find_beat(stamp, begin, self._length, self.state))
            yield samples[begin : end if end > 0 else None], end > 0
            begin = end if end > 0 else len(samples)
