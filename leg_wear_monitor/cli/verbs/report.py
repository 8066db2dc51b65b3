"""``leg-wear-monitor report``: the page of a run again, from its data."""

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from leg_wear_monitor.cli.output import PAGE, SUMMARY, page_of, write_directory
from leg_wear_monitor.errors import ConfigError

_MISMADE = (
    ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, RuntimeWarning,
    TypeError, ValueError,
)  # fmt: skip


@click.command(short_help="Write the HTML page of a run again, from its data.")
@click.argument("directory", type=click.Path(path_type=Path), metavar="DIR")
def report(directory: Path) -> int:
    """Draw the page of a study or a replay again from the data in DIR; nothing is computed."""
    if (directory / SUMMARY).is_file():
        return _replay(directory)
    if not (directory / "study.json").is_file():
        raise ConfigError(
            str(directory),
            "",
            "contains no study.json, expected the --out of a study or of a replay",
        )
    from leg_wear_monitor.cli.verbs.study import write_study_page

    with _as_one_line(directory / "study.json", "study"):
        return write_study_page(directory)


def _replay(directory: Path) -> int:
    from leg_wear_monitor.playback.result.replay_summary import summary_of

    source = directory / SUMMARY
    with _as_one_line(source, "replay"):
        record = json.loads(source.read_text(encoding="utf-8"), parse_constant=_refuse)
        page = page_of(summary_of(record, str(source)))
    for path in write_directory(directory, {PAGE: page}):
        click.echo(f"written: {path}")
    return 0


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


@contextmanager
def _as_one_line(source: Path, what: str) -> Iterator[None]:
    """Data that a page cannot be made of is the file's fault: the run itself made one of what it wrote."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # numpy would print it and go on
            yield
    except _MISMADE as error:
        fault = f"is not what a {what} of this version writes ({type(error).__name__}: {error})"
        raise ConfigError(str(source), "", fault) from error
