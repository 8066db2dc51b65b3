"""What verbs share: options, numbers within bounds, nodes as verbs, files, lines, progress, warnings."""

import math
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.errors import (
    ConfigError,
    ConfigWarning,
    LegWearError,
    closed_on_interrupt,
    system_asked,
)
from leg_wear_monitor.files import write_whole

if TYPE_CHECKING:
    from rich.progress import Progress

    from leg_wear_monitor.configuration import Doubt
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.playback.result import ReplaySummary


WITH_FINDINGS = 1
"""Exit code of a verb that is done, with findings that the caller must see."""


class Number(click.types.FloatParamType):
    """Type of a finite number within bounds; for files see `leg_wear_monitor.configuration`.

    Parameters
    ----------
    unit : str
        ``""`` for a pure number.
    above, at_least : float, optional
        Bounds.
    """

    def __init__(self, unit: str = "", *, above: float | None = None, at_least: float | None = None) -> None:
        self._unit, self._above, self._at_least = unit, above, at_least

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Give the number, or fail with what is expected; of a decimal comma, with what is probably meant."""
        of_unit = f" of {self._unit}" if self._unit else ""
        try:
            number = float(value)
        except ValueError:
            expected = "one such as 0.5"
            with suppress(ValueError):
                meant = float(value.replace(",", "."))
                expected = f"a decimal point; did you mean {meant:.12g}?"
            self.fail(f"{value!r} is not a number{of_unit}, expected {expected}", param, ctx)
        if not math.isfinite(number):
            self.fail(f"{number:g} is not a finite number{of_unit}", param, ctx)
        if self._above is not None and not number > self._above:
            self.fail(f"{number:g} is not above {self._above:g} {self._unit}".rstrip(), param, ctx)
        if self._at_least is not None and not number >= self._at_least:
            self.fail(f"{number:g} is not at least {self._at_least:g} {self._unit}".rstrip(), param, ctx)
        return number


@contextmanager
def options_named() -> Iterator[None]:
    """Name an option as it is written on the command line, where the library names its parameter."""
    options = {name for option in click.get_current_context().command.params for name in option.opts}
    try:
        yield
    except ConfigError as error:
        option = f"--{error.source}".replace("_", "-")
        if option not in options:
            raise
        raise ConfigError(option, error.key, error.fault) from error


# Options that several verbs share.


Option = Callable[[Callable[..., Any]], Callable[..., Any]]


def option(name: str, metavar: str, text: str, *own: str, **of_click: Any) -> Option:
    """Option with a value, whose default is shown; ``own`` is the name of its parameter if it has another."""
    shown = "default" in of_click
    return click.option(name, *own, metavar=metavar, help=text, show_default=shown, **of_click)


def number_option(
    name: str,
    metavar: str,
    text: str,
    unit: str = "",
    *,
    above: float | None = None,
    at_least: float | None = None,
    default: float | None = None,
) -> Option:
    """Option with a finite number within bounds."""
    kind = Number(unit, above=above, at_least=at_least)
    given = {} if default is None else {"default": default}
    return option(name, metavar, text, type=kind, **given)


def path_option(name: str, metavar: str, text: str, *, required: bool = False, **of_path: bool) -> Option:
    """Option with a path, such as a file that has to exist."""
    kind = click.Path(path_type=Path, **of_path)
    return option(name, metavar, text, type=kind, required=required)


file_option = partial(path_option, dir_okay=False)

mechanism_option: Option = option(
    "--mechanism",
    "FILE",
    "A mechanism file, or the name of one that comes with the package.",
    default="bionic_leg",
)

speed_option: Option = number_option(
    "--speed-rpm", "RPM", "Crank speed, negative for clockwise.  [default: the mechanism's own]", "rpm"
)

limit_option: Option = number_option(
    "--limit-m", "M", "Mean radial clearance at which a joint's life ends.", "m", above=0.0, default=6.0e-4
)

config_option: Option = path_option(
    "--config", "FILE", "Parameter file of the node.  [default: the one that comes with the package]"
)

ledger_option: Option = file_option(
    "--ledger", "FILE", "Ledger to write into.  [default: the one in the parameters]", exists=True
)

node_option: Option = option(
    "--node",
    "NAME",
    "Full name of a running monitor to enter it into, such as /left/leg_wear_monitor; with --config, of the "
    "node whose parameters and ledger are used.",
)

section_option: Option = option(
    "--node",
    "NAME",
    "Full name of the node whose parameters are read, such as /left/leg_wear_monitor.  "
    "[default: the only one in the file]",
)

wait_option: Option = option(
    "--wait",
    "S",
    "With --node: longest wait for the monitor, and again for its answer.",
    "wait_s",
    type=click.FloatRange(min=0.0, min_open=True),
    default=10.0,
)

memory_option: Option = option(
    "--memory-mb",
    "MB",
    "Memory limit of reading, temporary files included.",
    type=click.FloatRange(min=16.0),
    default=512.0,
)

workers_option: Option = option(
    "--workers", "N", "Number of local processes.  [default: cores]", type=click.IntRange(min=1)
)

dry_run_option: Option = click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")

recordings_argument: Option = click.argument(
    "recordings", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RECORDING..."
)


def clearances_option(metavar: str) -> Option:
    """``--clearances``: names of the clearance joints, separated by commas."""
    text = "The clearance joints.  [default: the mechanism's own]"
    return option("--clearances", metavar, text)


def json_option(what: str) -> Option:
    """``--json FILE`` for an object, such as ``the result``; ``-`` is standard output."""
    return option(
        "--json",
        "FILE",
        f"Write {what} as JSON; - for stdout, without other output there.",
        "json_file",
        type=click.Path(allow_dash=True, path_type=Path),
    )


def scheduler_option(does: str) -> Option:
    """``--scheduler``: what the workers of a Dask cluster do in place of this machine."""
    text = f"Dask scheduler whose workers {does} instead, tcp://HOST:PORT."
    return option("--scheduler", "ADDRESS", text)


def out_option(text: str) -> Option:
    """``--out DIR``."""
    return path_option("--out", "DIR", text)


def with_clearance_joints(leg: "Mechanism", names: str | None) -> "Mechanism":
    """The leg with the clearance joints of ``--clearances``, comma-separated names; as it is without names.

    Raises
    ------
    ConfigError
        If a name is unknown or occurs twice.
    """
    if names is None:
        return leg
    import attrs

    from leg_wear_monitor.dynamics.simulation import given_joints

    with options_named():
        joints = given_joints([name.strip() for name in names.split(",")], leg)
    return attrs.evolve(leg, clearance_joints=joints)


# A node as a verb: its arguments are those of ROS, and without ROS there is one line.


def need_rclpy() -> None:
    """Raise LegWearError where ROS is not installed, or not found."""
    try:
        import_module("rclpy")
    except ImportError as error:
        raise LegWearError(
            f"rclpy: {error}; source a ROS 2 installation, or pip install 'leg_wear_monitor[ros]'"
        ) from error


def check_alone(**others: object) -> None:
    """Refuse options beside ``--node``: a running monitor has its own parameters and ledger."""
    if any(others.values()):
        names = ", ".join(f"--{name.replace('_', '-')}" for name in others)
        raise click.UsageError(f"--node cannot be combined with {names}")


def joints_words(names: Sequence[str]) -> str:
    """The clearance joints of a leg."""
    return f"clearance joints {', '.join(names)}" if names else "no clearance joint"


def trigger(node: str, service: str, wait_s: float, times: int = 1) -> str:
    """Reply of a service of a running monitor, which is called at most so many times, until it succeeds.

    Raises
    ------
    LegWearError
        Without ROS, if nobody answers, or if the last call is refused.
    """
    need_rclpy()
    from leg_wear_monitor.ros.measure import trigger_on

    return trigger_on(node, service, wait_s, times)


def node_verb(name: str, module: str, summary: str, text: str) -> click.Command:
    """Command that runs a node."""

    @click.command(
        name=name,
        short_help=summary,
        help=text,
        context_settings={"ignore_unknown_options": True},
        options_metavar="[--ros-args ...]",
    )
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="")
    def verb(arguments: tuple[str, ...]) -> int:
        need_rclpy()
        main: Callable[[Sequence[str]], int] = import_module(f"leg_wear_monitor.ros.{module}").main
        return main([name, *arguments])

    return verb


# Files written whole or not at all, to places that are known to take them before the work begins.


SUMMARY, PAGE = "summary.json", "report.html"

STDOUT = Path("-")

_MOST_LINES = 20  # of findings on stderr


def check_file(option: str, path: Path | None) -> None:
    """Make sure that a file can be written, if one is asked for.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if path is None or path == STDOUT:
        return
    if path.is_dir():
        raise ConfigError(option, str(path), "is a directory, expected a file to write")
    if _is_stream(path):
        return
    if not path.parent.is_dir():
        raise ConfigError(option, str(path), f"there is no directory {path.parent}")
    _try(option, path, path.resolve().parent)


def check_directory(option: str, path: Path) -> None:
    """Make sure that a directory can be written to, or made.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if path.exists() and not path.is_dir():
        raise ConfigError(option, str(path), "is a file, expected a directory to write to")
    above = path.resolve()
    while not above.exists():
        above = above.parent
    if not above.is_dir():
        raise ConfigError(option, str(path), f"{above} is a file, expected a directory")
    _try(option, path, above)


def check_outputs(json_file: Path | None, out: Path | None) -> None:
    """Make sure that the places of ``--json`` and ``--out`` can be written, as far as they are asked for.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    check_file("--json", json_file)
    if out is not None:
        check_directory("--out", out)


def write_json(path: Path | None, text: str) -> list[Path]:
    """Write JSON to the place of ``--json``, and give the files written: none for stdout."""
    if path is None:
        return []
    if path == STDOUT:
        click.echo(text, nl=False)
        return []
    write_file(path, text.encode())
    return [path]


def say(json_file: Path | None, lines: Iterable[str], written: Iterable[Path]) -> None:
    """Print a result and what was written, unless ``--json`` has stdout for itself."""
    if json_file != STDOUT:
        for line in (*lines, *(f"written: {path}" for path in written)):
            click.echo(line)


def print_findings(lines: Sequence[str], rest: str = "") -> None:
    """Print the first lines on stderr, and how many more there are; ``rest`` says where."""
    for line in lines[:_MOST_LINES]:
        click.echo(line, err=True)
    if len(lines) > _MOST_LINES:
        click.echo(f"warning: {len(lines) - _MOST_LINES} more findings{rest}", err=True)


def write_file(path: Path, content: bytes) -> None:
    """Write a file such that no one ever sees a part of it; a device or a pipe just gets the bytes.

    Raises
    ------
    ConfigError
        When the disk does not take it.
    """
    if _is_stream(path):
        path.write_bytes(content)
        return
    write_whole(path, content)


def write_directory(path: Path, files: Mapping[str, bytes | None]) -> list[Path]:
    """Write files into a directory, each whole; None removes what an earlier run left.

    Returns
    -------
    list of pathlib.Path
        The files written, in the order given.
    """
    for name, content in files.items():
        if content is None:
            (path / name).unlink(missing_ok=True)
        else:
            write_file(path / name, content)
    return [path / name for name, content in files.items() if content is not None]


def _is_stream(path: Path) -> bool:
    """A device or a pipe, which must not be replaced by a file."""
    return path.exists() and not path.is_file()


def _try(option: str, path: Path, directory: Path) -> None:
    """Only writing shows it: rights, a read-only file system, an administrator whom rights do not stop."""
    with system_asked(option, "cannot be written", path), tempfile.TemporaryFile(dir=directory):
        return


def page_of(summary: "ReplaySummary") -> bytes:
    """The page of a replay."""
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    return page_html(replay_page(summary)).encode()


# Values that are likely meant in another unit, as warnings: one line each on stderr.


def warn_of(source: str, found: Iterable["Doubt"]) -> None:
    """Warn of what was found in a file."""
    for doubt in found:
        warnings.warn(f"{source}: {doubt}", ConfigWarning, stacklevel=2)


# What a user sees while something takes long, on stderr.


def _mark(kernels: str) -> Path | None:
    from leg_wear_monitor.compiled.kernel import cache_directory

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
    with _shown(what) if sys.stderr.isatty() else _compilation_announced(what):
        yield
    mark_compiled(kernels)


def mark_compiled(kernels: Iterable[str]) -> None:
    """Note that sets of kernels were compiled to their end."""
    for mark in map(_mark, kernels):
        if mark is not None:
            with suppress(FileNotFoundError):  # `cache --clear` meanwhile: then it is to be compiled again
                mark.touch()


@contextmanager
def _compilation_announced(what: str) -> Iterator[None]:
    from leg_wear_monitor.compiled.kernel import at_compilation

    printed: list[str] = []

    def announce() -> None:
        if not printed:
            printed.append(what)
            print(what, file=sys.stderr, flush=True)

    at_compilation.append(announce)
    try:
        yield
    finally:
        at_compilation.remove(announce)


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
            with closed_on_interrupt(bar.stop):  # it hides the cursor
                yield bar
        finally:
            _display.clear()
