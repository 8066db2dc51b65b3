"""Files: written whole or not at all, and YAML that is refused in one line."""

import fcntl
import os
import signal
import subprocess
import sys

import pytest

from leg_wear_monitor import ConfigError, load_config, load_mechanism
from leg_wear_monitor.configuration.strict import MOST_BYTES
from leg_wear_monitor.files import unfinished, write_whole

# Files are whole, also after a kill in the middle of a write, and if several processes write at once.


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


# A YAML file is read within bounds, and whatever it holds, it is refused in one line.


LAUGHS = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i + 1}: &a{i + 1} {{x: *a{i}, y: *a{i}, z: *a{i}}}\n" for i in range(40)
)
HOSTILE = {
    "contains itself": ("/**: &x {ros__parameters: *x}", "line 1: &x names a list or mapping"),
    "a list in itself": ("name: &x [*x]", "line 1: &x names a list or mapping"),
    "aliases of aliases": (LAUGHS, "line 1: &a0 names a list or mapping"),
    "merge keys": ("a: 1\nb: &b {c: 1}\nd: {<<: *b}\n", "line 2: &b names a list or mapping"),
    "brackets": ("a: " + 1200 * "[", "is not YAML"),
    "code": ("name: !!python/object/apply:os.system ['touch pwned']", "is not YAML"),
    "a tag that does not fit": ("name: !!int many", "is not YAML"),
    "a set": ("name: !!set 3", "is not YAML"),
    "two documents": ("a: 1\n---\nb: 2\n", "is not YAML"),
    "too long": ("#" * (MOST_BYTES + 1), f"has more than {MOST_BYTES} bytes"),
    "empty": ("", "is not a mapping"),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_yaml_is_one_line(tmp_path, what):
    text, said = HOSTILE[what]
    (tmp_path / "x.yaml").write_text(text)
    for load in (load_mechanism, load_config):
        with pytest.raises(ConfigError) as error:
            load(tmp_path / "x.yaml")
        assert "\n" not in str(error.value)
        assert said in str(error.value) or "is not a ROS parameter file" in str(error.value)
    assert not (tmp_path / "pwned").exists()


@pytest.mark.parametrize(
    "content", [b"\xff\xfe" + "a: 1".encode("utf-16-le"), b"\x00\x01\x02", bytes(range(128, 256))]
)
def test_what_is_no_text_is_one_line(tmp_path, content):
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(ConfigError, match=r"x\.yaml: (is not|nothing)"):
        load_mechanism(tmp_path / "x.yaml")


def test_a_device_is_not_read(tmp_path):
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    with pytest.raises(ConfigError, match=r"is a device\. Expected a file"):
        load_mechanism(tmp_path / "zero.yaml")


def test_a_byte_order_mark_is_no_fault(tmp_path, leg):
    text = b"\xef\xbb\xbf/**: {ros__parameters: {hardware_id: leg-7}}"
    (tmp_path / "x.yaml").write_bytes(text)
    assert load_config(tmp_path / "x.yaml").hardware_id == "leg-7"
