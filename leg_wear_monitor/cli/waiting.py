"""What a user sees while something takes long, on stderr."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from leg_wear_monitor.interrupt import closed_at_the_end


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
def compilation(kernels: str, how_long: str = "about half a minute") -> Iterator[None]:
    """Show the time that passes while the work inside compiles a set of kernels for the first time.

    Only a terminal shows it: in a pipe, stderr is for what programs must see.
    """
    if is_compiled(kernels):
        yield
        return
    with _stopwatch(f"compiling numerical kernels (once per installation, {how_long})"):
        yield
    mark = _mark(kernels)
    if mark is not None:
        with suppress(FileNotFoundError):  # `cache --clear` meanwhile: then it is to be compiled again
            mark.touch()


@contextmanager
def _stopwatch(what: str) -> Iterator[None]:
    """Show on a terminal what takes long, and for how long it has done so."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn(what), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        bar.add_task(what, total=None)
        with closed_at_the_end(bar.stop):  # it hides the cursor
            yield


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the share done: it shows a bar on a terminal, and nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda _fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn(what), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        with closed_at_the_end(bar.stop):  # it hides the cursor
            yield lambda fraction: bar.update(task, completed=fraction)
