"""A second process that compiles: its code arrives, its failure is one line, and it ends with this one."""

import fcntl
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from leg_wear_monitor import workers
from leg_wear_monitor.cli.start import main
from leg_wear_monitor.compiled.cache import one_process_at_a_time
from leg_wear_monitor.errors import ConfigWarning, close_open
from leg_wear_monitor.workers import compiled_beside, python_command

MODULE = """
from leg_wear_monitor.compiled.kernel import compile_for, entry
@entry
def line(x):
    return 2.0 * x
@entry
def curve(x):
    return x * x
def compile_curve():
    compile_for(curve, 1.0)
"""
SCRIPT = """
import time
from shapes import compile_curve, curve, line
from leg_wear_monitor import workers
from leg_wear_monitor.compiled.kernel import is_stored
workers._processors = lambda: 2
with workers.compiled_beside(compile_curve, curve):
    here = line(3.0)
    while not is_stored(curve):
        time.sleep(0.02)
print(here, curve(3.0), len(line.stats.cache_hits), len(curve.stats.cache_hits))
"""


@pytest.fixture
def started(monkeypatch, tmp_path):
    """The second processes that were started; nothing is stored, and there are two processors."""
    processes = []
    start = workers._started

    def noting(*arguments):
        processes.append(start(*arguments))
        return processes[-1]

    monkeypatch.setattr(workers, "_started", noting)
    monkeypatch.setattr(workers, "_processors", lambda: 2)
    monkeypatch.setattr(workers, "is_stored", lambda _entry: False)
    monkeypatch.setattr(workers, "cache_directory", lambda: tmp_path)
    return processes


def entry():
    """Stands for what is compiled."""


def test_what_both_processes_compile_is_in_the_cache(tmp_path):
    (tmp_path / "shapes.py").write_text(MODULE)
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA_", "COV_"))}
    environment = {**kept, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", SCRIPT]
    results = []
    for _ in range(2):
        done = subprocess.run(
            command, env=environment, cwd=tmp_path, text=True, capture_output=True, check=True, timeout=300
        )
        results.append(done.stdout.split())
        assert done.stderr == ""
    assert results == [["6.0", "9.0", "0", "1"], ["6.0", "9.0", "1", "1"]]


@pytest.mark.plain
@pytest.mark.usefixtures("traps")
def test_a_process_imports_nothing_from_the_current_directory():
    done = subprocess.run(python_command(main, "--version"), capture_output=True, text=True, check=True)
    assert done.stdout.startswith("leg-wear-monitor ")


@pytest.mark.plain
def test_processes_are_started_in_two_files():
    """Each of which keeps the current directory out."""
    home = Path(workers.__file__).parent
    start = re.compile(
        r"sys\.executable|\bParallel\(|ProcessPoolExecutor\(|get_context\(|\bPopen\(|subprocess\.run\(|os\.system"
    )
    found = {str(path.relative_to(home)) for path in home.rglob("*.py") if start.search(path.read_text())}
    assert found == {"cli/verbs/nodes.py", "workers.py"}


@pytest.mark.plain
def test_a_failure_is_one_line_with_its_cause(started):
    with pytest.warns(ConfigWarning) as seen, compiled_beside(json.loads, entry):  # type: ignore[arg-type]
        os.waitid(os.P_PID, started[0].pid, os.WEXITED | os.WNOWAIT)
    (warning,) = seen
    text = str(warning.message)
    head, tail = "compilation in a second process ended with 1: ", "; compiled in this process instead"
    assert text.startswith(f"{head}TypeError: loads() missing") and text.endswith(tail) and "\n" not in text


@pytest.mark.plain
def test_it_ends_with_what_is_inside(started):
    with compiled_beside(signal.pause, entry):
        assert started[0].poll() is None
    with pytest.raises(KeyboardInterrupt), compiled_beside(signal.pause, entry):
        raise KeyboardInterrupt
    assert [process.returncode for process in started] == [-signal.SIGKILL] * 2


@pytest.mark.plain
def test_it_ends_where_an_exception_would_be_lost(started):
    with pytest.warns(ConfigWarning, match="ended with -9"), compiled_beside(signal.pause, entry):
        close_open()
        started[0].wait()


@pytest.mark.plain
@pytest.mark.parametrize(
    ("name", "value"),
    [("_processors", lambda: 1), ("is_stored", lambda _entry: True), ("cache_directory", lambda: None)],
)
def test_there_is_none_where_it_is_of_no_use(monkeypatch, started, name, value):
    monkeypatch.setattr(workers, name, value)
    with compiled_beside(signal.pause, entry):
        pass
    assert not started


@pytest.mark.plain
def test_one_process_at_a_time_is_inside_a_lock(tmp_path):
    path = tmp_path / "lock"

    def is_free():
        with path.open("ab") as other:
            try:
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
        return True

    with one_process_at_a_time(path):
        assert not is_free()
    assert is_free()
    with one_process_at_a_time(Path("/nowhere/lock")):  # where there can be none, nobody waits
        pass
