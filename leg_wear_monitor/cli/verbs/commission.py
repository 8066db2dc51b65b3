"""Verbs that learn from a recording: ``commission``, ``play``, ``reference``."""

import math
import time
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.tables import ANGLES, COUNTS, DATE, STAMPS

if TYPE_CHECKING:
    from leg_wear_monitor.commissioning.result import CommissioningResult
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.play.fit import Play, PlayMeasurement
    from leg_wear_monitor.twin.torque_reference import TorqueReference


# ``leg-wear-monitor commission``: proposes the parameters of a robot from a recording of its healthy leg.


@click.command(short_help="Propose a robot's parameters from a recording.")
@common.recordings_argument
@common.path_option(
    "--config",
    "FILE",
    "Parameter file that names the mechanism; parameters that are not measured are kept.  "
    "[default: the one that comes with the package]",
)
@common.section_option
@common.file_option(
    "--out",
    "FILE",
    "Write the proposed parameters, such as monitor.yaml; nothing is written if a choice is not "
    "certain, and a file that exists is kept unless everything is determined and fits.",
)
@common.file_option(
    "--reference",
    "FILE",
    "Simulate a torque reference of the leg under the recorded motion of its crank, about a minute, and "
    "write it, such as leg.reference.npz; the proposed parameters name it.",
)
@common.option("--joint-states", "TOPIC", "Topic of the crank.  [default: all are tried]")
@common.option("--drive-torque", "TOPIC", "Topic of the torque.  [default: all are tried]")
@common.option("--crank-joint", "NAME", "The crank's name.  [default: all joints are tried]")
@common.json_option("the result")
def commission(
    recordings: tuple[Path, ...],
    config: Path | None,
    node: str | None,
    out: Path | None,
    reference: Path | None,
    json_file: Path | None,
    **topics: str | None,
) -> int:
    """Propose the parameters of a robot from recordings of its healthy leg.

    Reads MCAP, .db3, CSV and Parquet files or bag directories. Record a minute of walking with the foot in
    the air, preferably at two cadences. The command tries all joints and all torques, in both directions,
    with every gear ratio and offset. It compares each with the drive torque of the mechanism. Then it tells
    for which joints the torque is good enough. Exit code 1 if a parameter cannot be determined, or does not
    fit.
    """
    for option, path in (("--out", out), ("--reference", reference), ("--json", json_file)):
        common.check_file(option, path)
    result = _run(recordings, config, node, reference, topics)
    if json_file != common.STDOUT:
        from leg_wear_monitor.cli.pages import print_commissioning

        print_commissioning(result)
    written = common.write_json(json_file, result.to_json() if json_file is not None else "")
    if reference is not None and result.reference is not None and result.config is not None:
        _write_reference(reference, result.config, result.reference)
        written.append(reference)
    if out is not None and result.config is not None:
        if out.exists() and not result.is_sure:
            click.echo(f"not written: {out} exists, and the proposal is not certain in all", err=True)
        else:
            common.write_file(out, result.to_yaml().encode())
            written.append(out)
    common.say(json_file, (), written)
    return 0 if result.is_sure else common.WITH_FINDINGS


def _write_reference(file: Path, config: "MonitorConfig", made: "TorqueReference") -> None:
    from io import BytesIO

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.diagnosis.reference_file import write_references

    content = BytesIO()
    write_references(content, fitted(load_mechanism(config.mechanism), config), [made])
    common.write_file(file, content.getvalue())


def _run(
    recordings: tuple[Path, ...],
    path: Path | None,
    node: str | None,
    reference: Path | None,
    topics: dict[str, str | None],
) -> "CommissioningResult":
    from leg_wear_monitor.commissioning.commission import commission as propose
    from leg_wear_monitor.monitor.config.parameters import load_config

    base = load_config(path, node)
    with common.compilation("commissioning", "monitor"), common.progress_bar("commissioning") as progress:
        result = propose(recordings, base, **topics, reference=reference, progress=progress)
    for fault in result.faults:
        click.echo(f"warning: {fault}", err=True)
    return result


# ``leg-wear-monitor reference``: simulates what the diagnosis compares a drive torque with.


@click.command(short_help="Simulate a torque reference beforehand.")
@click.argument("mechanism", required=False)
@common.config_option
@common.section_option
@click.option(
    "--cadence",
    "cadences",
    type=common.Number("rpm"),
    multiple=True,
    metavar="RPM",
    help="Cadence, negative for clockwise; may be given several times.  [default: the commanded one]",
)
@common.path_option(
    "--load",
    "FILE",
    "CSV file with the mean force of the ground on the toe over one gait cycle: columns crank_angle [rad], "
    "foot_load (up) and foot_load_along [N].  [default: the leg walks in the air]",
)
@common.file_option(
    "--out",
    "FILE",
    "File to write, such as leg.reference.npz, for the parameter diagnosis.reference.",
    required=True,
)
def reference(
    mechanism: str | None,
    config: Path | None,
    node: str | None,
    cadences: tuple[float, ...],
    load: Path | None,
    out: Path,
) -> None:
    """Simulate the torque reference of a leg, which the diagnosis compares with.

    MECHANISM is a mechanism file, or the name of one that comes with the package; by default, the one of the
    parameter file. The crank turns steadily, the leg is new. A leg whose diagnosis.reference names the file
    needs no simulation while it walks at this cadence, with --load under such a force, with load.model ground
    or measured.
    """
    common.check_file("--out", out)
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.person import read_toe_force
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameters import config_from, load_config, values_of
    from leg_wear_monitor.monitor.diagnosis.reference_file import simulated_references, write_references

    settings = load_config(config, node)
    if mechanism is not None:
        settings = attrs.evolve(settings, mechanism=mechanism)
    cadences = cadences or (settings.cadence.commanded_rpm,)
    for cadence in cadences:
        config_from(values_of(settings) | {"cadence.commanded_rpm": cadence}, "--cadence")
    leg = fitted(load_mechanism(settings.mechanism), settings)
    if load is not None and leg.toe is None:
        raise ConfigError(leg.source, "bodies", "no point is called toe, on which --load would act")
    force = read_toe_force(load) if load is not None else None
    began = time.perf_counter()
    with (
        common.compilation("monitor", how_long="about a minute"),
        common.progress_bar("simulating") as progress,
    ):
        made = simulated_references(leg, cadences, progress, force)
    for cadence, one in zip(cadences, made, strict=True):
        cycles = len(one.torque_nm[-1])
        click.echo(f"{leg.name} at {cadence:g} rpm: {len(one.torque_nm)} legs, {cycles} gait cycles each")
    file = BytesIO()
    write_references(file, leg, made)
    common.write_file(out, file.getvalue())
    click.echo(f"written: {out}, after {time.perf_counter() - began:.3g} s")


# ``leg-wear-monitor play``: the play of a joint from a recording in which it was rocked.


@click.command(short_help="Measure the play of a joint that was rocked.")
@common.recordings_argument
@common.option("--joint", "NAME", "Joint in a bag, or column in a table, that has the angle.", required=True)
@common.option(
    "--load",
    "SIGNAL",
    "Signal with the direction of the push, in any unit: effort, effort:JOINT, TOPIC, TOPIC:AXIS "
    "(torque of a wrench) or TOPIC:JOINT (position, such as a target) in a bag, a column in a table. Given "
    "several times, the signals add up, such as the positions of two motors that pull to one side each.  "
    "[default: none, the angle rests at two places]",
    "loads",
    multiple=True,
)
@common.option("--time", "COLUMN", "Column of the time in a table.  [default: that of --config]")
@click.option(
    "--time-unit", type=click.Choice([*STAMPS, DATE]), help="Its unit.  [default: that of --config]"
)
@click.option(
    "--unit",
    type=click.Choice([*ANGLES, COUNTS]),
    help="Unit of the angle in a table; counts are those of --counts-per-turn.  [default: that of --config]",
)
@common.number_option(
    "--counts-per-turn",
    "N",
    "Counts of the encoder per turn of the joint.  [default: found from the values]",
    above=0.0,
)
@common.path_option(
    "--config",
    "FILE",
    "Parameter file with the column of the time and the units of a table.  "
    "[default: the one that comes with the package]",
)
@common.section_option
@common.option(
    "--mechanism",
    "FILE",
    "A mechanism, or the name of one that comes with the package: from which clearances the play comes.",
)
@common.option("--encoder", "JOINT", "Joint of the mechanism that has the encoder.  [default: --joint]")
@common.option(
    "--crank-angle",
    "DEG",
    "Crank angle of the mechanism in a recording; once for each, in their order.",
    "crank_angles",
    type=common.Number("degrees"),
    multiple=True,
)
@common.clearances_option("A,B")
@common.json_option("the result")
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
    from leg_wear_monitor.cli.pages import lines
    from leg_wear_monitor.mechanism.loader import load_mechanism

    common.check_file("--json", json_file)
    if mechanism is None and (encoder or crank_angles or clearances):
        raise click.UsageError("--encoder, --crank-angle and --clearances need --mechanism")
    if mechanism is not None and len(crank_angles) != len(recordings):
        fault = f"{len(crank_angles)} given for {len(recordings)} recordings, expected one for each"
        raise ConfigError("--crank-angle", "", fault)
    leg = None if mechanism is None else common.with_clearance_joints(load_mechanism(mechanism), clearances)
    plays, is_lossy = _plays(recordings, crank_angles, **options)
    encoder = encoder or options["joint"]
    result = _measurement(plays, leg, encoder)
    printed = lines(result, leg.name if leg else "", encoder)
    common.say(json_file, printed, common.write_json(json_file, result.to_json()))
    return common.WITH_FINDINGS if is_lossy or not result.is_sure else 0


def _plays(
    recordings: tuple[Path, ...],
    crank_angles: tuple[float, ...],
    joint: str,
    loads: tuple[str, ...],
    **of_table: Any,
) -> tuple[list["Play"], bool]:
    """The plays, and whether something of the recordings is lost."""
    settings = _settings(**of_table)
    plays, is_lossy = [], False
    for number, recording in enumerate(recordings):
        one, lossy = _play(recording, settings, joint, loads)
        angle = math.radians(crank_angles[number]) if crank_angles else None
        plays.append(attrs.evolve(one, recording=str(recording), crank_angle_rad=angle))
        is_lossy |= lossy
    return plays, is_lossy


def _settings(
    config: Path | None,
    node: str | None,
    counts_per_turn: float | None,
    time: str | None,
    time_unit: str | None,
    unit: str | None,
) -> "MonitorConfig":
    """The parameters with the options for a table in their place."""
    from leg_wear_monitor.monitor.config.parameters import load_config

    def given(**values: str | float | None) -> dict[str, Any]:
        return {key: value for key, value in values.items() if value is not None}

    settings = load_config(config, node)
    table = settings.input
    if unit == COUNTS and not (counts_per_turn or table.counts_per_turn):
        raise ConfigError("--counts-per-turn", "", "is missing, expected it with --unit counts")
    table = attrs.evolve(
        table,
        columns=attrs.evolve(table.columns, **given(stamp=time)),
        units=attrs.evolve(table.units, **given(stamp=time_unit, crank_angle=unit)),
        **given(counts_per_turn=counts_per_turn),
    )
    return attrs.evolve(settings, input=table)


def _play(
    recording: Path, settings: "MonitorConfig", joint: str, loads: tuple[str, ...]
) -> tuple["Play", bool]:
    from leg_wear_monitor.bags.findings import Severity
    from leg_wear_monitor.play.measurement import measure_play, read_rocked

    with common.compilation("play"), common.progress_bar("reading") as progress:
        read = read_rocked(recording, settings, joint, loads, progress)
    for finding in read.findings:
        click.echo(finding.line, err=True)
    counts_per_turn = settings.input.counts_per_turn
    count = 2.0 * math.pi / counts_per_turn if counts_per_turn else None
    result = measure_play(
        read.time_s, read.angle_rad, read.load, count_rad=count, joint=joint, load_name=" + ".join(loads)
    )
    return result, any(finding.severity is Severity.LOSS for finding in read.findings)


def _measurement(plays: list["Play"], leg: "Mechanism | None", encoder: str) -> "PlayMeasurement":
    """The plays, and with a mechanism the clearances that they show."""
    from leg_wear_monitor.play.fit import PlayMeasurement, clearances_of

    found = None
    if leg is not None:
        angles, sizes = [play.crank_angle_rad or 0.0 for play in plays], [play.play_rad for play in plays]
        with common.compilation("mechanism"):
            found = clearances_of(leg, encoder, angles, sizes, [play.sigma_rad for play in plays])
    return PlayMeasurement(plays=tuple(plays), clearances=found)
