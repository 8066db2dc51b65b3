"""Files are whole, also after a kill in the middle of a write, and if several processes write at once."""

import fcntl
import os
import signal
import subprocess
import sys

import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import unfinished, write_whole

KILLED = """
import os, signal, sys
from pathlib import Path
from leg_wear_monitor.files import write_whole
os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
write_whole(Path(sys.argv[1]), b"new")
"""


TOGETHER = """
import sys
from pathlib import Path
from leg_wear_monitor.files import write_whole
for _ in range(50):
    write_whole(Path(sys.argv[1]), sys.argv[2].encode() * 20_000)
"""


def test_a_kill_leaves_the_old_file_and_nothing_after_the_next_write(tmp_path):
    path = tmp_path / "a.parquet"
    write_whole(path, b"old")
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=os.getcwd(), check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"old"
    write_whole(path, b"newer")
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("a.parquet", b"newer")]


def test_what_killed_processes_left_is_removed_and_what_is_being_written_stays(tmp_path):
    path = tmp_path / "reports.mcap"
    left = [tmp_path / f".reports.mcap.{number}.part" for number in (7, 8, 9)]
    others = [tmp_path / f".{name}.part" for name in ("summary.mcap.7", "reports.mcap", "reports.mcap.x")]
    for each in [*left, *others]:
        each.touch()
    left.append(tmp_path / ".reports.mcap.10.part")
    left[-1].symlink_to("nowhere")
    with left[1].open() as writing:
        fcntl.flock(writing, fcntl.LOCK_EX)
        with unfinished(path) as part:
            part.write_bytes(b"reports")
            with unfinished(tmp_path / "another"):  # begins meanwhile
                assert set(tmp_path.glob(".reports.*")) >= {part, left[1]}
            part.replace(path)
    assert sorted(tmp_path.iterdir()) == sorted([path, left[1], left[3], *others])
    with pytest.raises(KeyError), unfinished(path):
        raise KeyError
    assert sorted(tmp_path.iterdir()) == sorted([path, left[3], *others])
    assert path.read_bytes() == b"reports"


def test_where_nothing_can_be_written_one_line_says_so(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match=r"file/a: cannot be written: "):
        write_whole(tmp_path / "file" / "a", b"")


def test_processes_that_write_the_same_file_leave_it_whole_at_any_time(tmp_path):
    path = tmp_path / "study.json"
    write_whole(path, b"0")
    writers = [subprocess.Popen([sys.executable, "-c", TOGETHER, str(path), str(k)]) for k in range(3)]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        content = path.read_bytes()
        seen.add((len(content), len(set(content))))
    assert [writer.returncode for writer in writers] == [0, 0, 0]
    assert seen <= {(1, 1), (20_000, 1)}
    assert list(tmp_path.iterdir()) == [path]


def test_a_write_that_fails_leaves_the_old_file_alone(tmp_path, monkeypatch):
    path = tmp_path / "a"
    write_whole(path, b"old")
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(ConfigError, match="a: cannot be written: No space left on device"):
        write_whole(path, b"new")
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("a", b"old")]
