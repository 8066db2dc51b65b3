"""Shared parts of the verbs: options, nodes, written files, progress and warnings."""

import math
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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
    from leg_wear_monitor.configuration import Doubt
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.recordings.result import ReplaySummary


WITH_FINDINGS = 1
"""Exit code of a verb that is done, with findings that the caller must see."""


class Number(click.FloatRange):
    """A finite number within bounds; `click` itself accepts nan and inf."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Give the number, or fail and name the bounds."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


POSITIVE = Number(min=0.0, min_open=True)


@contextmanager
def options_named() -> Iterator[None]:
    """Replace the parameter name of the library in an error by the option on the command line."""
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
    """Option with a value and its default; ``own`` is the name of its parameter if it differs."""
    return click.option(name, *own, metavar=metavar, help=text, show_default=True, **of_click)


positive = partial(option, type=POSITIVE)
count = partial(option, type=click.IntRange(min=1))


def flag(name: str, text: str) -> Option:
    """Option without a value."""
    return click.option(name, is_flag=True, help=text)


def choice(name: str, names: Sequence[str], text: str, **of_click: Any) -> Option:
    """Option with one of several names."""
    return click.option(name, type=click.Choice(names), help=text, show_default=True, **of_click)


def path_option(name: str, metavar: str, text: str, *, required: bool = False, **of_path: bool) -> Option:
    """Option with a path, for example to an existing file."""
    return option(name, metavar, text, type=click.Path(path_type=Path, **of_path), required=required)


file_option = partial(path_option, dir_okay=False)
out_option = partial(path_option, "--out", "DIR")

mechanism_option: Option = option(
    "--mechanism", "FILE", "A mechanism file, or the name of one of the package.", default="bionic_leg"
)
clearances_option: Option = option(
    "--clearances", "A,B", "Clearance joints, such as A,B; or none.  [default: as in the mechanism file]"
)
speed_option: Option = option(
    "--speed-rpm",
    "RPM",
    "Crank speed [rpm], negative for clockwise.  [default: as in the mechanism file]",
    type=float,
)
limit_option: Option = positive(
    "--limit-m", "M", "Mean radial clearance [m] at which a joint's life ends.", default=6.0e-4
)
config_option: Option = path_option(
    "--config", "FILE", "Parameter file of the node.  [default: config/monitor.yaml of the package]"
)
section_option: Option = option(
    "--node",
    "NAME",
    "Full name of the node whose parameters are read, such as /left/leg_wear_monitor.  "
    "[default: the only one in the file]",
)
workers_option: Option = count("--workers", "N", "Number of local processes.  [default: cores]")
scheduler_option: Option = option(
    "--scheduler", "ADDRESS", "Dask scheduler, tcp://HOST:PORT; its workers compute instead of this machine."
)
recordings_argument: Option = click.argument(
    "recordings", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RECORDING..."
)


def json_option(what: str) -> Option:
    """``--json FILE`` for an object, such as ``the result``; ``-`` is standard output."""
    text = f"Write {what} as JSON; - writes only JSON, to stdout."
    return option("--json", "FILE", text, "json_file", type=click.Path(allow_dash=True, path_type=Path))


def with_clearance_joints(leg: "Mechanism", names: str | None) -> "Mechanism":
    """The leg with the clearance joints of ``--clearances``, comma-separated; unchanged without names.

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


# Nodes: as verbs with ROS arguments, and as receivers of the operator's entries.


def need_rclpy() -> None:
    """Raise LegWearError where ROS is not installed, or not found."""
    try:
        import_module("rclpy")
    except ImportError as error:
        raise LegWearError(
            f"rclpy: {error}; source a ROS 2 installation, or pip install 'leg_wear_monitor[ros]'"
        ) from error


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

_MOST_LINES = 20  # lines of findings on stderr


def check_file(option: str, path: Path | None) -> None:
    """Check that a requested file can be written.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if path is None or path == STDOUT:
        return
    if path.is_dir():
        raise ConfigError(option, str(path), "is a directory. Expected a file to write")
    if not _is_stream(path):
        _try(option, path, path.resolve().parent)


def check_directory(option: str, path: Path) -> None:
    """Make sure that a directory can be written to, or made.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    above = path.resolve()
    while not above.exists():
        above = above.parent
    _try(option, path, above)


def check_outputs(json_file: Path | None, out: Path | None) -> None:
    """Check that the requested files of ``--json`` and ``--out`` can be written.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    check_file("--json", json_file)
    if out is not None:
        check_directory("--out", out)


def _try(option: str, path: Path, directory: Path) -> None:
    """Test by writing, because rights alone do not decide: read-only file systems, administrators."""
    with system_asked(option, "cannot be written", path), tempfile.TemporaryFile(dir=directory):
        return


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
    """Print a result and the written files, unless ``--json`` reserves stdout."""
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
    """Write a whole file at once; a device or a pipe gets the bytes directly.

    Raises
    ------
    ConfigError
        If the disk cannot store it.
    """
    if _is_stream(path):
        path.write_bytes(content)
        return
    write_whole(path, content)


def write_directory(path: Path, files: Mapping[str, bytes | None]) -> list[Path]:
    """Write files into a directory, each atomically; None removes the file of an earlier run.

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


def page_of(summary: "ReplaySummary") -> bytes:
    """The page of a replay."""
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    return page_html(replay_page(summary)).encode()


# Warnings of values that are likely meant in a different unit, and messages during long operations, all on
# stderr.


def warn_of(source: str, found: Iterable["Doubt"]) -> None:
    """Warn of problems in a file."""
    for doubt in found:
        warnings.warn(f"{source}: {doubt}", ConfigWarning, stacklevel=2)


@contextmanager
def compilation() -> Iterator[None]:
    """Report once that the work inside compiles, because only then does it take long.

    The line appears when the first function is compiled, so bad input also gives only one line.
    """
    from leg_wear_monitor.compiled.kernel import at_compilation

    announced = list[bool]()

    def announce() -> None:
        if not announced:
            announced.append(True)
            click.echo("compiling numerical kernels, once per installation, up to a minute", err=True)

    at_compilation.append(announce)
    try:
        yield
    finally:
        at_compilation.remove(announce)


def compile_monitor(config: "MonitorConfig") -> None:
    """Compile the monitor's kernels once, before several processes need them at the same time."""
    from leg_wear_monitor.dynamics.clearance.stepper import advance_beside
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor

    with compilation(), advance_beside():
        WearMonitor(load_mechanism(config.mechanism), config).warm_up()


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the fraction done: it shows a bar on a terminal, and nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda _fraction: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        with closed_on_interrupt(bar.stop):  # the bar hides the cursor
            yield lambda fraction: bar.update(task, completed=fraction)
