"""Check that the clocks of a recording agree: header stamps against log times."""

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.messages.streams import JOINT_STATE, STREAMS, Stream
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

_FRACTION, _LEAST_NS = 0.05, 1_000_000_000


class Clocks:
    """First and last stamps and log times of each message type."""

    def __init__(self) -> None:
        self._ends: dict[int, tuple[int, int, int, int]] = {}

    def compare(self, samples: Samples, messages: NDArray[np.void]) -> None:
        """Update the times from messages and the samples decoded from them.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
            Stamped by their headers.
        messages : (n,) array of MESSAGE
        """
        good = samples["fault"] == NO_FAULT
        for kind in np.unique(messages["type"][good]).tolist():
            chosen = np.flatnonzero(good & (messages["type"] == kind))
            stamps, times = samples["stamp_ns"][chosen], messages["log_time_ns"][chosen]
            first = self._ends.get(kind, (int(stamps[0]), int(times[0])))[:2]
            self._ends[kind] = (*first, int(stamps[-1]), int(times[-1]))

    def notes(self) -> list[str]:
        """Disagreements of the clocks, one line each."""
        stamped = (self._rate(each.code, each.topic) for each in STREAMS if each.has_stamp)
        unstamped = (self._apart(each) for each in STREAMS if not each.has_stamp)
        return [note for note in (*stamped, *unstamped) if note]

    def _apart(self, stream: Stream) -> str | None:
        """Remark if the log times that stamp a stream are far from the crank's stamps; otherwise None."""
        crank = self._ends.get(JOINT_STATE)
        if stream.code not in self._ends or crank is None or abs(crank[1] - crank[0]) <= _LEAST_NS:
            return None
        apart = (crank[1] - crank[0]) / 1e9
        return (
            f"{stream.topic} has no header, so its stamps are log times; they are {apart:.6g} s after the "
            "header stamps of joint_states; try --time log"
        )

    def _rate(self, kind: int, name: str) -> str | None:
        if kind not in self._ends:
            return None
        first, first_log, last, last_log = self._ends[kind]
        span, span_log = last - first, last_log - first_log
        if abs(span - span_log) <= max(_LEAST_NS, _FRACTION * abs(span_log)):
            return None
        return (
            f"{name}: header stamps span {span / 1e9:.6g} s, log times {span_log / 1e9:.6g} s; header stamps "
            "are used, unless --time selects others"
        )
