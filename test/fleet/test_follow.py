"""A recording is taken while others are recorded, once it is complete."""

import inspect
import signal
import time
from contextlib import ExitStack

import pytest
from click.testing import CliRunner

from leg_wear_monitor.bags.mcap_layout import MAGIC
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.fleet.description import load_fleet
from leg_wear_monitor.fleet.directory import append_line, locked
from leg_wear_monitor.fleet.update import PATIENCE, Followed, has_end

pytestmark = pytest.mark.plain


def test_followed_it_outlasts_another_update_and_a_description_that_is_half_written(
    tmp_path, describe, monkeypatch
):
    pytest.importorskip("pyarrow")
    (tmp_path / "a").mkdir()
    path, another = describe(tmp_path, "a"), ExitStack()
    whole = path.read_text()

    def halves():
        another.enter_context(locked(tmp_path / "out"))
        yield
        yield  # the same once more is not said again
        another.close()
        path.write_text(whole[:-4])
        yield
        path.write_text(whole)
        yield
        raise KeyboardInterrupt

    between_looks = halves()
    monkeypatch.setattr(time, "sleep", lambda _: next(between_looks))
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    old = "mix_stderr" in inspect.signature(CliRunner).parameters  # before click 8.2
    runner = CliRunner(mix_stderr=False) if old else CliRunner()
    arguments = ["fleet", "update", str(path), "--out", str(tmp_path / "out"), "--workers", "1", "--follow"]
    done = runner.invoke(cli, arguments)
    lines = [line for line in done.stderr.splitlines() if "matches no recording" not in line]
    assert done.exit_code == 0 and len(lines) == 2, done.output
    assert lines[0].endswith("is being updated by another process; wait for its end; tried again")
    assert lines[1].startswith(f"warning: {path}: ") and lines[1].endswith("; tried again")


@pytest.fixture
def look(tmp_path, describe):
    """Names of the complete recordings at each look."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a/0.mcap").write_bytes(MAGIC + MAGIC)
    path, followed = describe(tmp_path, "a"), Followed()

    def names():
        (leg,) = followed.complete(load_fleet(path)).legs
        return [path.name for path in leg.recordings]

    return names


def test_what_has_its_end_is_taken_when_it_does_not_change(look, tmp_path):
    assert look() == []
    assert look() == ["0.mcap"]
    growing = tmp_path / "a/1.mcap"
    growing.write_bytes(MAGIC)
    assert look() == ["0.mcap"]
    growing.write_bytes(MAGIC + b"part")
    assert look() == ["0.mcap"]
    growing.write_bytes(MAGIC + b"parts" + MAGIC)
    assert look() == ["0.mcap"]
    assert look() == ["0.mcap", "1.mcap"]


def test_without_an_end_it_is_taken_when_it_has_not_changed_for_long(look, tmp_path):
    (tmp_path / "a/1.mcap").write_bytes(MAGIC + b"cut off")
    taken = ["1.mcap" in look() for _ in range(PATIENCE + 2)]
    assert taken == [False] * PATIENCE + [True] * 2


@pytest.mark.parametrize(
    ("name", "content", "ended"),
    [
        ("a.mcap", MAGIC + b"x" + MAGIC, True),
        ("a.mcap", b"", False),
        ("a.parquet", b"PAR1xPAR1", True),
        ("a.csv", b"1,2\n", False),
        ("a.txt", b"", False),
    ],
)
def test_ends(tmp_path, name, content, ended):
    (tmp_path / name).write_bytes(content)
    assert has_end(tmp_path / name) is ended


def test_a_bag_directory_ends_with_its_metadata(tmp_path):
    (tmp_path / "run_0.mcap").touch()
    assert not has_end(tmp_path)
    (tmp_path / "metadata.yaml").touch()
    assert has_end(tmp_path)


def test_a_line_that_was_cut_off_is_removed_before_the_next(tmp_path):
    append_line(tmp_path / "log", "one")
    (tmp_path / "log").write_bytes(b"one\n" + b"tw" * 5000)
    append_line(tmp_path / "log", "three")
    assert (tmp_path / "log").read_text() == "one\nthree\n"
