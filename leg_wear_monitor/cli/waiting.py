"""What a user sees while something takes long, on stderr."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from leg_wear_monitor.interrupt import closed_at_the_end

if TYPE_CHECKING:
    from rich.progress import Progress


def _mark(kernels: str) -> Path | None:
    from leg_wear_monitor.kernel import cache_directory

    place = cache_directory()
    return None if place is None else place / f"{kernels}.compiled"


def is_compiled(kernels: str) -> bool:
    """Whether a set of kernels has once been compiled to its end, for exactly these sources."""
    import numba

    mark = _mark(kernels)
    return bool(numba.config.DISABLE_JIT) or (mark is not None and mark.exists())


@contextmanager
def compilation(*kernels: str, how_long: str = "about half a minute") -> Iterator[None]:
    """Show the time that passes while the work inside compiles sets of kernels for the first time.

    In a pipe it is one line when the first of them is compiled: what fails before it is one line, too.
    """
    if all(is_compiled(one) for one in kernels):
        yield
        return
    what = f"compiling numerical kernels (once per installation, {how_long})"
    with _shown(what) if sys.stderr.isatty() else _said_by_the_compiler(what):
        yield
    for mark in map(_mark, kernels):
        if mark is not None:
            with suppress(FileNotFoundError):  # `cache --clear` meanwhile: then it is to be compiled again
                mark.touch()


@contextmanager
def _said_by_the_compiler(what: str) -> Iterator[None]:
    from leg_wear_monitor.kernel import at_compilation

    said: list[str] = []

    def say() -> None:
        if not said:
            said.append(what)
            print(what, file=sys.stderr, flush=True)

    at_compilation.append(say)
    try:
        yield
    finally:
        at_compilation.remove(say)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the fraction done: it shows a bar on a terminal, and nothing in a pipe."""
    with _shown(what, total=1.0) as show:
        yield show


# what shows progress on the terminal; rich shows one at a time, so what begins inside is a line of its own
_display: list["Progress"] = []


@contextmanager
def _shown(what: str, total: float | None = None) -> Iterator[Callable[[float], None]]:
    """Show a line on a terminal, with the time passed and, where there is a total, how much is done."""
    if not sys.stderr.isatty():
        yield lambda _fraction: None
        return
    with _progress() as bar:
        task = bar.add_task(what, total=total)
        try:
            yield lambda fraction: bar.update(task, completed=fraction)
        finally:
            bar.remove_task(task)


@contextmanager
def _progress() -> Iterator["Progress"]:
    if _display:
        yield _display[0]
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    words = TextColumn("{task.description}")
    columns = SpinnerColumn(), words, BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        _display.append(bar)
        try:
            with closed_at_the_end(bar.stop):  # it hides the cursor
                yield bar
        finally:
            _display.clear()
