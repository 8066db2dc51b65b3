"""Interrupts at instants at which an exception would be lost: while modules are imported or kernels compiled.

numba compiles in callbacks and finalisers, which print an exception or swallow it, and an import cut short
ends in a traceback or in half a module. There a signal handler must not raise: it puts in order what is
open and ends the process.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

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
