"""Evaluation periods: a quarter of the commanded gait cycle each, at whose end alarms are evaluated.

They follow from the samples in their order of arrival alone: however those are cut into blocks, the monitor
looks at the same instants. A period ends when two samples in a row lie outside of it; one alone may have a
stray stamp. It also ends after many samples that bring no time, or a stream of such would never be judged.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.kernel import entry
from leg_wear_monitor.record import Records, new_records
from leg_wear_monitor.twin.sample import Samples

A_CYCLE = 4
IDLE_LIMIT, LIMIT = 50, 50_000  # samples without time, samples in all

PERIOD_STATE = np.dtype(
    [
        ("begin", "i8"),  # of the period [ns]
        ("newest", "i8"),  # stamp in it [ns]
        ("idle", "i8"),  # samples since the newest
        ("outside", "i8"),  # 1 where the last sample lay outside
        ("count", "i8"),  # samples
    ]
)


@entry
def find_period_end(stamp, first, length, states):  # type: ignore[no-untyped-def]
    """Index after the sample, from ``first`` on, that ends the period; -1 if none does.

    ``stamp`` (n,) [ns], not above 0 where a sample has none; ``length`` of a period [ns]; the only one of
    ``states`` is changed.
    """
    state = states[0]
    for i in range(first, stamp.shape[0]):
        at = stamp[i]
        state.idle += 1
        state.count += 1
        if at > 0:
            if state.begin == 0:
                state.begin, state.newest = at, at
            since = at - state.begin  # of two stamps above 0: it cannot overflow
            outside = since >= length or since < -length
            if at > state.newest and not outside:
                state.newest, state.idle = at, 0
            if outside and state.outside > 0:
                state.begin, state.newest = at, at
                state.idle, state.outside, state.count = 0, 0, 0
                return i + 1
            state.outside = 1 if outside else 0
        if state.idle >= IDLE_LIMIT or state.count >= LIMIT:
            state.idle, state.count = 0, 0
            return i + 1
    return -1


class EvaluationPeriods:
    """Cuts a stream of samples at the ends of its evaluation periods.

    Parameters
    ----------
    length_ns : int
        Of a period.
    """

    def __init__(self, length_ns: int) -> None:
        self._length = length_ns
        self.state: Records = new_records(1, PERIOD_STATE)

    def pieces(self, samples: Samples) -> Iterator[tuple[Samples, bool]]:
        """Pieces of a block, and whether a period ends with each."""
        stamp: NDArray[np.int64] = np.ascontiguousarray(samples["stamp_ns"])
        begin = 0
        while begin < len(samples):
            end = int(find_period_end(stamp, begin, self._length, self.state))
            yield samples[begin : end if end > 0 else None], end > 0
            begin = end if end > 0 else len(samples)
