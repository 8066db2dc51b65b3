"""``leg-wear-monitor drives``: drives by name, with the sources of their figures."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.options import json_option
from leg_wear_monitor.cli.output import STDOUT, check_outputs, write_json
from leg_wear_monitor.cli.sourced_lines import sourced_lines
from leg_wear_monitor.json_text import json_text

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.drives.drive import Drive


@click.command(short_help="List drives by name, with the sources of their figures.")
@click.argument("name", required=False)
@json_option("the drives")
def drives(name: str | None, json_file: Path | None) -> None:
    """List the drives that the parameter drive.type can name, or print one of them with all its sources.

    NAME is a drive of the list, or a file such as ./my_drive.yaml.
    """
    from leg_wear_monitor.mechanism.drives import loader

    check_outputs(json_file, None)
    known = [loader.load_drive(each) for each in ([name] if name is not None else loader.drives())]
    document = {"schema_version": 1, "drives": [drive.to_dict() for drive in known]}
    written = write_json(json_file, json_text(document))
    if json_file != STDOUT:
        for drive in known:
            for line in _listed(drive) if name is None else _in_full(drive):
                click.echo(line)
        for path in written:
            click.echo(f"written: {path}")


def _listed(drive: "Drive") -> list[str]:
    """A drive in two lines: what it is, and what is known of it."""
    known = ", ".join(f"{key.replace('_', ' ')} {value.text}" for key, value in drive.values())
    return [drive.name, f"    {drive.title}: {known}"]


def _in_full(drive: "Drive") -> list[str]:
    """A drive with every number, its conditions and its source."""
    head = [f"{drive.name}: {drive.title}", f"torques and speeds are those of the {drive.shaft} shaft"]
    return [*head, *sourced_lines(drive.values()), *([f"note: {drive.notes}"] if drive.notes else [])]
