"""The command line: verbs that are imported when they are called, errors that are one line each."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, TextIO

import click

from leg_wear_monitor.errors import (
    INTERRUPTED,
    ConfigWarning,
    LegWearError,
    did_you_mean,
    extras_hinted,
    printable,
)
from leg_wear_monitor.files import package_version

COULD_NOT = 2

_VERBS = {
    "acknowledge": "upkeep", "cache": "check", "check": "check", "commission": "commission",
    "dashboard": "nodes", "demo": "nodes", "design": "life", "draw": "study", "drives": "check",
    "fleet": "fleet", "gait-publisher": "nodes", "life": "life", "materials": "check", "measure": "upkeep",
    "monitor": "nodes", "reference": "commission", "replay": "replay",
    "report": "replay", "reset": "upkeep", "simulate": "study", "study": "study",
}  # fmt: skip
"""Verbs, and the file in `verbs` of each."""


class Verbs(click.Group):
    """A group: its verbs are imported when they are called, their faults end in one line and an exit code."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the verbs."""
        return list(_VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a verb's module and give its command."""
        file = _VERBS.get(cmd_name.replace("_", "-"))
        if file is None:
            fault = f"{cmd_name!r} is not a command. Expected one of {', '.join(_VERBS)}"
            raise click.UsageError(fault + did_you_mean(cmd_name, _VERBS), ctx)
        name = cmd_name.replace("-", "_")
        verb: click.Command = getattr(import_module(f"leg_wear_monitor.cli.verbs.{file}"), name)
        return verb

    def invoke(self, ctx: click.Context) -> Any:
        """Call a verb; ^C ends it without the empty line that click would print, even into a pipe."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            raise click.Abort from error

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run and end the process; programming errors keep their traceback."""
        code: Any = COULD_NOT
        try:
            with _warnings_as_lines(), extras_hinted():
                code = super().main(*args, **{**extra, "standalone_mode": False})
        except click.UsageError as error:
            path = error.ctx.command_path if error.ctx else self.name
            _print_error(f"{error.format_message()} (see {path} --help)")
        except click.ClickException as error:
            _print_error(error.format_message())
        except LegWearError as error:
            _print_error(str(error))
        except click.Abort:
            if sys.stderr.isatty():
                click.echo(err=True)  # below the terminal's own ^C
            _print_error("interrupted")
            code = INTERRUPTED
        sys.exit(code)


def _print_error(text: str) -> None:
    click.echo(f"error: {printable(' '.join(text.split()), most=10_000)}", err=True)


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    """Print a ConfigWarning as one line, and other warnings in Python's format."""
    usual = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if issubclass(category, ConfigWarning):
            click.echo(f"warning: {message}", err=True)
        else:
            usual(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.simplefilter("default", ConfigWarning)
        warnings.showwarning = show
        yield


def _print_version(ctx: click.Context, _param: click.Parameter, wanted: bool) -> None:
    if wanted:
        click.echo(f"leg-wear-monitor {package_version()}")
        ctx.exit()


@click.group(
    name="leg-wear-monitor",
    cls=Verbs,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_print_version,
    help="Show the version and exit.",
)
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Monitor, simulate and forecast the joint wear of a crank-driven leg."""
    if ctx.invoked_subcommand is None:
        raise click.UsageError(f"no command. Expected one of {', '.join(_VERBS)}", ctx)


def main(node: str | None = None) -> None:
    """Run the command line, or the verb of a node as the program that ``ros2 run`` starts."""
    if node is None:
        cli()
    else:
        cli([node, *sys.argv[1:]], prog_name="ros2 run leg_wear_monitor")
