"""Files of a fleet are whole, also after a kill in the middle of a write."""

import os
import signal
import subprocess
import sys

import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.fleet.directory.atomic import append_line, write_whole

pytestmark = pytest.mark.plain

KILLED = """
import os, signal, sys
from pathlib import Path
from leg_wear_monitor.fleet.directory.atomic import write_whole
os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
write_whole(Path(sys.argv[1]), b"new")
"""


def test_a_kill_leaves_the_old_file_and_nothing_after_the_next_write(tmp_path):
    path = tmp_path / "a.parquet"
    write_whole(path, b"old")
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=os.getcwd(), check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"old"
    write_whole(path, b"newer")
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("a.parquet", b"newer")]


def test_a_line_that_was_cut_off_is_removed(tmp_path):
    path = tmp_path / "log"
    append_line(path, "one")
    path.write_bytes(path.read_bytes() + b"tw" * 5000)
    append_line(path, "three")
    assert path.read_text() == "one\nthree\n"


def test_where_nothing_can_be_written_one_line_says_so(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match=r"file/a: cannot be written: "):
        write_whole(tmp_path / "file" / "a", b"")
