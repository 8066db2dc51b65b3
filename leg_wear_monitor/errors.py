"""The root of all errors of this package, printable text, suggestions for unknown names, and interrupts."""

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

# Errors that this package raises on purpose, and text that a terminal can show.


_MOST_SHOWN = 2000  # characters


def printable(text: str, most: int = _MOST_SHOWN) -> str:
    r"""Text from a file as it may be shown: on one line, nothing in it that a terminal obeys, not too long.

    What cannot be printed stands as its escape (``\x1b``); so do line breaks, marks that turn the direction
    of writing, and bytes of a file name that are no UTF-8.

    Parameters
    ----------
    text : str
    most : int
        Characters that are kept.
    """
    shown = "".join(
        each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in text[:most]
    )
    return shown if len(text) <= most else f"{shown} and {len(text) - most} characters more"


class LegWearError(Exception):
    """An error that a user can correct; the command line prints it as one line and returns 2."""


class ConfigError(LegWearError):
    """A file or an option has an unusable value.

    Parameters
    ----------
    source : str
        File or command-line option the value came from.
    key : str
        Dotted path of the key, empty if the fault concerns the whole file.
    fault : str
        What was found and what was expected, with its unit.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> try:
    ...     lw.simulate("four_bar", clearance_m=-0.001)
    ... except lw.ConfigError as error:
    ...     print(error)
    clearance-m: -0.001 is not above 0 m (joint B)
    """

    def __init__(self, source: str, key: str, fault: str) -> None:
        self.source, self.key, self.fault = source, key, fault
        super().__init__(": ".join(part for part in (source, key, fault) if part))

    def __reduce__(self) -> tuple[type["ConfigError"], tuple[str, str, str]]:
        """By its parts, so that it survives the way from a worker process; the message alone does not."""
        return type(self), (self.source, self.key, self.fault)


class AssemblyError(LegWearError):
    """The linkage cannot be put together, or its crank cannot pass a dead point."""


class SimulationError(LegWearError):
    """A run that stopped; the message gives the place, the time and the remedy."""


class ConfigWarning(UserWarning):
    """Something that can be used but may not do what was meant; the command line prints it as one line."""


# Optional modules.


_EXTRAS = {"lz4": "bags", "mcap": "bags", "rosbags": "bags", "tornado": "dashboard", "zstandard": "bags"}
"""Modules that are optional, and the extra that installs each."""


@contextmanager
def extras_named() -> Iterator[None]:
    """Name the extra of an optional module that is not installed.

    Raises
    ------
    LegWearError
        In place of the ModuleNotFoundError; that of another module keeps its traceback.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        if module not in _EXTRAS:
            raise
        extra = _EXTRAS[module]
        raise LegWearError(f"{module} is not installed; pip install 'leg_wear_monitor[{extra}]'") from error


# Suggestions for unknown names.


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most similar to a given one, ignoring case; None if none is similar."""
    import difflib  # not at start: ^C is answered only after this file is read

    by_lower = {entry.lower(): entry for entry in known}
    near = difflib.get_close_matches(name.lower(), by_lower, n=1)
    return by_lower[near[0]] if near else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: ``; did you mean …?``, or an empty text."""
    near = nearest(name, known)
    return f"; did you mean {near}?" if near else ""


# What an interrupt does, also where an exception would be lost: in imports and in the compiler.
#
# numba compiles in callbacks and finalisers, which print an exception or swallow it, and an import cut short
# ends in a traceback or in half a module. There a signal handler must not raise: it puts in order what is
# open and ends the process.


INTERRUPTED = 130
"""Exit code."""

# packages in whose frames an exception may be swallowed
_LOSING = {"importlib", "_frozen_importlib", "_frozen_importlib_external", "llvmlite", "numba"}

_open: list[Callable[[], None]] = []
"""What closes the things that are open now, the newest last; see `closed_at_the_end`."""


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
        if close in _open:  # not if `put_in_order` has called it
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
    """Handler of the first Ctrl-C: KeyboardInterrupt where that is safe; else close all and leave."""
    if not would_be_lost(frame):
        signal.signal(signal.SIGINT, _insist)
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        put_in_order()
    finally:
        leave()


def _insist(_number: int, _frame: FrameType | None) -> None:
    """Handler of the second Ctrl-C: the process ends at once, whatever is still being closed."""
    os._exit(INTERRUPTED)
