"""Messages are processed when they complete reports; what looks wrong delays them a little only."""

import numpy as np
import pytest

from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.streams import FLOAT64, STREAMS, WRENCH_STAMPED, Stream

pytest.importorskip("rclpy")

from leg_wear_monitor.ros.inputs import Arrival, Due, stamp_of

BY_CODE = {stream.code: stream for stream in STREAMS}
TORQUE, BARE = BY_CODE[WRENCH_STAMPED], BY_CODE[FLOAT64]
JOINTS = STREAMS[0]
MS = 1_000_000


def message(stamp_ns: int) -> bytes:
    return bytes(encode.wrenches(np.array([stamp_ns]), torque=np.zeros((1, 3)), frame_id="")[0])


def due_at(stamp_ns: int) -> Due:
    due = Due(lambda: stamp_ns)
    due.processed(0)
    return due


@pytest.mark.parametrize("stamp_ns", [0, 1, 1_700_000_000_123_456_789])
def test_the_stamp_is_that_of_the_header_in_either_byte_order(stamp_ns: int) -> None:
    raw = message(stamp_ns)
    swapped = b"\0\0" + raw[2:4] + raw[4:8][::-1] + raw[8:12][::-1] + raw[12:]
    assert stamp_of(raw) == stamp_of(swapped) == stamp_ns


@pytest.mark.parametrize("raw", [b"", b"\0", b"\0\1\0\0", message(5)[:11]])
def test_a_message_too_short_for_a_stamp_has_none(raw: bytes) -> None:
    assert stamp_of(raw) == 0


def note(due: Due, stream: Stream, raw: bytes, log_time_ns: int = 0) -> None:
    due.note(stream, Arrival(stream.code, log_time_ns, raw))


def test_all_topics_must_reach_the_stamp() -> None:
    due = due_at(100 * MS)
    assert not due.is_now(10 * MS)
    note(due, JOINTS, message(99 * MS))
    note(due, TORQUE, message(101 * MS))
    assert not due.is_now(10 * MS)
    note(due, JOINTS, message(100 * MS))
    assert due.is_now(10 * MS)


def test_a_message_without_header_is_stamped_by_its_arrival() -> None:
    due = due_at(100 * MS)
    for at_ns in (99 * MS, 100 * MS):
        note(due, BARE, b"\0\1\0\0" + bytes(8), at_ns)
        assert due.is_now(10 * MS) == (at_ns == 100 * MS)


@pytest.mark.parametrize("stream", [JOINTS, TORQUE])
def test_one_topic_alone_makes_messages_late_not_stuck(stream: Stream) -> None:
    due = due_at(100 * MS)
    other = TORQUE if stream is JOINTS else JOINTS
    note(due, other, message(1))
    note(due, stream, message(500 * MS))
    assert not due.is_now(40 * MS)
    assert due.is_now(51 * MS)


def test_without_a_known_stamp_all_messages_are_processed_at_once() -> None:
    due = due_at(0)
    note(due, TORQUE, message(500 * MS))
    assert due.is_now(1)
