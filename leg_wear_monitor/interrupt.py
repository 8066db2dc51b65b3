"""What an interrupt does, also where an exception would be lost: in imports and in the compiler.

numba compiles in callbacks and finalisers, which print an exception or swallow it, and an import cut short
ends in a traceback or in half a module. There a signal handler must not raise: it puts in order what is
open and ends the process.
"""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code."""

_LOSING = {"importlib", "_frozen_importlib", "_frozen_importlib_external", "llvmlite", "numba"}

_open: list[Callable[[], None]] = []


def would_be_lost(frame: FrameType | None) -> bool:
    """Whether an exception raised in a frame might not reach who called.

    Parameters
    ----------
    frame : frame, optional
        The one that a signal handler is given.
    """
    while frame is not None:
        if str(frame.f_globals.get("__name__")).split(".")[0] in _LOSING or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False


@contextmanager
def closed_at_the_end(close: Callable[[], None]) -> Iterator[None]:
    """Have something put in order if the process must end inside, without an exception.

    Parameters
    ----------
    close : callable
        Not called otherwise.
    """
    _open.append(close)
    try:
        yield
    finally:
        if close in _open:  # it is not where it was called
            _open.remove(close)


def put_in_order() -> None:
    """Close what is open, the newest first; each once."""
    while _open:
        _open.pop()()


def leave(*_: object) -> None:
    """Say in one line that this was interrupted, and end the process; can be a signal's handler."""
    os.write(2, b"error: interrupted\n")
    os._exit(INTERRUPTED)


def interrupt(_number: int, frame: FrameType | None) -> None:
    """Raise where that is safe, and only once; where it is not, put in order what is open and leave."""
    if not would_be_lost(frame):
        signal.signal(signal.SIGINT, _insist)
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        put_in_order()
    finally:
        leave()


def _insist(_number: int, _frame: FrameType | None) -> None:
    """The second time nobody wants to wait for what is being put in order."""
    os._exit(INTERRUPTED)
