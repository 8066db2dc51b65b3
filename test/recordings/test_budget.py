"""What a recording claims does not decide how much memory it gets; what it is not given is reported."""

import os
import struct

import lz4.frame
import pytest
import zstandard

from leg_wear_monitor.recordings import findings
from leg_wear_monitor.recordings.findings import RecordingError

BOMB_BYTES = 100_000_000


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic(0.5)


def with_a_chunk(whole, data, compression, size, is_cut=False):
    """A file without an index, and one chunk more at its end."""
    content = whole[: whole.rindex(struct.pack("<BQ", 0x0F, 4))]
    head = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression + struct.pack("<Q", len(data))
    chunk = struct.pack("<BQ", 0x06, len(head) + len(data)) + head + data
    end = struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + b"\x89MCAP0\r\n"
    return content + (chunk[: len(chunk) * 9 // 10] if is_cut else chunk + end)


@pytest.mark.parametrize("is_cut", [False, True])
@pytest.mark.parametrize("claimed", [BOMB_BYTES, 1000])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_that_grows_is_left_out_and_reported(
    tmp_path, monkeypatch, sent, write_bag, expected, read, compression, claimed, is_cut
):
    monkeypatch.setattr(findings, "MOST_BYTES", 8_000_000)
    index_types = pytest.importorskip("mcap.writer").IndexType
    whole = write_bag(tmp_path / "whole.mcap", sent, index_types=index_types.NONE).read_bytes()
    compress = zstandard.compress if compression == "zstd" else lz4.frame.compress
    path = tmp_path / "bomb.mcap"
    bomb = compress(bytes(BOMB_BYTES))
    path.write_bytes(with_a_chunk(whole, bomb, compression.encode(), claimed, is_cut))
    samples, recording = read(path)
    assert samples.tobytes() == expected(sent).tobytes()
    assert recording.is_partial
    if claimed == BOMB_BYTES and not is_cut:
        texts = [str(finding) for finding in recording.findings]
        assert any("needs 100 MB to be read. Expected at most 8 MB" in text for text in texts)


def test_a_hole_that_claims_gigabytes_is_passed_over(tmp_path, sent, write_bag, expected, read):
    index_types = pytest.importorskip("mcap.writer").IndexType
    whole = write_bag(tmp_path / "whole.mcap", sent, index_types=index_types.NONE).read_bytes()
    content = whole[: whole.rindex(struct.pack("<BQ", 0x0F, 4))] + struct.pack("<BQ", 0x05, 2**33)
    path = tmp_path / "hole.mcap"
    path.write_bytes(content)
    os.truncate(path, len(content) + 2**33)
    samples, recording = read(path)
    assert samples.tobytes() == expected(sent).tobytes()
    assert any("is cut off or damaged at byte" in str(finding) for finding in recording.findings)


@pytest.mark.parametrize(("name", "in_a_bag"), [("x.mcap", False), ("x.db3", False), ("x.mcap", True)])
def test_a_pipe_is_refused_without_a_wait(tmp_path, read, name, in_a_bag):
    home = tmp_path / "bag" if in_a_bag else tmp_path
    home.mkdir(exist_ok=True)
    os.mkfifo(home / name)
    with pytest.raises(RecordingError, match=r"not a file\. Expected|contains no \.mcap or \.db3 file"):
        read(home if in_a_bag else home / name)


@pytest.mark.parametrize("name", ["x" * 300 + ".mcap", "x\0y.mcap"])
def test_a_name_that_cannot_be_is_refused_in_a_line(tmp_path, read, name):
    with pytest.raises(RecordingError, match=r"cannot be read: |does not exist") as caught:
        read(tmp_path / name)
    assert str(caught.value).isprintable()
