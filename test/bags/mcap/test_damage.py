"""A damaged recording gives what is sound in it and says that something is not: no hang, no wrong number."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from recordings import losses

from leg_wear_monitor.bags.findings import RecordingError

# every one of these is a file of its own
TRUNCATIONS, FLIPS = 8, 40


def flipped(whole, seed):
    """Copies of a file, each with a bit flipped."""
    rng = np.random.default_rng(seed)
    for _ in range(FLIPS):
        content = bytearray(whole)
        content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
        yield content


def outcome(read, path, content):
    """Samples and recording of a file; nothing where it is refused, in one line."""
    path.write_bytes(content)
    try:
        return read(path)
    except RecordingError as error:
        assert "\n" not in str(error)
        assert str(path) in str(error)
        return None, None


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic(3.0)


def assert_sound(samples, recording, true):
    """Nothing that was not sent, in its order; and all of it, unless a loss is reported."""
    if samples is None:
        return
    if not recording.is_partial:
        assert samples.tobytes() == true.tobytes()
        return
    place = {bytes(sample): i for i, sample in enumerate(true)}
    places = [place[bytes(sample)] for sample in samples]
    assert places == sorted(places)


@pytest.mark.parametrize("compression", ["ZSTD", "LZ4", "NONE"])
@pytest.mark.parametrize("chunked", [True, False])
def test_a_truncated_file_gives_what_is_left(tmp_path, sent, write_bag, expected, read, compression, chunked):
    whole = write_bag(tmp_path / "whole.mcap", sent, compression, use_chunking=chunked).read_bytes()
    true = expected(sent)
    path = tmp_path / "cut.mcap"
    for cut in np.random.default_rng(1).integers(0, len(whole), TRUNCATIONS).tolist():
        samples, recording = outcome(read, path, whole[:cut])
        assert_sound(samples, recording, true)
        if samples is None:
            assert cut < 25_000  # before the first channel is known
        elif recording.is_partial:
            assert samples.tobytes() == true[: len(samples)].tobytes()
            assert len(samples) >= (cut / len(whole) - 0.15) * len(true)


@pytest.mark.parametrize("compression", ["ZSTD", "LZ4", "NONE"])
@pytest.mark.parametrize("options", [{}, {"enable_data_crcs": True, "use_chunking": False}])
def test_a_flipped_bit_is_seen_or_without_effect(
    tmp_path, sent, write_bag, expected, read, compression, options
):
    whole = write_bag(tmp_path / "whole.mcap", sent, compression, **options).read_bytes()
    true = expected(sent)
    path = tmp_path / "flipped.mcap"
    for content in flipped(whole, seed=2):
        samples, recording = outcome(read, path, content)
        if samples is not None and recording.is_partial and options:
            continue  # one checksum over everything: it is reported, but not where
        assert_sound(samples, recording, true)


def test_without_checksums_a_damage_may_pass_but_never_unsaid(tmp_path, sent, write_bag, expected, read):
    whole = write_bag(tmp_path / "whole.mcap", sent, "NONE", enable_crcs=False).read_bytes()
    true = expected(sent)
    path = tmp_path / "flipped.mcap"
    for content in flipped(whole, seed=3):
        samples, recording = outcome(read, path, content)
        if samples is not None and samples.tobytes() != true.tobytes():
            assert any("checksum" in str(finding) for finding in recording.findings) or recording.is_partial


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "is empty, expected an MCAP file"),
        (b"#ROSBAG V2.0\n" + bytes(100), "is not an MCAP file"),
        (b"\x89MCAP0\r\n", "joint_states: is not a topic of the recording, it has none"),
        (b"\x89MCAP0\r\n" * 20, "joint_states: is not a topic of the recording, it has none"),
        (b"\x89MCAP0\r\n\x06" + b"\xff" * 200, "is not a topic"),
        (b"\x89MCAP0\r\n\x05" + b"\xff" * 200, "is not a topic"),
        (b"\x89MCAP0\r\n\x03" + bytes(200), "is not a topic"),
    ],
    ids=["empty", "ROS 1", "magic", "magics", "chunk", "message", "schema"],
)
def test_what_is_no_recording_is_refused_in_a_line(tmp_path, read, content, text):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=text):
        read(path)


@pytest.mark.parametrize(
    "content",
    [b"", b"SQLite format 3\0" + bytes(84), b"no database" * 100],
    ids=["empty", "head only", "other"],
)
def test_what_is_no_database_is_refused_in_a_line(tmp_path, read, content):
    path = tmp_path / "a.db3"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"a\.db3: is not a readable \.db3 file"):
        read(path)


def test_names_that_are_no_recordings_are_refused(tmp_path, read):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("")
    for name, text in (
        ("nowhere", "does not exist"),
        ("empty", "contains no .mcap"),
        ("notes.txt", "is no recording by its name"),
    ):
        with pytest.raises(RecordingError, match=text):
            read(tmp_path / name)
    with pytest.raises(RecordingError, match="no recording given"):
        read()


def test_a_part_that_cannot_be_opened_is_a_loss(tmp_path, sent, write_bag, expected, read):
    write_bag(tmp_path / "a_0.mcap", sent)
    (tmp_path / "a_1.mcap").write_bytes(b"")
    samples, recording = read(tmp_path)
    assert samples.tobytes() == expected(sent).tobytes()
    assert losses(recording) == ["is empty, expected an MCAP file: it is lost"]
    assert recording.findings[0].file == tmp_path / "a_1.mcap"


def test_a_damaged_database(tmp_path, sent, write_database, expected, read):
    """Cut short it gives what was sent or nothing; a flipped bit may pass, but not unsaid."""
    path = write_database(tmp_path / "bag", sent)
    whole, true = path.read_bytes(), expected(sent)
    for cut in np.random.default_rng(4).integers(0, len(whole), TRUNCATIONS).tolist():
        assert_sound(*outcome(read, path, whole[:cut]), true)
    for content in flipped(whole, seed=5):
        samples, recording = outcome(read, path, content)
        assert samples is None or any("no checksums" in str(finding) for finding in recording.findings)


def test_rows_of_another_kind_are_lost_and_counted(tmp_path, sent, write_database, expected, read):
    """SQLite takes anything for a time; only what can be one is taken from it."""
    path = write_database(tmp_path / "bag", sent)
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE messages SET timestamp = x'17' WHERE id = 5")
        database.execute("UPDATE messages SET data = 'text' WHERE id = 7")
    samples, recording = read(path)
    assert len(samples) == len(expected(sent)) - 2
    counted = len(samples) + 2
    assert losses(recording) == [f"{len(samples)} messages could be read of the {counted} that it counts"]


def test_claims_of_great_size_do_not_fill_the_memory(tmp_path, sent, write_bag, read):
    """Every length in the head of a chunk made huge in turn, without an index to tell better."""
    index_types = pytest.importorskip("mcap.writer").IndexType
    whole = write_bag(tmp_path / "whole.mcap", sent, index_types=index_types.NONE).read_bytes()
    first = whole.index(b"\x04\0\0\0zstd") - 37
    assert whole[first] == 6
    path = tmp_path / "huge.mcap"
    for at in (first + 1, first + 9 + 16, first + 9 + 28, first + 9 + 28 + 8):
        content = bytearray(whole)
        content[at + 3 : at + 7] = b"\xff" * 4
        samples, recording = outcome(read, path, content)
        assert samples is None or recording.is_partial
