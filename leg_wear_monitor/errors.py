"""Errors of this package, printable text, suggestions for unknown names, and the handling of interrupts.

`cli.start` imports this module before all others, so that Ctrl-C is answered at once: it imports little.
"""

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

# Errors that this package raises on purpose, and text that a terminal can show.


_MOST_SHOWN = 2000  # characters, as many as a terminal of 25 lines of 80


def one_line(error: BaseException) -> str:
    """Text of an error on one line, at most 200 characters; its type if it has no text."""
    return " ".join(str(error).split())[:200] or type(error).__name__


def printable(text: str, most: int = _MOST_SHOWN) -> str:
    r"""Text from a file on one line, without control sequences for the terminal, and not too long.

    Characters that cannot be printed are replaced by their escapes (``\x1b``): control characters, line
    breaks, marks that reverse the direction of writing, and bytes of a file name that are not UTF-8.

    Parameters
    ----------
    text : str
    most : int
        Number of its characters that are shown; the result says how many more there are.
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
        File or command-line option of the value.
    key : str
        Dotted path of the key, empty if the fault concerns the whole file.
    fault : str
        Found and expected value, with the unit.

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
        """Pickle the three parts: with the message alone, it could not come back from a worker process."""
        return type(self), (self.source, self.key, self.fault)


class AssemblyError(LegWearError):
    """The linkage cannot be assembled, or has a dead point, beyond which its crank cannot turn."""


class SimulationError(LegWearError):
    """A simulation that stopped; the message gives mechanism, joint, time and remedy as far as known."""


class ConfigWarning(UserWarning):
    """A usable setting that is probably a mistake; the command line prints it as one line."""


@contextmanager
def system_asked(
    source: object, fault: str, key: object = "", error_of: type[ConfigError] = ConfigError
) -> Iterator[None]:
    """Within this context, a refusal of the system becomes an error of a file or an option.

    Parameters
    ----------
    source, key : object
        Same meaning as in ConfigError.
    fault : str
        Such as ``cannot be read``; the reason of the system follows.
    error_of : type of ConfigError
    """
    try:
        yield
    except OSError as error:
        raise error_of(str(source), str(key), f"{fault}: {error.strerror or error}") from error


# Optional modules.


_EXTRAS = dict.fromkeys(("lz4", "mcap", "pyarrow", "rosbags", "zstandard"), "bags") | {"tornado": "dashboard"}
"""Optional modules, and the extra of this package that installs each."""


@contextmanager
def extras_hinted() -> Iterator[None]:
    """Within this context, the error for an optional module that is not installed says how to install it.

    Raises
    ------
    LegWearError
        Replaces the ModuleNotFoundError of an optional module. Errors of other modules pass unchanged.
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
    import difflib  # imported here, because an import at the top would delay the first reaction to Ctrl-C

    by_lower = {entry.lower(): entry for entry in known}
    near = difflib.get_close_matches(name.lower(), by_lower, n=1)
    return by_lower[near[0]] if near else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: ``; did you mean …?``, or an empty text."""
    near = nearest(name, known)
    return f"; did you mean {near}?" if near else ""


# Effect of an interrupt, also if an exception would be lost: in imports and in the compiler.
#
# A signal handler usually raises KeyboardInterrupt. But numba compiles in callbacks and finalisers, which
# print or swallow an exception, and an interrupted import ends in a traceback or leaves half a module. There
# the handler must not raise: it closes all open things (ledger, child processes, progress bar) and ends the
# process.


INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 and the number of SIGINT, as shells have it."""

# Packages with functions that may swallow an exception.
_SWALLOWING = {"importlib", "_frozen_importlib", "_frozen_importlib_external", "llvmlite", "numba"}

_closers: list[Callable[[], None]] = []
"""Functions that close the things open now, the newest last; see `closed_on_interrupt`."""


def exception_may_be_swallowed(frame: FrameType | None) -> bool:
    """True if an exception that is raised in a frame may be swallowed by one of its callers.

    Parameters
    ----------
    frame : frame, optional
        The interrupted frame, as a signal handler is given it.
    """
    while frame is not None:
        package = str(frame.f_globals.get("__name__")).split(".")[0]
        if package in _SWALLOWING or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False


@contextmanager
def closed_on_interrupt(close: Callable[[], None]) -> Iterator[None]:
    """Have something closed if an interrupt ends the process within this context.

    A caller that leaves the context normally, or by an exception, must close it itself.

    Parameters
    ----------
    close : callable
        Called by `close_open`, and by nothing else here.
    """
    _closers.append(close)
    try:
        yield
    finally:
        if close in _closers:  # unless `close_open` has called it
            _closers.remove(close)


def close_open() -> None:
    """Close all that was given to `closed_on_interrupt`, the newest first, each once."""
    while _closers:
        _closers.pop()()


def leave(*_: object) -> None:
    """Print one line, and end the process without its clean-up; usable as a signal handler."""
    os.write(2, b"error: interrupted\n")
    os._exit(INTERRUPTED)


def interrupt(_number: int, frame: FrameType | None) -> None:
    """Handler of the first Ctrl-C: raise KeyboardInterrupt, or clean up and exit where it may be lost."""
    if not exception_may_be_swallowed(frame):
        signal.signal(signal.SIGINT, _end_at_once)
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        close_open()
    finally:
        leave()


def _end_at_once(_number: int, _frame: FrameType | None) -> None:
    """Handler of the second Ctrl-C: end the process, even if something is still being closed."""
    os._exit(INTERRUPTED)
