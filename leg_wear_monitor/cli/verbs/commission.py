"""Verbs that learn from a recording: ``commission``, ``reference``."""

import math
import time
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, printable

if TYPE_CHECKING:
    from leg_wear_monitor.commissioning.proposal import CommissioningResult


# ``leg-wear-monitor commission``: proposes the parameters of a robot from a recording of its healthy leg.


@click.command(short_help="Propose a robot's parameters from a recording.")
@common.recordings_argument
@common.path_option(
    "--config",
    "FILE",
    "Parameter file that names the mechanism; other parameters in it are kept.  "
    "[default: config/monitor.yaml of the package]",
)
@common.section_option
@common.file_option(
    "--out",
    "FILE",
    "File for the proposed parameters, such as monitor.yaml. It is not written if a choice is uncertain. "
    "An existing file is replaced only if all parameters are determined and fit.",
)
@common.file_option(
    "--reference",
    "FILE",
    "Simulate a torque reference for the recorded motion of the crank (about a minute) and write it, such "
    "as leg.reference.npz; the proposed parameters name the file.",
)
@common.option("--joint-states", "TOPIC", "Topic of the crank.  [default: all are tried]")
@common.option("--drive-torque", "TOPIC", "Topic of the torque.  [default: all are tried]")
@common.option("--crank-joint", "NAME", "Name of the crank joint.  [default: all joints are tried]")
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
    with every gear ratio and offset. It compares each with the drive torque of the mechanism. Exit code 1 if
    a parameter cannot be determined, or does not fit.
    """
    for option, path in (("--out", out), ("--reference", reference), ("--json", json_file)):
        common.check_file(option, path)
    from leg_wear_monitor.commissioning.commission import commission as propose
    from leg_wear_monitor.monitor.config.parameters import load_config

    base = load_config(config, node)
    with common.compilation(), common.progress_bar("commissioning") as progress:
        result = propose(recordings, base, **topics, reference=reference, progress=progress)
    common.print_findings([f"warning: {fault}" for fault in result.faults])
    if json_file != common.STDOUT:
        _print(result)
    written = common.write_json(json_file, result.to_json() if json_file is not None else "")
    if reference is not None and result.reference is not None and result.config is not None:
        from leg_wear_monitor.mechanism.loader import load_mechanism
        from leg_wear_monitor.monitor.config.fitting import fitted
        from leg_wear_monitor.monitor.diagnosis.reference_file import write_references

        content, leg = BytesIO(), load_mechanism(result.config.mechanism)
        write_references(content, fitted(leg, result.config), [result.reference])
        common.write_file(reference, content.getvalue())
        written.append(reference)
    if out is not None and result.config is not None:
        if out.exists() and not result.is_sure:
            click.echo(f"not written: {out} exists, and not all proposed parameters are certain", err=True)
        else:
            common.write_file(out, result.to_yaml().encode())
            written.append(out)
    common.say(json_file, (), written)
    return 0 if result.is_sure else common.WITH_FINDINGS


def _print(result: "CommissioningResult") -> None:
    """Print the results, the quantities that cannot be determined, and the contradictions."""
    from rich.console import Console

    from leg_wear_monitor.cli.tables import figure, plain_table

    console = Console(highlight=False, markup=False)
    head = ("\nparameter", "\nvalue", "\n±", "mis-\nmatch", "\nrunner-up", "mis-\nmatch")
    table = plain_table(head, 1, 2, 5)
    for item in result.items:
        shown = (figure(item.sigma), figure(item.mismatch), _shown(item.other), figure(item.other_mismatch))
        table.add_row(item.name, f"{_shown(item.value)} {item.unit}".strip(), *shown)
    console.print(f"\nfrom {result.turns:.3g} turns of the crank\n", table, sep="\n")
    console.print("\nmismatch: RMS of the unexplained torque as a fraction of the RMS of the torque\n")
    for remark in result.remarks:
        console.print(printable(remark), soft_wrap=True)
    if result.config is None:
        console.print("no parameters are proposed, because a choice is not certain")


def _shown(value: str | int | float | None) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "-"
    return f"{value:.5g}" if isinstance(value, float) else printable(str(value), 60)


# ``leg-wear-monitor reference``: simulates the reference that the diagnosis compares with a drive torque.


@click.command(short_help="Simulate a torque reference of a leg in advance.")
@click.argument("mechanism", required=False)
@common.config_option
@common.section_option
@click.option(
    "--cadence",
    "cadences",
    type=float,
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
    """Simulate the torque reference that the diagnosis of a leg needs.

    MECHANISM is a mechanism file, or the name of one that comes with the package; by default, the mechanism
    of the parameter file. The crank turns steadily, the leg is new. If diagnosis.reference names the file,
    the monitor does not simulate while the leg walks at this cadence. A reference with --load is for this
    force, and load.model ground or measured.
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
        raise ConfigError(leg.source, "bodies", "has no point called toe, where --load acts")
    force = read_toe_force(load) if load is not None else None
    began = time.perf_counter()
    with common.compilation(), common.progress_bar("simulating") as progress:
        made = simulated_references(leg, cadences, progress, force)
    for one in made:
        rpm, cycles = one.profile.cadence_rpm, len(one.torque_nm[-1])
        click.echo(f"{leg.name} at {rpm:g} rpm: {len(one.torque_nm)} legs, {cycles} gait cycles each")
    file = BytesIO()
    write_references(file, leg, made)
    common.write_file(out, file.getvalue())
    click.echo(f"written: {out}, after {time.perf_counter() - began:.3g} s")
