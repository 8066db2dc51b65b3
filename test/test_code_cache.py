"""Compiled code lies where no other local user can put or replace a file: its index files are pickles."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import command_line
import pytest

from leg_wear_monitor.cli import kernels
from leg_wear_monitor.compiled import kernel
from leg_wear_monitor.compiled.cache import code_directory, make_private
from leg_wear_monitor.errors import ConfigWarning

NOBODY = 65534
WHERE = "from leg_wear_monitor.compiled.kernel import cache_directory; print(cache_directory())"

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to be two users")


def where(**environment):
    """Where a fresh process puts its compiled code, and what it says on stderr."""
    unset = ("NUMBA_", "XDG_", "COV_", "TMPDIR")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(unset)} | environment
    command = [sys.executable, "-W", "default", "-c", WHERE]
    done = subprocess.run(command, env=kept, text=True, capture_output=True, check=True)
    return done.stdout.strip(), done.stderr


def test_a_directory_is_private_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        assert make_private(tmp_path / "a" / "b") is None
    finally:
        os.umask(before)
    assert (tmp_path / "a" / "b").stat().st_mode & 0o7777 == 0o700


@pytest.mark.parametrize("bits", [0o777, 0o775, 0o757, 0o1777])
def test_a_directory_that_others_can_write_to_is_refused(tmp_path, bits):
    (tmp_path / "a").mkdir()
    (tmp_path / "a").chmod(bits)
    (tmp_path / "link").symlink_to("a")
    for path in (tmp_path / "a", tmp_path / "link"):
        assert make_private(path) == f"{path} can be written to by others (chmod go-w {path})"
    assert (tmp_path / "a").stat().st_mode & 0o7777 == bits


def test_a_file_in_the_way_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    assert "Not a directory" in make_private(tmp_path / "file" / "a")


@as_root
def test_a_directory_or_a_link_of_another_user_is_refused(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "link").symlink_to("/root")
    for path in (tmp_path / "theirs", tmp_path / "link"):
        os.chown(path, NOBODY, NOBODY, follow_symlinks=False)
        assert make_private(path) == f"{path} belongs to a different user (uid {NOBODY})"


@as_root
def test_a_directory_laid_in_advance_by_another_user_is_not_used(tmp_path):
    """The way in: a service without a home, and a name below /tmp that anybody can foretell."""
    laid = tmp_path / f"leg_wear_monitor-{os.geteuid()}"
    laid.mkdir()
    os.chown(laid, NOBODY, NOBODY)
    place, output = where(TMPDIR=str(tmp_path), HOME="/dev/null")
    assert place == "None"
    assert not any(laid.iterdir())
    assert f"{laid} belongs to a different user (uid {NOBODY})" in output
    assert "compiled code is not stored" in output


def test_a_directory_that_was_asked_for_and_is_refused_is_reported(tmp_path):
    (tmp_path / "asked" / "leg_wear_monitor").mkdir(parents=True)
    (tmp_path / "asked" / "leg_wear_monitor").chmod(0o777)
    place, output = where(NUMBA_CACHE_DIR=str(tmp_path / "asked"), HOME=str(tmp_path / "home"))
    assert Path(place).parent == tmp_path / "home" / ".cache" / "leg_wear_monitor"
    assert output.count("ConfigWarning") == 1
    assert "NUMBA_CACHE_DIR: " in output
    assert "can be written to by others (chmod go-w" in output


def test_the_usual_place_is_taken_without_a_word(place):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConfigWarning)
        assert code_directory("a leaf of this test") == place / "a leaf of this test"


# --- the verb `cache` ---


def test_it_prints_where_and_how_much(place):
    old = place / "dynamics.full.model-0123456789abcdef"
    old.mkdir(parents=True, mode=0o700)
    (old / "code").write_bytes(bytes(2_300_000))
    lines = command_line.run("cache").out.splitlines()
    assert lines == [f"place: {place}", "total: 2.3 MB in 2 directories"]  # one is the verb's own


def test_clear_removes_all_of_it_and_nothing_beside(place):
    for name in ("dynamics.full.model-0123456789abcdef", "0123456789abcdef"):
        (place / name / "deep").mkdir(parents=True)
        (place / name / "deep" / "code").write_bytes(bytes(1_000_000))
    (place.parent / "beside").write_text("")
    (place / "link").symlink_to(place.parent)
    result = command_line.run("cache", "--clear")
    assert result.code == 0
    assert result.out.splitlines()[1] == "removed: 2.0 MB in 3 directories"
    assert [each.name for each in place.iterdir()] == ["link"]
    assert (place.parent / "beside").exists()


def test_nothing_is_removed_where_no_place_is_safe(monkeypatch):
    monkeypatch.setattr(kernel, "cache_directory", lambda: None)
    result = command_line.run("cache", "--clear")
    assert result.code == 2
    assert result.err == "error: no directory is safe for compiled code, so it is not stored\n"


def test_a_fill_prints_the_place_and_the_size(place, monkeypatch):
    monkeypatch.setattr(kernels, "_CALLS", {"nothing": int})
    result = command_line.run("cache", "--fill")
    assert result.code == 0
    assert result.out.startswith(f"place: {place}\ntotal: ")
    assert command_line.run("cache", "--fill", "--clear").code == 2


@pytest.mark.slow
def test_after_a_fill_nothing_is_compiled(place):
    assert command_line.run("cache", "--fill").code == 0
    line = "import leg_wear_monitor.cli.kernels as kernels; [call() for call in kernels._CALLS.values()]"
    before = sorted(file for file in place.rglob("*.nbc"))
    subprocess.run([sys.executable, "-c", line], check=True, cwd=Path(__file__).parents[1])
    assert before and sorted(file for file in place.rglob("*.nbc")) == before
