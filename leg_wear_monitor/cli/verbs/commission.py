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
@click.option("--joint-states", metavar="TOPIC", help="Topic of the crank.  [default: all are tried]")
@click.option("--drive-torque", metavar="TOPIC", help="Topic of the torque.  [default: all are tried]")
@click.option("--crank-joint", metavar="NAME", help="The crank's name.  [default: all joints are tried]")
@json_option("the result")
def commission(
    recordings: tuple[Path, ...],
    config: Path | None,
    out: Path | None,
    joint_states: str | None,
    drive_torque: str | None,
    crank_joint: str | None,
    json_file: Path | None,
) -> int:
    """Propose the parameters of a robot from recordings of its healthy leg.

    Reads MCAP, .db3, CSV and Parquet files or bag directories. Record a minute of walking with the foot in
    the air, preferably at two cadences. The command tries all joints and all torques, in both directions,
    with every gear ratio and offset. It compares each with the drive torque of the mechanism. Exit code 1 if
    a parameter cannot be determined, or does not fit.
    """
    for option, path in (("--out", out), ("--json", json_file)):
        if path is not None and path != STDOUT:
            check_file(option, path)
    topics = {"joint_states": joint_states, "drive_torque": drive_torque, "crank_joint": crank_joint}
    result = _run(recordings, config, topics)
    if json_file != STDOUT:
        from leg_wear_monitor.cli.commission_tables import print_commissioning

        print_commissioning(result)
    written = write_json(json_file, result.to_json() if json_file is not None else "")
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


def _run(
    recordings: tuple[Path, ...], path: Path | None, topics: dict[str, str | None]
) -> "CommissioningResult":
    try:
        from leg_wear_monitor.commissioning.commission import commission as propose
    except ModuleNotFoundError as error:
        raise LegWearError(f"{error.name} is not installed; pip install 'leg_wear_monitor[bags]'") from error
    with compilation("commissioning"), progress_bar("commissioning") as progress:
        result = propose(recordings, path, **topics, progress=progress)
    for fault in result.faults:
        click.echo(f"warning: {fault}", err=True)
    return result
