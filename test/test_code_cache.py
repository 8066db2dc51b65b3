"""Compiled code lies where no other local user can put or replace a file: its index files are pickles."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from leg_wear_monitor.compiled.cache import code_directory, fault_of, make_private
from leg_wear_monitor.errors import ConfigWarning

NOBODY = 65534
WHERE = "from leg_wear_monitor.compiled.cache import code_directory; print(code_directory('leaf'))"
TWICE = (
    f"import subprocess, sys; {WHERE}; sys.stdout.flush(); subprocess.run([sys.executable, '-c', {WHERE!r}])"
)
KERNELS = "from leg_wear_monitor.compiled.kernel import cache_directory; print(cache_directory())"

as_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to be two users")


def mode(path):
    return path.stat().st_mode & 0o7777


def where(program=WHERE, user=None, **environment):
    """Where a fresh process puts its compiled code, and what it says on stderr."""
    unset = ("NUMBA_", "XDG_", "COV_", "TMPDIR")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(unset)} | environment
    command = [sys.executable, "-W", "default", "-c", program]
    done = subprocess.run(command, env=kept, text=True, capture_output=True, check=True, user=user)
    return done.stdout.splitlines(), done.stderr


@pytest.fixture
def shared(tmp_path):
    """A directory like /tmp, on a way that other users can go, too."""
    for directory in (tmp_path, *tmp_path.parents):
        if directory.stat().st_uid == os.geteuid() and directory.name.startswith(("popen", "pytest", "test")):
            directory.chmod(0o755)
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    return tmp_path / "tmp"


def test_what_is_made_is_private_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        assert make_private(tmp_path / "a" / "b") is None
    finally:
        os.umask(before)
    assert [mode(tmp_path / "a"), mode(tmp_path / "a" / "b")] == [0o700, 0o700]


def test_a_directory_of_ours_that_others_can_read_becomes_private(tmp_path):
    (tmp_path / "a").mkdir(mode=0o755)
    assert make_private(tmp_path / "a") is None
    assert mode(tmp_path / "a") == 0o700


@pytest.mark.parametrize("bits", [0o777, 0o775, 0o757, 0o1777])
def test_a_directory_that_others_can_write_to_is_refused(shared, bits):
    (shared / "a").mkdir()
    (shared / "a").chmod(bits)
    fault = make_private(shared / "a")
    assert fault == f"{shared / 'a'} can be written to by others (chmod go-w {shared / 'a'})"
    assert mode(shared / "a") == bits


def test_on_the_way_the_sticky_bit_makes_the_difference(shared):
    (shared / "a").mkdir()
    assert fault_of(shared / "a" / "b") is None
    shared.chmod(0o777)
    assert "can be written to by others" in fault_of(shared / "a" / "b")


def test_below_a_directory_that_nobody_else_enters_modes_do_not_matter(shared):
    (shared / "mine" / "open").mkdir(parents=True)
    (shared / "mine" / "open").chmod(0o777)
    (shared / "mine").chmod(0o700)
    assert make_private(shared / "mine" / "open" / "leaf") is None
    (shared / "mine").chmod(0o711)
    assert make_private(shared / "mine" / "open" / "leaf") is not None


def test_a_link_is_judged_by_where_it_leads(shared):
    (shared / "open").mkdir()
    (shared / "open").chmod(0o777)
    (shared / "mine").mkdir(mode=0o700)
    (shared / "mine" / "link").symlink_to(shared / "open")
    (shared / "mine" / "up").symlink_to("../mine/../open")
    (shared / "mine" / "good").symlink_to("../mine")
    (shared / "mine" / "loop").symlink_to("loop")
    assert f"{shared / 'open'} can be written" in fault_of(shared / "mine" / "link" / "leaf")
    assert f"{shared / 'open'} can be written" in fault_of(shared / "mine" / "up" / "leaf")
    assert f"{shared / 'open'} can be written" in fault_of(shared / "mine" / "good" / ".." / "open")
    assert fault_of(shared / "mine" / "good") is None
    assert "loop" in fault_of(shared / "mine" / "loop")


def test_a_file_in_the_way_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    assert "Not a directory" in make_private(tmp_path / "file" / "a")


@as_root
def test_what_another_user_owns_is_refused(shared):
    for name in ("theirs", "link"):
        (shared / name).mkdir() if name == "theirs" else (shared / name).symlink_to("/root")
        os.chown(shared / name, NOBODY, NOBODY, follow_symlinks=False)
        fault = make_private(shared / name / "leaf")
        assert fault == f"{shared / name} belongs to a different user (uid {NOBODY})"
    assert list((shared / "theirs").iterdir()) == []


@as_root
def test_a_directory_laid_in_advance_by_another_user_is_not_used(shared, tmp_path):
    """The way in: a service without a home, and a name below /tmp that anybody can foretell."""
    laid = shared / f"leg_wear_monitor-{os.geteuid()}" / "leg_wear_monitor"
    laid.mkdir(parents=True)
    for path in (laid, laid.parent):
        os.chown(path, NOBODY, NOBODY)
    (tmp_path / "file").write_text("")
    (place,), output = where(KERNELS, TMPDIR=str(shared), HOME=str(tmp_path / "file"))
    assert not any(laid.iterdir())
    assert Path(place).parents[1].parent == shared
    assert not Path(place).is_relative_to(laid.parent)
    assert f"{laid.parent} belongs to a different user (uid {NOBODY})" in output
    assert "compiled code is not stored" in output
    assert not Path(place).exists()  # gone with the process


def test_a_directory_that_was_asked_for_and_is_refused_is_reported_once(shared, tmp_path):
    """Child processes go where their parent went and say nothing."""
    (shared / "asked" / "leg_wear_monitor").mkdir(parents=True)
    (shared / "asked" / "leg_wear_monitor").chmod(0o777)
    places, output = where(TWICE, NUMBA_CACHE_DIR=str(shared / "asked"), HOME=str(tmp_path / "home"))
    assert places == [str(tmp_path / "home" / ".cache" / "leg_wear_monitor" / "leaf")] * 2
    assert output.count("ConfigWarning") == 1
    assert "NUMBA_CACHE_DIR: " in output
    assert "can be written to by others (chmod go-w" in output


def test_child_processes_share_what_goes_with_their_parent(shared):
    shared.joinpath(f"leg_wear_monitor-{os.geteuid()}").write_text("in the way")
    places, output = where(TWICE, TMPDIR=str(shared), HOME="/dev/null")
    assert places[0] == places[1]
    assert output.count("compiled code is not stored") == 1
    assert [path.name for path in shared.iterdir()] == [f"leg_wear_monitor-{os.geteuid()}"]


def test_where_no_place_is_safe_nothing_is_kept(shared):
    """A temporary directory whose entries anybody can rename."""
    shared.chmod(0o777)
    places, output = where(TMPDIR=str(shared), HOME="/dev/null")
    assert places == ["None"]
    assert "can be written to by others" in output


def test_the_usual_place_is_taken_without_a_word(place):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConfigWarning)
        assert code_directory("a leaf of this test") == place / "a leaf of this test"


def test_of_old_versions_the_two_used_last_are_kept(tmp_path, place):
    """Others go once they have not been used for a day; so do those that versions before named otherwise."""
    now = tmp_path.stat().st_mtime
    days = {
        "a.b-1": 3.0, "a.b-2": 2.0, "a.b-3": 5.0, "a.b-4": 4.0, "a.c-1": 9.0, "a-1": 9.0,
        "0123456789abcdef": 9.0, "fedcba9876543210": 0.5,
    }  # fmt: skip
    for name, age in days.items():
        (place / name).mkdir(parents=True, mode=0o700)
        os.utime(place / name, (now - 86400.0 * age,) * 2)
    assert code_directory("a.b-new") == place / "a.b-new"
    left = {each.name for each in place.iterdir()}
    assert left == {"a.b-new", "a.b-2", "a.c-1", "a-1", "fedcba9876543210"}


def test_what_was_used_within_a_day_stays(place):
    for k in range(5):
        (place / f"a.b-{k}").mkdir(parents=True, mode=0o700)
    code_directory("a.b-new")
    assert len(list(place.iterdir())) == 6
