"""Bounded queue of received messages that wait for the monitor; adding a message is cheap."""

import itertools
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.messages.cdr import MESSAGE
from leg_wear_monitor.messages.decode import Decoder
from leg_wear_monitor.twin.sample import Samples

# A message of seven joints has about 300 bytes, one of a hundred thousand joints 2.5 MB; messages taken
# together are copied for decoding.
HELD_BYTES = 64 * 2**20
TAKEN_BYTES = 8 * 2**20


class Arrival(NamedTuple):
    """A received message: stream code, time of arrival [ns], serialized bytes."""

    kind: int
    log_time_ns: int
    raw: bytes


class Inbox:
    """Messages in order of arrival.

    Parameters
    ----------
    decoder : Decoder
    limit : int
        Maximum number of messages. On overflow the older half is shed, so that the rest has no gaps.
    limit_bytes : int
        Maximum number of bytes, likewise; a larger single message is itself shed.

    Attributes
    ----------
    received, shed : int
        Numbers of messages since the start.
    """

    def __init__(self, decoder: Decoder, limit: int, limit_bytes: int = HELD_BYTES) -> None:
        self._decoder, self._limit, self._limit_bytes = decoder, limit, limit_bytes
        self._waiting: list[Arrival] = []
        self._bytes = 0
        self._last_ns = 0
        self.received, self.shed = 0, 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, kind: int, raw: bytes, now_ns: int) -> None:
        """Add a message.

        Log times strictly increase. A recording that is read in the order of log time thus keeps the order
        of arrival.
        """
        self._last_ns = max(now_ns, self._last_ns + 1)
        self.received += 1
        if len(raw) > self._limit_bytes:
            self.shed += 1
            return
        while len(self._waiting) >= self._limit or self._bytes + len(raw) > self._limit_bytes:
            self._drop((len(self._waiting) + 1) // 2)
        self._waiting.append(Arrival(kind, self._last_ns, raw))
        self._bytes += len(raw)

    def _drop(self, number: int) -> None:
        self._bytes -= sum(len(one.raw) for one in self._waiting[:number])
        del self._waiting[:number]
        self.shed += number

    def delay_s(self, now_ns: int) -> float:
        """Waiting time of the oldest message [s]."""
        return max(0, now_ns - self._waiting[0].log_time_ns) * 1.0e-9 if self._waiting else 0.0

    def take(self, most: int, most_bytes: int = TAKEN_BYTES) -> list[Arrival]:
        """Remove and return the oldest messages within both limits; the first one may exceed `most_bytes`."""
        ends = itertools.accumulate(len(one.raw) for one in self._waiting[:most])
        number = max(1, sum(1 for end in ends if end <= most_bytes))
        taken, self._waiting = self._waiting[:number], self._waiting[number:]
        self._bytes -= sum(len(one.raw) for one in taken)
        return taken

    def decoded(self, arrivals: list[Arrival]) -> Samples:
        """Decode messages to samples in the same order."""
        messages = np.zeros(len(arrivals), MESSAGE)
        messages["type"] = [arrival.kind for arrival in arrivals]
        messages["log_time_ns"] = messages["publish_time_ns"] = [one.log_time_ns for one in arrivals]
        messages["end"] = np.cumsum([len(arrival.raw) for arrival in arrivals])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(arrival.raw for arrival in arrivals), np.uint8)
        return self._decoder.many(data, messages)
