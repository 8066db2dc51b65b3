"""``leg-wear-monitor commission``: proposes the parameters of a robot from a recording of its healthy leg."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.options import json_option
from leg_wear_monitor.cli.output import STDOUT, check_file, write_file, write_json
from leg_wear_monitor.cli.waiting import compilation, progress_bar
from leg_wear_monitor.errors import LegWearError

if TYPE_CHECKING:
    from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningResult
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

WITH_FINDINGS = 1


@click.command(short_help="Propose a robot's parameters from a recording.")
@click.argument(
    "recordings", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RECORDING..."
)
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Parameter file that names the mechanism; parameters that are not measured are kept.  "
    "[default: the one that comes with the package]",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Write the proposed parameters, such as monitor.yaml; nothing is written if a choice is not "
    "certain, and a file that exists is kept unless everything is determined and fits.",
)
@click.option(
    "--reference",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Simulate a torque reference of the leg under the recorded motion of its crank, about a minute, and "
    "write it, such as leg.reference.npz; the proposed parameters name it.",
)
@click.option("--joint-states", metavar="TOPIC", help="Topic of the crank.  [default: all are tried]")
@click.option("--drive-torque", metavar="TOPIC", help="Topic of the torque.  [default: all are tried]")
@click.option("--crank-joint", metavar="NAME", help="The crank's name.  [default: all joints are tried]")
@json_option("the result")
def commission(
    recordings: tuple[Path, ...],
    config: Path | None,
    out: Path | None,
    reference: Path | None,
    joint_states: str | None,
    drive_torque: str | None,
    crank_joint: str | None,
    json_file: Path | None,
) -> int:
    """Propose the parameters of a robot from recordings of its healthy leg.

    Reads MCAP, .db3, CSV and Parquet files or bag directories. Record a minute of walking with the foot in
    the air, preferably at two cadences. The command tries all joints and all torques, in both directions,
    with every gear ratio and offset. It compares each with the drive torque of the mechanism. Then it tells
    for which joints the torque is good enough. Exit code 1 if a parameter cannot be determined, or does not
    fit.
    """
    for option, path in (("--out", out), ("--reference", reference), ("--json", json_file)):
        if path is not None and path != STDOUT:
            check_file(option, path)
    topics = {"joint_states": joint_states, "drive_torque": drive_torque, "crank_joint": crank_joint}
    result = _run(recordings, config, reference, topics)
    if json_file != STDOUT:
        from leg_wear_monitor.cli.commission_tables import print_commissioning

        print_commissioning(result)
    written = write_json(json_file, result.to_json() if json_file is not None else "")
    if reference is not None and result.reference is not None and result.config is not None:
        _write_reference(reference, result.config, result.reference)
        written.append(reference)
    if out is not None and result.config is not None:
        if out.exists() and not result.is_sure:
            click.echo(f"not written: {out} exists, and the proposal is not certain in all", err=True)
        else:
            write_file(out, result.to_yaml().encode())
            written.append(out)
    if json_file != STDOUT:
        for path in written:
            click.echo(f"written: {path}")
    return 0 if result.is_sure else WITH_FINDINGS


def _write_reference(file: Path, config: "MonitorConfig", made: "TorqueReference") -> None:
    from io import BytesIO

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.diagnosis.reference_file import write_references

    content = BytesIO()
    write_references(content, fitted(load_mechanism(config.mechanism), config), [made])
    write_file(file, content.getvalue())


def _run(
    recordings: tuple[Path, ...], path: Path | None, reference: Path | None, topics: dict[str, str | None]
) -> "CommissioningResult":
    try:
        from leg_wear_monitor.commissioning.commission import commission as propose
    except ModuleNotFoundError as error:
        raise LegWearError(f"{error.name} is not installed; pip install 'leg_wear_monitor[bags]'") from error
    with compilation("commissioning", "monitor"), progress_bar("commissioning") as progress:
        result = propose(recordings, path, **topics, reference=reference, progress=progress)
    for fault in result.faults:
        click.echo(f"warning: {fault}", err=True)
    return result
