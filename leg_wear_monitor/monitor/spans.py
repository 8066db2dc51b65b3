"""Stretches of time whose wear is counted, so that none is counted twice."""

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Ints

Spans = tuple[tuple[int, int], ...]

NEIGHBOURS_NS = 10_000_000_000  # stretches nearer than this are taken as one


def with_span(spans: Spans, begin_ns: int, end_ns: int) -> Spans:
    """Disjoint spans in order of time with one more, joined with those that it meets or nearly meets."""
    apart = []
    for begin, end in spans:
        if begin_ns - NEIGHBOURS_NS <= end and begin <= end_ns + NEIGHBOURS_NS:
            begin_ns, end_ns = min(begin, begin_ns), max(end, end_ns)
        else:
            apart.append((begin, end))
    return tuple(sorted([*apart, (begin_ns, end_ns)]))


def is_within(stamp_ns: Ints, spans: Ints) -> NDArray[np.bool_]:
    """Which stamps (n,) lie in one of the spans (m, 2), in order of their begin; ends are within."""
    latest = np.maximum.accumulate(spans[:, 1])
    at = np.searchsorted(spans[:, 0], stamp_ns, side="right") - 1
    return np.asarray((at >= 0) & (stamp_ns <= latest[np.maximum(at, 0)]))
