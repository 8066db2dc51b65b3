"""``leg-wear-monitor report``: the page of a run again, from its data."""

import json
from pathlib import Path

import click

from leg_wear_monitor.cli.output import write_directory
from leg_wear_monitor.cli.replay import PAGE, SUMMARY, page_of
from leg_wear_monitor.errors import ConfigError


@click.command(short_help="The page of a run again, from its data.")
@click.argument("directory", type=click.Path(path_type=Path), metavar="DIR")
def report(directory: Path) -> int:
    """Draw the page of a study or a replay again from what lies in DIR; nothing is computed."""
    if (directory / SUMMARY).is_file():
        return _replay(directory)
    if not (directory / "study.json").is_file():
        raise ConfigError(
            str(directory),
            "",
            "holds no study.json, expected the --out of a study or of a replay",
        )
    from leg_wear_monitor.cli.study import write_study_page

    return write_study_page(directory)


def _replay(directory: Path) -> int:
    source = str(directory / SUMMARY)
    try:
        page = page_of(json.loads((directory / SUMMARY).read_text()))
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ConfigError(source, "", "is not what a replay of this version writes") from error
    for path in write_directory(directory, {PAGE: page}):
        click.echo(f"written: {path}")
    return 0
