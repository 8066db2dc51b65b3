"""``leg-wear-monitor play``: the play of a joint from a recording in which it was rocked."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.cli.options import json_option
from leg_wear_monitor.cli.output import STDOUT, check_file, write_json
from leg_wear_monitor.cli.waiting import compilation, progress_bar
from leg_wear_monitor.errors import LegWearError, printable

if TYPE_CHECKING:
    from leg_wear_monitor.play.result import Play

WITH_FINDINGS = 1


@click.command(short_help="Measure the play of a joint that was rocked.")
@click.argument("recording", type=click.Path(path_type=Path))
@click.option(
    "--joint", required=True, metavar="NAME", help="Joint in a bag, or column in a table, that has the angle."
)
@click.option(
    "--load",
    metavar="SIGNAL",
    help="Signal with the direction of the push, in any unit: effort, effort:JOINT, TOPIC, TOPIC:AXIS "
    "(torque of a wrench) or TOPIC:JOINT (position, such as a target) in a bag, a column in a table.  "
    "[default: none, the angle rests at two places]",
)
@click.option(
    "--counts-per-turn",
    type=float,
    callback=bounded("", above=0.0),
    metavar="N",
    help="Counts of the encoder per turn of the joint.  [default: found from the values]",
)
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Parameter file with the column of the time and the units of a table.  "
    "[default: the one that comes with the package]",
)
@json_option("the result")
def play(json_file: Path | None, **options: Any) -> int:
    """Measure the play of a joint from a RECORDING in which it was rocked.

    Reads an MCAP, .db3, CSV or Parquet file or a bag directory. Hold the drive, push the leg to and fro ten
    times, and hold each push for a second. Exit code 1 if the result is doubtful, or if a part of the
    recording is lost.
    """
    if json_file is not None and json_file != STDOUT:
        check_file("--json", json_file)
    result, is_lossy = _run(**options)
    if json_file != STDOUT:
        _print(result)
    for path in write_json(json_file, result.to_json()):
        click.echo(f"written: {path}")
    return WITH_FINDINGS if result.findings or is_lossy else 0


def _run(
    recording: Path, joint: str, load: str | None, counts_per_turn: float | None, config: Path | None
) -> tuple["Play", bool]:
    """The play, and whether something of the recording is lost."""
    try:
        from leg_wear_monitor.bags.findings import Severity
        from leg_wear_monitor.monitor.config.parameter_file import load_config
        from leg_wear_monitor.play.measurement import measure_play
        from leg_wear_monitor.play.reading import read_rocked
    except ModuleNotFoundError as error:
        raise LegWearError(f"{error.name} is not installed; pip install 'leg_wear_monitor[bags]'") from error
    with compilation("play"), progress_bar("reading") as progress:
        read = read_rocked(recording, load_config(config), joint, load, progress)
    for finding in read.findings:
        click.echo(f"warning: {finding}", err=True)
    result = measure_play(
        read.time_s,
        read.angle_rad,
        read.load,
        count_rad=2.0 * math.pi / counts_per_turn if counts_per_turn else None,
        joint=joint,
        load_name=load or "",
    )
    return result, any(finding.severity is Severity.LOSS for finding in read.findings)


def _print(result: "Play") -> None:
    up, down = result.plateaus
    name, sigma = printable(result.joint), _angle(result.sigma_rad)
    click.echo(f"{name}: play {_angle(result.play_rad)}, standard deviation {sigma}")
    click.echo(f"  side by {printable(result.load) or 'the angle itself'}; {up} and {down} pushes count")
    click.echo(f"  count of the encoder {_angle(result.count_rad)}, {_turn(result.count_rad)} per turn")
    click.echo(f"  noise {_angle(result.noise_rad)}, scatter of the repeats {_angle(result.scatter_rad)}")
    for label, texts in (("doubtful", result.findings), ("note", result.notes)):
        for text in texts:
            click.echo(f"{label}: {printable(text)}")


def _angle(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g} mrad ({math.degrees(value_rad):.3g} deg)"


def _turn(count_rad: float) -> str:
    return f"{2.0 * math.pi / count_rad:.5g}"
