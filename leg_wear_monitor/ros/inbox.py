"""What has arrived and waits for the monitor: cheap to add to, and never more than it can hold."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.recording.cdr import MESSAGE
from leg_wear_monitor.recording.decoder import Decoder
from leg_wear_monitor.twin.sample import Samples


class Arrival(NamedTuple):
    """A message as it came: a code of `recording.cdr.TYPES`, when it came [ns], its bytes."""

    kind: int
    log_time_ns: int
    raw: bytes


class Inbox:
    """Messages in order of arrival.

    Parameters
    ----------
    decoder : Decoder
    limit : int
        Messages it holds; where one more comes, the older half is shed, so that what remains is one piece.

    Attributes
    ----------
    received, shed : int
        Messages since the start.
    """

    def __init__(self, decoder: Decoder, limit: int) -> None:
        self._decoder, self._limit = decoder, limit
        self._waiting: list[Arrival] = []
        self._last_ns = 0
        self.received, self.shed = 0, 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, kind: int, raw: bytes, now_ns: int) -> None:
        """Take in a message.

        No two have one log time, and none is before another: a recording, read in the order of log time,
        has then the order of arrival.
        """
        self._last_ns = max(now_ns, self._last_ns + 1)
        if len(self._waiting) >= self._limit:
            half = self._limit // 2
            del self._waiting[:half]
            self.shed += half
        self._waiting.append(Arrival(kind, self._last_ns, raw))
        self.received += 1

    def delay_s(self, now_ns: int) -> float:
        """For how long the oldest message has waited [s]."""
        return max(0, now_ns - self._waiting[0].log_time_ns) * 1.0e-9 if self._waiting else 0.0

    def take(self, most: int) -> list[Arrival]:
        """The oldest messages, at most so many."""
        taken, self._waiting = self._waiting[:most], self._waiting[most:]
        return taken

    def decoded(self, arrivals: list[Arrival]) -> Samples:
        """Samples of messages, in their order."""
        messages = np.zeros(len(arrivals), MESSAGE)
        messages["type"] = [arrival.kind for arrival in arrivals]
        messages["log_time_ns"] = messages["publish_time_ns"] = [one.log_time_ns for one in arrivals]
        messages["end"] = np.cumsum([len(arrival.raw) for arrival in arrivals])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(arrival.raw for arrival in arrivals), np.uint8)
        return self._decoder.many(data, messages)
