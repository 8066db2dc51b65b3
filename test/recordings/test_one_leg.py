"""Several files are one recording of one leg, or are refused; names in them obey nobody."""

from pathlib import Path

import numpy as np
import pytest

from leg_wear_monitor.errors import printable
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.findings import Finding, RecordingError, Severity
from leg_wear_monitor.recordings.mcap_file import McapWriter

START_NS, RATE_HZ = 1_700_000_000 * 10**9, 200


def write(path, *, begin=0, end=400, topic="/joint_states", names=("hip", "crank")):
    """Part of a crank's motion, of which each sample is the same in any file that has it."""
    k = np.arange(begin, end, dtype=np.int64)
    stamps = START_NS + k * (10**9 // RATE_HZ)
    angle = 2.0 * np.pi * k / RATE_HZ
    rows = encode.joint_states(stamps, list(names), position=np.stack([0.0 * angle, angle], axis=1))
    with McapWriter(path, chunk_bytes=8000) as writer:
        channel = writer.channel(topic, encode.JOINT_STATE)
        for i in range(0, len(k), 40):
            writer.write_many(channel, stamps[i : i + 40], rows[i : i + 40])
            writer.flush()
    return path


def test_another_namespace_is_another_leg_unless_one_is_named(tmp_path, read):
    left = write(tmp_path / "left.mcap")
    right = write(tmp_path / "right.mcap", topic="/right/joint_states")
    with pytest.raises(RecordingError, match=r"right\.mcap: joint_states: has /right/joint_states, where"):
        read(left, right)
    samples, recording = read(left, right, joint_states="/right/joint_states")
    assert len(samples) == 400
    assert any("has no topic /right/joint_states" in finding.text for finding in recording.findings)


def test_a_part_of_a_split_bag_may_have_no_crank(tmp_path, read):
    """Its first message may be of another publisher, and the recording end there."""
    write(tmp_path / "walk_0.mcap")
    write(tmp_path / "walk_1.mcap", begin=400, end=401, names=("hip", "knee"))
    samples, recording = read(tmp_path)
    assert np.count_nonzero(samples["fault"] == 0) == 400
    assert any("joint crank is not among the joints of 1 messages" in one.text for one in recording.findings)


def test_parts_and_overlaps_of_one_leg_are_one(tmp_path, read):
    parts = [
        write(tmp_path / f"{begin}_{end}.mcap", begin=begin, end=end)
        for begin, end in ((0, 200), (150, 300), (300, 400), (0, 400))
    ]
    samples, recording = read(*parts)
    assert len(samples) == 850
    assert len(np.unique(samples["stamp_ns"])) == 400
    assert not recording.is_partial


def test_messages_without_the_crank_among_others_are_a_finding(tmp_path, read):
    """As where two drivers publish their joints on one topic."""
    arm = write(tmp_path / "arm.mcap", names=("elbow", "wrist\x1b[2J"))
    both = tmp_path / "both.mcap"
    with pytest.raises(
        RecordingError, match=r"of 400 messages; they have elbow, wrist\\x1b\[2J; set the crank"
    ):
        read(arm)
    stamps = START_NS + np.arange(400, dtype=np.int64) * 5_000_000
    with McapWriter(both) as writer:
        channel = writer.channel("/joint_states", encode.JOINT_STATE)
        for names in (["elbow"], ["crank"]):
            writer.write_many(
                channel, stamps, encode.joint_states(stamps, names, position=np.zeros((400, 1)))
            )
    samples, recording = read(both)
    assert len(samples) == 800
    texts = [finding.text for finding in recording.findings if "crank" in finding.text]
    assert texts == [
        "joint crank is not among the joints of 400 messages; they have elbow; 400 messages have it"
    ]
    assert not recording.is_partial


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("/joint_states", "/joint_states"),
        ("Größe μ", "Größe μ"),
        ("\x1b[2J", "\\x1b[2J"),
        ("a\nb\r\x9b", "a\\nb\\r\\x9b"),
        ("\u202e", "\\u202e"),
        ("\udcff", "\\udcff"),
        ("x" * 3000, "x" * 2000 + " and 1000 characters more"),
    ],
)
def test_what_is_shown_can_be_shown(text, shown):
    assert printable(text) == shown
    assert printable(text).isprintable()
    assert str(RecordingError(text, text, text)) == f"{shown}: {shown}: {shown}"
    assert str(Finding(Path("x"), text, Severity.NOTE)) == f"x: {shown}"


def test_names_in_a_file_obey_nobody(tmp_path, read):
    path = write(tmp_path / "x.mcap", topic="/\x1b]0;owned\x07/states")
    with pytest.raises(RecordingError) as caught:
        read(path)
    assert str(caught.value).isprintable()
    assert "\\x1b]0;owned\\x07" in str(caught.value)
