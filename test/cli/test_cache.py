"""``leg-wear-monitor cache``: what is kept, and nothing of it afterwards."""

import subprocess
import sys
from pathlib import Path

import pytest

from leg_wear_monitor.cli import kernels
from leg_wear_monitor.compiled import kernel


def test_it_prints_where_and_how_much(run, place):
    old = place / "dynamics.full.model-0123456789abcdef"
    old.mkdir(parents=True, mode=0o700)
    (old / "code").write_bytes(bytes(2_300_000))
    lines = run("cache").stdout.splitlines()
    assert lines == [f"place: {place}", "total: 2.3 MB in 2 directories"]  # one is the verb's own


def test_clear_removes_all_of_it_and_nothing_beside(run, place):
    for name in ("dynamics.full.model-0123456789abcdef", "0123456789abcdef"):
        (place / name / "deep").mkdir(parents=True)
        (place / name / "deep" / "code").write_bytes(bytes(1_000_000))
    (place.parent / "beside").write_text("")
    (place / "link").symlink_to(place.parent)
    result = run("cache", "--clear")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[1] == "removed: 2.0 MB in 3 directories"
    assert [each.name for each in place.iterdir()] == ["link"]
    assert (place.parent / "beside").exists()


def test_nothing_is_removed_where_no_place_is_safe(run, monkeypatch):
    monkeypatch.setattr(kernel, "cache_directory", lambda: None)
    result = run("cache", "--clear")
    assert result.exit_code == 2
    assert result.stderr == "error: no directory is safe for compiled code, so it is not stored\n"


def test_a_fill_prints_the_place_and_the_size(run, place, monkeypatch):
    monkeypatch.setattr(kernels, "_CALLS", {"nothing": int})
    result = run("cache", "--fill")
    assert result.exit_code == 0
    assert result.stdout.startswith(f"place: {place}\ntotal: ")
    assert run("cache", "--fill", "--clear").exit_code == 2


@pytest.mark.slow
def test_after_a_fill_nothing_is_compiled(run, place):
    assert run("cache", "--fill").exit_code == 0
    line = "import leg_wear_monitor.cli.kernels as kernels; [call() for call in kernels._CALLS.values()]"
    before = sorted(file for file in place.rglob("*.nbc"))
    subprocess.run([sys.executable, "-c", line], check=True, cwd=Path(__file__).parents[2])
    assert before and sorted(file for file in place.rglob("*.nbc")) == before
