"""^C ends every command with one line and exit code 130, at instants that lose an exception, too.

The instants are events inside the process, so that the tests do not depend on how fast it is.
"""

import os
import sqlite3
import subprocess
import sys

import pytest

from leg_wear_monitor.errors import close_open, closed_on_interrupt, would_be_lost
from leg_wear_monitor.files import share_directory

RUN = """
import os, signal, sys
sys.argv = [{program!r}, *{arguments}]
def is_below(frame):
    while frame is not None and frame.f_code.co_name != {below!r}:
        frame = frame.f_back
    return frame is not None
def on_import(event, arguments):
    if event == "import" and arguments[0] == {module!r}:
        os.kill(os.getpid(), signal.{name})
def on_call(frame, event, _):
    if event == "call" and frame.f_code.co_name == "_object_compiled_hook" and is_below(frame):
        sys.setprofile(None)
        os.kill(os.getpid(), signal.{name})
if {module!r}:
    sys.addaudithook(on_import)
else:
    sys.setprofile(on_call)
from leg_wear_monitor.cli.start import {program} as run
run()
"""


def interrupted(tmp_path, *arguments, module=None, below="main", program="main", name="SIGINT"):
    """Exit code and stderr of a command that interrupts itself, with nothing compiled yet.

    It does so when a module is imported, or else when LLVM calls back below a function: Python prints an
    exception that is raised there, and goes on.
    """
    code = RUN.format(arguments=arguments, module=module, below=below, program=program, name=name)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    line = [sys.executable, "-c", code]
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=False, timeout=300)
    return done.returncode, done.stderr.splitlines()


@pytest.mark.plain
@pytest.mark.parametrize("module", ["click", "numba", "numpy.linalg"])
def test_while_modules_are_imported(tmp_path, module):
    assert interrupted(tmp_path, "check", module=module) == (130, ["error: interrupted"])


def test_while_kernels_are_compiled(tmp_path):
    code, (line, *rest) = interrupted(tmp_path, "check", "jansen_leg")
    assert line.startswith("compiling numerical kernels")
    assert (code, rest) == (130, ["error: interrupted"])


def test_the_ledger_of_a_replay_that_is_still_compiling_is_left_in_order(tmp_path):
    """The next run must not take it for one that was cut off and lost wear."""
    pytest.importorskip("mcap")
    ledger, bag = tmp_path / "wear.db", share_directory() / "bags" / "healthy.mcap"
    line = ("replay", str(bag), "--ledger", str(ledger))
    code, lines = interrupted(tmp_path, *line, below="open_monitor")
    assert (code, lines[-1]) == (130, "error: interrupted")
    with sqlite3.connect(ledger) as db:
        assert db.execute("SELECT closed FROM run").fetchall() == []
    db.close()


@pytest.mark.plain
def test_what_is_open_is_closed_once_the_newest_first():
    closed = []
    with closed_on_interrupt(lambda: closed.append("outer")):
        with closed_on_interrupt(lambda: closed.append("done")):
            pass
        with closed_on_interrupt(lambda: closed.append("inner")):
            close_open()
            close_open()
    close_open()
    assert closed == ["inner", "outer"]


@pytest.mark.plain
def test_an_exception_is_lost_in_an_import_but_not_in_a_call(tmp_path, monkeypatch):
    assert not would_be_lost(sys._getframe())
    assert not would_be_lost(None)
    (tmp_path / "asks_at_import.py").write_text(
        "import sys\nfrom leg_wear_monitor.errors import would_be_lost\n"
        "lost = would_be_lost(sys._getframe())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import asks_at_import

    assert asks_at_import.lost


@pytest.mark.plain
def test_the_second_interrupt_ends_what_takes_too_long():
    code = (
        "import os, signal\n"
        "from leg_wear_monitor.errors import interrupt\n"
        "signal.signal(signal.SIGINT, interrupt)\n"
        "try:\n    os.kill(os.getpid(), signal.SIGINT)\n"
        "finally:\n    os.kill(os.getpid(), signal.SIGINT)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")
