"""``leg-wear-monitor play``: the play of a joint from a recording in which it was rocked."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.cli.options import clearances_option, json_option
from leg_wear_monitor.cli.output import STDOUT, check_file, write_json
from leg_wear_monitor.cli.waiting import compilation, progress_bar
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.monitor.config.tables import ANGLES, COUNTS, DATE, STAMPS

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.play.result import Clearances, Play

WITH_FINDINGS = 1


@click.command(short_help="Measure the play of a joint that was rocked.")
@click.argument(
    "recordings", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RECORDING..."
)
@click.option(
    "--joint", required=True, metavar="NAME", help="Joint in a bag, or column in a table, that has the angle."
)
@click.option(
    "--load",
    "loads",
    multiple=True,
    metavar="SIGNAL",
    help="Signal with the direction of the push, in any unit: effort, effort:JOINT, TOPIC, TOPIC:AXIS "
    "(torque of a wrench) or TOPIC:JOINT (position, such as a target) in a bag, a column in a table. Given "
    "several times, the signals add up, such as the positions of two motors that pull to one side each.  "
    "[default: none, the angle rests at two places]",
)
@click.option("--time", metavar="COLUMN", help="Column of the time in a table.  [default: that of --config]")
@click.option(
    "--time-unit", type=click.Choice([*STAMPS, DATE]), help="Its unit.  [default: that of --config]"
)
@click.option(
    "--unit",
    type=click.Choice([*ANGLES, COUNTS]),
    help="Unit of the angle in a table; counts are those of --counts-per-turn.  [default: that of --config]",
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
@click.option(
    "--mechanism",
    metavar="FILE",
    help="A mechanism, or the name of one that comes with the package: from which clearances the play comes.",
)
@click.option(
    "--encoder", metavar="JOINT", help="Joint of the mechanism that has the encoder.  [default: --joint]"
)
@click.option(
    "--crank-angle",
    "crank_angles",
    type=float,
    multiple=True,
    metavar="DEG",
    help="Crank angle of the mechanism in a recording; once for each, in their order.",
)
@clearances_option("A,B")
@json_option("the result")
def play(
    recordings: tuple[Path, ...],
    mechanism: str | None,
    encoder: str | None,
    crank_angles: tuple[float, ...],
    clearances: str | None,
    json_file: Path | None,
    **options: Any,
) -> int:
    """Measure the play of a joint from a recording in which it was rocked.

    Reads MCAP, .db3, CSV and Parquet files or bag directories, each with the leg in one posture. Hold the
    drive, push the leg to and fro ten times, and hold each push for a second. With a mechanism and several
    postures, the command tells which joints have the clearance. Exit code 1 if the result is doubtful, if
    joints are not told apart, or if a part of a recording is lost.
    """
    if json_file is not None and json_file != STDOUT:
        check_file("--json", json_file)
    if mechanism is None and (encoder or crank_angles or clearances):
        raise click.UsageError("--encoder, --crank-angle and --clearances need --mechanism")
    if mechanism is not None and len(crank_angles) != len(recordings):
        fault = f"{len(crank_angles)} given for {len(recordings)} recordings, expected one for each"
        raise ConfigError("--crank-angle", "", fault)
    leg = None if mechanism is None else _leg(mechanism, clearances)
    plays, is_lossy = _plays(recordings, crank_angles, **options)
    found = None if leg is None else _clearances(leg, encoder or options["joint"], plays)
    return _written(plays, found, leg, encoder or options["joint"], json_file) or int(is_lossy)


def _leg(mechanism: str, clearances: str | None) -> "Mechanism":
    import attrs

    from leg_wear_monitor.dynamics.arguments import given_joints
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(mechanism)
    if clearances is None:
        return leg
    names = [name.strip() for name in clearances.split(",")]
    return attrs.evolve(leg, clearance_joints=given_joints(names, leg))


def _plays(
    recordings: tuple[Path, ...],
    crank_angles: tuple[float, ...],
    joint: str,
    loads: tuple[str, ...],
    counts_per_turn: float | None,
    config: Path | None,
    **of_table: str | None,
) -> tuple[list["Play"], bool]:
    """The plays, and whether something of the recordings is lost."""
    import attrs

    from leg_wear_monitor.monitor.config.parameter_file import load_config

    settings = _settings(load_config(config), counts_per_turn, **of_table)
    counts_per_turn = counts_per_turn or settings.input.counts_per_turn
    plays, is_lossy = [], False
    for number, recording in enumerate(recordings):
        one, lossy = _play(recording, settings, joint, loads, counts_per_turn)
        angle = math.radians(crank_angles[number]) if crank_angles else None
        plays.append(attrs.evolve(one, recording=str(recording), crank_angle_rad=angle))
        is_lossy |= lossy
    return plays, is_lossy


def _settings(
    config: "MonitorConfig",
    counts_per_turn: float | None,
    time: str | None,
    time_unit: str | None,
    unit: str | None,
) -> "MonitorConfig":
    """The parameters with the options for a table in their place."""
    import attrs

    def given(**values: str | float | None) -> dict[str, Any]:
        return {key: value for key, value in values.items() if value is not None}

    table = config.input
    if unit == COUNTS and not (counts_per_turn or table.counts_per_turn):
        raise ConfigError("--counts-per-turn", "", "is missing, expected it with --unit counts")
    table = attrs.evolve(
        table,
        columns=attrs.evolve(table.columns, **given(stamp=time)),
        units=attrs.evolve(table.units, **given(stamp=time_unit, crank_angle=unit)),
        **given(counts_per_turn=counts_per_turn),
    )
    return attrs.evolve(config, input=table)


def _play(
    recording: Path,
    settings: "MonitorConfig",
    joint: str,
    loads: tuple[str, ...],
    counts_per_turn: float | None,
) -> tuple["Play", bool]:
    try:
        from leg_wear_monitor.bags.findings import Severity
        from leg_wear_monitor.play.measurement import measure_play
        from leg_wear_monitor.play.reading import read_rocked
    except ModuleNotFoundError as error:
        raise LegWearError(f"{error.name} is not installed; pip install 'leg_wear_monitor[bags]'") from error
    with compilation("play"), progress_bar("reading") as progress:
        read = read_rocked(recording, settings, joint, loads, progress)
    for finding in read.findings:
        click.echo(finding.line, err=True)
    count = 2.0 * math.pi / counts_per_turn if counts_per_turn else None
    result = measure_play(
        read.time_s, read.angle_rad, read.load, count_rad=count, joint=joint, load_name=" + ".join(loads)
    )
    return result, any(finding.severity is Severity.LOSS for finding in read.findings)


def _clearances(leg: "Mechanism", encoder: str, plays: list["Play"]) -> "Clearances":
    from leg_wear_monitor.play.clearances import clearances_of

    angles = [play.crank_angle_rad or 0.0 for play in plays]
    with compilation("mechanism"):
        return clearances_of(
            leg, encoder, angles, [play.play_rad for play in plays], [play.sigma_rad for play in plays]
        )


def _written(
    plays: list["Play"],
    found: "Clearances | None",
    leg: "Mechanism | None",
    encoder: str,
    json_file: Path | None,
) -> int:
    """Print and write the result; the exit code."""
    from leg_wear_monitor.cli.play_lines import lines
    from leg_wear_monitor.play.result import PlayMeasurement

    result = PlayMeasurement(plays=tuple(plays), clearances=found)
    if json_file != STDOUT:
        for line in lines(result, leg.name if leg else "", encoder):
            click.echo(line)
    for path in write_json(json_file, result.to_json()):
        click.echo(f"written: {path}")
    return 0 if result.is_sure else WITH_FINDINGS
