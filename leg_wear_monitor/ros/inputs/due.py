"""When received messages complete the next reports: processing them earlier gives none, later delays them."""

import struct
from collections.abc import Callable

from leg_wear_monitor.messages.cdr import ENCAPSULATION
from leg_wear_monitor.messages.streams import Stream

_STAMP = (struct.Struct(">iI"), struct.Struct("<iI"))  # by the byte order's bit of the encapsulation

_LEAST_NS = 2_000_000  # between two attempts, for messages that look complete and are not
_MOST_NS = 50_000_000  # for which messages wait, for instance where one of two topics has stopped


def stamp_of(raw: bytes) -> int:
    """Stamp [ns] of a serialized message that begins with a header; 0 if it is too short."""
    order = _STAMP[raw[1] & 1] if len(raw) > 1 else _STAMP[0]
    if len(raw) < ENCAPSULATION + order.size:
        return 0
    seconds, rest = order.unpack_from(raw, ENCAPSULATION)
    return int(seconds) * 1_000_000_000 + int(rest)


class Due:
    """Compares the stamps of received messages with the stamp that completes the next reports.

    Parameters
    ----------
    due_stamp_ns : callable
        Stamp that samples of all kinds must reach for the next reports; 0 if it is not known.
    """

    def __init__(self, due_stamp_ns: Callable[[], int]) -> None:
        self._due_stamp_ns = due_stamp_ns
        self._newest: dict[int, int] = {}
        self._due_ns, self._processed_ns = 0, 0

    def completes(self, stream: Stream, raw: bytes, log_time_ns: int, now_ns: int) -> bool:
        """Note a received message; whether the reports are due with it.

        Parameters
        ----------
        stream : Stream
        raw : bytes
        log_time_ns : int
            Time of arrival [ns], which stamps messages without a header.
        now_ns : int
            The same time on a monotonic clock [ns].
        """
        self._newest[stream.code] = stamp_of(raw) if stream.has_stamp else log_time_ns
        return 0 < self._due_ns <= min(self._newest.values()) and now_ns - self._processed_ns >= _LEAST_NS

    def is_late(self, now_ns: int) -> bool:
        """Whether to process messages without a due report, at a time [ns] of the monotonic clock."""
        return self._due_ns == 0 or now_ns - self._processed_ns > _MOST_NS

    def processed(self, now_ns: int) -> None:
        """Note that messages were processed, at a time [ns] of the monotonic clock."""
        self._due_ns, self._processed_ns = self._due_stamp_ns(), now_ns
