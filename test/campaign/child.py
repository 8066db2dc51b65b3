"""One case in a child forked from a parent that is warm: what is compiled is there, the memory is its own."""

import os
import resource
import selectors
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from campaign.case import CRASHED, Case, Outcome, Ran

_MOST_OUTPUT = 4_000_000  # bytes looked at
_GUARD = 6  # no case may take more than so many times its memory from the machine


def ran(case: Case, directory: Path, idle_mb: float) -> Ran:
    """Run a case below an empty directory, and give what is left of it.

    Parameters
    ----------
    case : Case
    directory : pathlib.Path
    idle_mb : float
        What a child has that does nothing [MB].
    """
    work, temporary = directory / "work", directory / "tmp"
    for each in (work, temporary):
        each.mkdir(parents=True)
    if case.prepare is not None:
        case.prepare(work)
    began = time.monotonic()
    child = os.fork()
    if not child:
        _be_the_child(case, directory)
    is_late = _wait(child, case.seconds)
    _, status, usage = os.wait4(child, 0)
    seconds = time.monotonic() - began
    _kill(child)  # what it has left running
    return Ran(
        code=os.waitstatus_to_exitcode(status),
        stdout=_text(directory / "stdout"),
        stderr=_text(directory / "stderr"),
        directory=work,
        seconds=seconds,
        memory_mb=max(0.0, usage.ru_maxrss / 1024 - idle_mb),
        is_late=is_late,
        verdict=_verdict(directory / "verdict"),
    )


def done(call: Callable[[], object], kill_after_s: float | None = None) -> bool:
    """Call a function in a silent process of its own, which may be killed; whether it came to its end."""
    pid = os.fork()
    if pid == 0:
        code = CRASHED
        try:
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, 1)
            os.dup2(nothing, 2)
            call()
            code = 0
        finally:
            os._exit(code)
    if kill_after_s is not None:
        time.sleep(kill_after_s)
        os.kill(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status):
        return False
    if os.WEXITSTATUS(status):
        raise RuntimeError(f"it ended with exit code {os.WEXITSTATUS(status)}")
    return True


def idle_mb() -> float:
    """Memory of a child that does nothing [MB]."""
    child = os.fork()
    if not child:
        os._exit(0)
    return os.wait4(child, 0)[2].ru_maxrss / 1024


def _be_the_child(case: Case, directory: Path) -> None:
    code = CRASHED
    try:
        _settle(case, directory)
        verdict = case.run(directory / "work")
        if verdict is not None:
            (directory / "verdict").write_text(f"{verdict[0].name}\n{verdict[1]}")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001 - whatever it is, it is what the case shows
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code & 0xFF)


def _settle(case: Case, directory: Path) -> None:
    """A group, a directory, outputs and limits of its own."""
    os.setsid()
    for stream, name, flags in (
        (0, os.devnull, os.O_RDONLY),
        (1, directory / "stdout", os.O_WRONLY | os.O_CREAT),
        (2, directory / "stderr", os.O_WRONLY | os.O_CREAT),
    ):
        file = os.open(name, flags, 0o600)
        os.dup2(file, stream)
        os.close(file)
    os.chdir(directory / "work")
    os.environ["TMPDIR"] = tempfile.tempdir = str(directory / "tmp")
    there = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limit = there + int(_GUARD * case.memory_mb * 2**20)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _wait(child: int, seconds: float) -> bool:
    """Wait for a child to end, and kill it if it takes too long; whether that had to be."""
    handle = os.pidfd_open(child)
    try:
        with selectors.DefaultSelector() as selector:
            selector.register(handle, selectors.EVENT_READ)
            is_late = not selector.select(seconds)
    finally:
        os.close(handle)
    if is_late:
        os.kill(child, signal.SIGKILL)
        _kill(child)
    return is_late


def _kill(group: int) -> None:
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return  # all of it has ended


def _text(path: Path) -> str:
    if not path.exists():
        return ""
    with path.open("rb") as file:
        return file.read(_MOST_OUTPUT).decode("utf-8", "replace")


def _verdict(path: Path) -> tuple[Outcome, str] | None:
    if not path.exists():
        return None
    name, text = path.read_text().split("\n", 1)
    return Outcome[name], text
