"""Parts of the nodes by themselves: the inbox, the black box, how load is reported, malformed messages."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from readings_as_samples import samples

pytest.importorskip("rclpy")

from raw_messages import messages_of
from rclpy.serialization import serialize_message

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.gait.sensors import Reading
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.qos import SENSOR_DATA
from leg_wear_monitor.messages.streams import JOINT_STATE, STREAMS, WRENCH_STAMPED
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.ros.gait_publisher import PublisherConfig, sensor_message
from leg_wear_monitor.ros.health import Load, load_status, recording_status, topics_status
from leg_wear_monitor.ros.inputs import Inbox, InputTopic, Publishers
from leg_wear_monitor.ros.outputs import BlackBox
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT, OUT_OF_RANGE, WRONG_TYPE

START_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000
ALL = [stream.code for stream in STREAMS]
CODES = {CRANK: JOINT_STATE, TORQUE: WRENCH_STAMPED}
TWO = Publishers(("/driver", "/simulator"))
CRANK_FAULTS = [fault for fault in FAULTS if fault not in (NO_FAULT, OUT_OF_RANGE, WRONG_TYPE)]


def raw_of(reading: Reading, config: PublisherConfig | None = None) -> bytes:
    message = sensor_message(reading, START_NS, config or PublisherConfig())
    return message if isinstance(message, bytes) else serialize_message(message)


def crank(taken_s: float, fault: int = NO_FAULT) -> Reading:
    return Reading(taken_s, taken_s, CRANK, fault, 6.0 * taken_s, 6.0, float("nan"))


def inbox(limit: int = 100) -> Inbox:
    return Inbox(Decoder(MonitorConfig()), limit)


def test_readings_come_out_of_the_inbox_as_the_samples_they_were() -> None:
    further = PublisherConfig(further_joints=("hip", "knee"))
    torque = Reading(0.015, 0.015, TORQUE, NO_FAULT, float("nan"), float("nan"), -7.25)
    sent, box = [crank(0.01), torque, crank(0.02)], inbox()
    for number, reading in enumerate(sent):
        box.add(CODES[reading.kind], raw_of(reading, further), number)
    got, expected = box.decoded(box.take(100)), samples(sent, START_NS)
    for name in got.dtype.names:
        assert np.array_equal(got[name], expected[name], equal_nan=got.dtype[name].base.kind == "f")


@pytest.mark.parametrize("fault", CRANK_FAULTS)
def test_a_malformed_crank_message_is_found_to_be_what_it_is(fault: int) -> None:
    box = inbox()
    box.add(JOINT_STATE, raw_of(crank(0.5, fault)), 1)
    assert FAULTS[int(box.decoded(box.take(1))["fault"][0])] == FAULTS[fault]


@pytest.mark.parametrize("fault", CRANK_FAULTS)
def test_a_malformed_torque_is_a_fault_of_some_kind(fault: int) -> None:
    box = inbox()
    reading = Reading(0.5, 0.5, TORQUE, fault, float("nan"), float("nan"), 1.0)
    box.add(WRENCH_STAMPED, raw_of(reading), 1)
    assert box.decoded(box.take(1))["fault"][0] != NO_FAULT


@given(st.lists(st.tuples(st.sampled_from(ALL), st.binary(max_size=200)), max_size=5))
def test_no_bytes_harm_the_inbox(messages: list[tuple[int, bytes]]) -> None:
    box = inbox()
    for kind, raw in messages:
        box.add(kind, raw, 1)
    assert len(box.decoded(box.take(100))) == len(messages)


@given(st.lists(st.integers(0, 50), min_size=1, max_size=60))
def test_log_times_rise_whatever_the_clock_does(clock: list[int]) -> None:
    box = inbox()
    for now in clock:
        box.add(JOINT_STATE, b"", now)
    times = [arrival.log_time_ns for arrival in box.take(100)]
    assert (np.diff(times) > 0).all()
    assert all(time >= now for time, now in zip(times, clock, strict=True))


@given(st.integers(2, 40), st.integers(0, 200))
def test_an_inbox_holds_its_limit_and_loses_nothing_unsaid(limit: int, sent: int) -> None:
    box = inbox(limit)
    for number in range(sent):
        box.add(JOINT_STATE, str(number).encode(), number)
        assert len(box) <= limit
    left = [int(arrival.raw) for arrival in box.take(1000)]
    assert box.received == sent == box.shed + len(left)
    # what is left is the youngest, in one piece
    assert left == list(range(sent - len(left), sent))


def test_a_bounded_part_is_taken_oldest_first() -> None:
    box = inbox()
    for number in range(5):
        box.add(JOINT_STATE, str(number).encode(), 1_000_000_000 + number)
    assert box.delay_s(2_000_000_000) == 1.0
    assert [int(one.raw) for one in box.take(3)] == [0, 1, 2]
    assert [int(one.raw) for one in box.take(3)] == [3, 4]
    assert box.delay_s(2_000_000_000) == 0.0


def test_falling_behind_is_reported_and_then_over() -> None:
    box, load = inbox(4), Load()
    assert not load.note(0.01)
    assert load_status(load, box).level is Level.OK
    assert load.note(1.0)
    load.note(0.0)
    status = load_status(load, box)
    assert (status.level, status.message.endswith("samples are not published")) == (Level.WARN, True)
    load.worst_delay_s = 1.0
    status = load_status(load, box, is_recorded=True)  # then they are
    assert (status.level, status.message.endswith("samples are published late")) == (Level.WARN, True)
    for number in range(5):
        box.add(JOINT_STATE, b"", number)
    status = load_status(load, box)
    assert (status.level, status.values["shed_messages"]) == (Level.ERROR, 2.0)
    assert load_status(load, box).level is Level.OK


def test_what_is_lost_while_the_node_is_late_was_dropped_by_it() -> None:
    box, load, second = inbox(), Load(), 1_000_000_000
    assert load.late_ns(5 * second) == 0  # the first turn
    load.note_lost(3, 5 * second)
    assert load_status(load, box).level is Level.OK
    assert load.late_ns(9 * second) == 4 * second
    load.note_lost(10, 9 * second)
    status = load_status(load, box)
    assert (status.level, status.values["shed_messages"], status.values["worst_delay_s"]) == (
        Level.ERROR,
        7.0,
        4.0,
    )
    assert load.is_late(17 * second)
    assert not load.is_late(18 * second)
    load.note_lost(20, 18 * second)
    assert load_status(load, box).level is Level.OK


@pytest.mark.parametrize(
    ("fields", "now_s", "level", "message"),
    [
        ({}, 11, Level.OK, "connected"),
        ({"publishers": Publishers(), "heard_ns": 0}, 10, Level.WARN, "nobody publishes it"),
        ({"publishers": Publishers(), "heard_ns": 0}, 11, Level.ERROR, "nobody publishes it"),
        (
            {"publishers": Publishers((), (("/driver", "has a lower quality of service"),))},
            11,
            Level.ERROR,
            "/driver has a lower quality of service; no message arrives from it",
        ),
        ({"lost": 7}, 11, Level.WARN, "messages are lost on the way to this node"),
        ({"lost": 7, "lost_reported": 7}, 11, Level.OK, "connected"),
        (
            {"publishers": TWO, "sources": 1},
            11,
            Level.WARN,
            "2 publishers: /driver, /simulator",
        ),
        (
            {"publishers": TWO, "sources": 2},
            11,
            Level.ERROR,
            "2 publishers: /driver, /simulator",
        ),
        ({"publishers": Publishers()}, 13, Level.ERROR, "has been silent since 2023-11-14T22:13:20.000Z"),
    ],
)
def test_what_is_said_of_a_topic(fields: dict, now_s: int, level: Level, message: str) -> None:
    """The node began at 1 s, the last message was at 10 s."""
    known = {"publishers": Publishers(("/driver",)), "heard_ns": 10 * SECOND, "heard_wall_ns": START_NS}
    one = InputTopic("/left/joint_states", STREAMS[0], **(known | fields))
    status = topics_status([one], now_s * SECOND, SECOND)
    assert status.level is level
    assert message in status.message
    assert status.values["joint_states_publishers"] == len(one.publishers.fitting)
    if one.heard_ns:
        assert status.values["joint_states_silent_s"] == now_s - 10.0


def test_an_inbox_holds_its_bytes_and_counts_what_it_sheds() -> None:
    box = Inbox(Decoder(MonitorConfig()), 1000, limit_bytes=100)
    for number in range(50):
        box.add(JOINT_STATE, bytes([number]) * 30, number)
        assert len(box) <= 3
    box.add(JOINT_STATE, bytes(101), 50)  # alone too large
    box.add(JOINT_STATE, bytes([51]) * 60, 51)
    left = [arrival.raw for arrival in box.take(1000)]
    assert box.received == 52 == box.shed + len(left)
    assert left[-1] == bytes([51]) * 60
    assert sum(map(len, left)) <= 100


def test_no_more_bytes_are_taken_than_asked_for_but_one_message_always() -> None:
    box = inbox()
    for size in (50, 10, 10, 10):
        box.add(JOINT_STATE, bytes(size), 1)
    assert [len(one.raw) for one in box.take(100, 20)] == [50]
    assert [len(one.raw) for one in box.take(100, 20)] == [10, 10]
    assert [len(one.raw) for one in box.take(100, 20)] == [10]
    assert box.take(100, 20) == []


def black_box(
    path: Path | str = "", stops: Path | str = "", leg: str = "leg", log: list[str] | None = None
) -> BlackBox:
    """A black box with two topics."""
    box = BlackBox(str(path), str(stops), leg, ([] if log is None else log).append)
    for topic in ("/a", "/b"):
        box.add_topic(topic, "sensor_msgs/msg/JointState", SENSOR_DATA)
    return box


def test_the_black_box_keeps_bytes_in_their_order(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    box = black_box(path)
    box.write("/a", 1, b"one")
    box.write("/b", 2, np.frombuffer(b"twotri", np.uint8).reshape(2, 3))
    box.flush()
    box.write("/a", 3, b"four")
    box.close()
    assert messages_of(path) == {"/a": [b"one", b"four"], "/b": [b"two", b"tri"]}
    assert recording_status(box).values["recorded_messages"] == 4.0


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    """A monitor that is started again with the same parameters; an empty file is none."""
    path, log = tmp_path / "run.mcap", []
    path.touch()
    for raw in (b"one", b"two", b"tri"):
        box = black_box(path, log=log)
        box.write("/a", 1, raw)
        box.close()
        os.utime(path, (50, 50))
    first, again = tmp_path / "run-19700101T000050Z.mcap", tmp_path / "run-19700101T000050Z-2.mcap"
    assert {file: messages_of(file)["/a"] for file in tmp_path.iterdir()} == {
        first: [b"one"],
        again: [b"two"],
        path: [b"tri"],
    }
    assert log == [
        f"recording to {path}",
        f"recording to {path}; the earlier recording is kept as {first}",
        f"recording to {path}; the earlier recording is kept as {again}",
    ]


def test_a_full_disk_ends_the_recording_and_not_the_node(tmp_path: Path) -> None:
    box = black_box(tmp_path / "run.mcap")
    box._writer._disk.file.close()
    box._writer._disk.file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115
    box.write("/a", 1, b"one")
    box.flush()
    assert recording_status(box).level is Level.ERROR
    assert "No space left" in recording_status(box).message
    box.write("/a", 2, b"two")
    box.close()
    assert not box.on


def test_the_seconds_around_a_stop_are_kept(tmp_path: Path) -> None:
    """30 s before and 10 s after; a second stop meanwhile begins no file, one after it does."""
    box = black_box(stops=tmp_path / "stops")
    for second in range(100):
        box.write("/a", second * SECOND, f"{second}".encode())
        if second in (50, 55, 80):
            box.write("/b", second * SECOND, np.frombuffer(b"onetwo", np.uint8).reshape(2, 3))
            box.stop(second * SECOND)
    box.close()
    assert not box.on and box.takes_inputs
    files = sorted((tmp_path / "stops").iterdir())
    assert [file.name for file in files] == [
        "stop-19700101T000050Z-leg.mcap",
        "stop-19700101T000120Z-leg.mcap",
    ]
    for file, at in zip(files, (50, 80), strict=True):
        found = messages_of(file)
        assert found["/a"] == [f"{second}".encode() for second in range(at - 30, at + 11)]
        assert found["/b"][:2] == [b"one", b"two"]


def test_legs_that_stop_at_once_have_a_file_each_also_after_a_restart(tmp_path: Path) -> None:
    for leg, raw in (("robot/left", b"one"), ("robot/right", b"two"), ("robot/left", b"tri")):
        box = black_box(stops=tmp_path, leg=leg)
        box.write("/a", SECOND, raw)
        box.stop(SECOND)
        box.close()
    found = {file.name: messages_of(file)["/a"] for file in tmp_path.iterdir()}
    assert sorted(found.values()) == [[b"one"], [b"tri"], [b"two"]]
    at = "stop-19700101T000001Z"
    assert (found[f"{at}-robot_left.mcap"], found[f"{at}-robot_right.mcap"]) == ([b"tri"], [b"two"])


def test_what_is_kept_of_a_stop_is_on_the_disk_after_a_flush(tmp_path: Path) -> None:
    """A robot is often switched off within these ten seconds."""
    box = black_box(stops=tmp_path)
    box.write("/a", SECOND, b"before the stop")
    box.stop(SECOND)
    (file,) = tmp_path.iterdir()
    before = file.stat().st_size
    box.flush()
    assert file.stat().st_size > before
    box.close()


def test_a_clock_that_is_set_back_fills_no_memory(tmp_path: Path) -> None:
    box = black_box(stops=tmp_path)
    for second in (*range(1000, 1020), *range(100)):
        box.write("/a", second * SECOND, b"")
    assert len(box._stops._kept) == 31


def test_stops_that_cannot_be_written_are_reported_and_end_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LegWearError, match=r"record\.stops: "):
        black_box(stops=tmp_path / "file" / "stops")
    box = black_box(stops=tmp_path / "stops")
    (tmp_path / "stops").rmdir()
    box.write("/a", SECOND, b"one")
    box.stop(SECOND)
    assert recording_status(box).level is Level.ERROR
    box.write("/a", 2 * SECOND, b"two")
    box.close()


def test_no_path_no_recording() -> None:
    box = black_box()
    box.write("/a", 1, b"one")
    box.flush()
    box.close()
    assert (box.on, box.recorded, recording_status(box).message) == (False, 0, "off")
