"""What a terminal shows while something takes long."""

import io
import sys

import pytest

from leg_wear_monitor.cli import common
from leg_wear_monitor.compiled.kernel import at_compilation


class Terminal(io.StringIO):
    """Takes what is shown."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """Nothing is compiled yet, and the terminal is a wide one."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(common, "is_compiled", lambda kernels: (tmp_path / kernels).exists())
    monkeypatch.setattr(common, "_mark", lambda kernels: tmp_path / kernels)
    return tmp_path


def test_one_display_shows_a_compilation_inside_a_progress_and_the_other_way_round(monkeypatch, fresh):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with common.progress_bar("replaying") as progress:
        with common.compilation("monitor", "gait", how_long="about a minute"):
            progress(0.5)
        progress(1.0)
    with common.compilation("clearance"), common.progress_bar("life") as progress:
        progress(0.5)
    words = {"replaying", "about a minute", "about half a minute", "life"}
    assert {word for word in words if word in terminal.getvalue()} == words
    assert {one.name for one in fresh.iterdir()} == {"monitor", "gait", "clearance"}
    assert not common._display


def test_a_pipe_gets_a_line_when_it_compiles_and_nothing_else(monkeypatch, fresh):
    monkeypatch.setattr(sys, "stderr", pipe := io.StringIO())
    with common.compilation("monitor"), common.progress_bar("life") as progress:
        progress(0.5)
        assert pipe.getvalue() == ""
        for _ in range(2):  # as of two entries
            for call in at_compilation:
                call()
    assert pipe.getvalue() == "compiling numerical kernels (once per installation, about half a minute)\n"
    assert not at_compilation


def test_what_fails_is_not_marked_as_compiled_and_leaves_no_display(monkeypatch, fresh):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with pytest.raises(KeyboardInterrupt), common.compilation("monitor"):
        raise KeyboardInterrupt
    assert not list(fresh.iterdir()) and not common._display
