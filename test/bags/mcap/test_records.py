"""The walk over a chunk finds what the mcap library writes into it, wherever it is cut."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.bags.mcap_layout import COUNTS, IGNORED, walk
from leg_wear_monitor.messages.cdr import MESSAGE
from leg_wear_monitor.messages.streams import JOINT_STATE, WRENCH_STAMPED

mcap_records = pytest.importorskip("mcap.records")
RecordBuilder = pytest.importorskip("mcap.data_stream").RecordBuilder

pytestmark = pytest.mark.plain

ROLES = np.zeros(2**16, np.int64)
ROLES[[1, 2, 3]] = JOINT_STATE, WRENCH_STAMPED, IGNORED
UNKNOWN_CHANNEL = 4

times = st.integers(0, 2**63 - 1)
messages = st.builds(
    mcap_records.Message,
    channel_id=st.integers(1, UNKNOWN_CHANNEL),
    log_time=times,
    publish_time=times,
    data=st.binary(min_size=1, max_size=40),
    sequence=st.integers(0, 2**32 - 1),
)
schemas = st.builds(
    mcap_records.Schema,
    id=st.integers(1, 9),
    data=st.binary(min_size=1, max_size=40),
    encoding=st.just("ros2msg"),
    name=st.text(max_size=9),
)
others = (
    st.builds(mcap_records.DataEnd, st.integers(0, 9))
    | st.builds(mcap_records.MetadataIndex, st.integers(0, 9), st.integers(0, 9), st.just("x"))
    | st.builds(mcap_records.Metadata, metadata=st.just({"a": "b"}), name=st.just("rosbag2"))
)


def written(record):
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


def walked(data):
    """Messages, positions of definitions, tally."""
    bytes_, counts = np.frombuffer(data, np.uint8), np.zeros(1, COUNTS)
    walk(bytes_, ROLES, np.zeros(0, MESSAGE), np.zeros(0, np.int64), counts)
    found = np.zeros(int(counts["wanted"][0]), MESSAGE)
    definitions = np.zeros(int(counts["definitions"][0]), np.int64)
    walk(bytes_, ROLES, found, definitions, counts)
    return [tuple(row) for row in found.tolist()], definitions.tolist(), counts[0]


@given(records=st.lists(messages | schemas, max_size=8), data=st.data())
def test_messages_are_found_where_they_were_written(records, data):
    parts = [written(record) for record in records]
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    cut = data.draw(st.integers(0, ends[-1]))
    whole = [i for i, end in enumerate(ends[1:]) if end <= cut]
    found, definitions, counts = walked(b"".join(parts)[:cut])
    sent = [(records[i], ends[i + 1]) for i in whole if isinstance(records[i], mcap_records.Message)]
    assert found == [
        (end - len(one.data), end, one.log_time, one.publish_time, int(ROLES[one.channel_id]))
        for one, end in sent
        if one.channel_id in (1, 2)
    ]
    assert definitions == [ends[i] for i in whole if isinstance(records[i], mcap_records.Schema)]
    assert counts["unknown_channel"] == sum(one.channel_id == UNKNOWN_CHANNEL for one, _ in sent)
    assert counts["read"] == ends[len(whole)]
    if sent:
        logged = [one.log_time for one, _ in sent]
        assert (counts["first_log_time_ns"], counts["last_log_time_ns"]) == (min(logged), max(logged))


@given(before=st.lists(messages, max_size=3), record=others, after=st.lists(messages, max_size=3))
def test_other_records_are_counted_and_the_end_of_data_is_the_end(before, record, after):
    head = b"".join(map(written, before))
    tail = b"".join(map(written, after))
    _, _, counts = walked(head + written(record) + tail)
    if isinstance(record, mcap_records.DataEnd):
        assert counts["read"] == len(head)
    else:
        assert counts["foreign"] == (not isinstance(record, mcap_records.Metadata))
        assert counts["read"] == len(head + written(record) + tail)


@given(data=st.binary(max_size=300))
def test_any_bytes_are_walked_to_an_end(data):
    _, _, counts = walked(data)
    assert 0 <= counts["read"] <= len(data)
