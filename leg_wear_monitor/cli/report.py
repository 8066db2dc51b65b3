"""``leg-wear-monitor report``: the page of a run again, from its data."""

from pathlib import Path

import click

from leg_wear_monitor.errors import ConfigError


@click.command(short_help="The page of a run again, from its data.")
@click.argument("directory", type=click.Path(path_type=Path), metavar="DIR")
def report(directory: Path) -> int:
    """Draw the page of a study again from what lies in DIR; nothing is computed."""
    if not (directory / "study.json").is_file():
        raise ConfigError(str(directory), "", "holds no study.json, expected the --out of a study")
    from leg_wear_monitor.cli.study import write_study_page

    return write_study_page(directory)
