"""``leg-wear-monitor materials``: material pairs of joints, with their sources."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.options import json_option
from leg_wear_monitor.cli.output import STDOUT, check_outputs, write_json
from leg_wear_monitor.cli.sourced_lines import sourced_lines
from leg_wear_monitor.json_text import json_text

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.materials.material import Material


@click.command(short_help="List the material pairs of joints, with their sources.")
@click.argument("name", required=False)
@json_option("the pairs")
def materials(name: str | None, json_file: Path | None) -> None:
    """List the material pairs that a joint can name, or print one of them with all its sources.

    NAME is a pair of the list, or a file such as ./my_pair.yaml.
    """
    from leg_wear_monitor.mechanism.materials import loader

    check_outputs(json_file, None)
    names = [name] if name is not None else loader.materials()
    pairs = [loader.load_material(each) for each in names]
    document = {"schema_version": 1, "materials": [pair.to_dict() for pair in pairs]}
    written = write_json(json_file, json_text(document))
    if json_file != STDOUT:
        for pair in pairs:
            for line in _listed(pair) if name is None else _in_full(pair):
                click.echo(line)
        for path in written:
            click.echo(f"written: {path}")


def _listed(pair: "Material") -> list[str]:
    """A pair in two lines: what it is, and what is known of it."""
    known = pair.wear_coefficients
    wear = "no wear coefficient" if known is None else " and ".join(f"{k:.3g}" for k in known) + " 1/Pa"
    limits = (pair.limits.dynamic_pressure or pair.limits.static_pressure, pair.limits.pressure_speed)
    parts = [
        f"{label} up to {value.text}" for label, value in zip(("p", "p v"), limits, strict=True) if value
    ]
    return [pair.name, f"    {pair.title}: {', '.join([wear, *parts])}"]


def _in_full(pair: "Material") -> list[str]:
    """A pair with every number, its conditions and its source."""
    lines = [
        f"{pair.name}: {pair.title}",
        f"bushing: {pair.bushing.material}; journal: {pair.journal.material}; lubricant: {pair.lubricant}",
        f"regime: {pair.regime}",
        *sourced_lines(pair.values()),
    ]
    if pair.wear_coefficients is None:
        lines.append(
            "wear coefficient of the pair: not known; a life needs a wear_coefficient beside the material"
        )
    else:
        bushing, journal = pair.wear_coefficients
        lines.append(f"wear coefficient of the pair: {bushing:.3g} (bushing), {journal:.3g} (journal) 1/Pa")
    return [*lines, *([f"note: {pair.notes}"] if pair.notes else [])]
