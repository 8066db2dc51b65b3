"""``leg-wear-monitor replay`` and ``report``."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, closed_on_interrupt
from leg_wear_monitor.files import package_version, read_json
from leg_wear_monitor.monitor.alarm_specs import INPUT_KINDS, KINDS
from leg_wear_monitor.state import Level, State

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.recordings.summary import ReplayResult


# ``leg-wear-monitor replay``: a recording through the same monitor that runs live.


# Names are repeated here, because --help must not wait for numba; tests compare them with the library.
TIMES = ("header", "log")


@click.command(short_help="Run the monitor on a recording.")
@click.argument("bags", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="BAG...")
@common.out_option("Write reports.mcap (for rosbag2 and Foxglove), summary.json and report.html.")
@common.config_option
@common.choice("--time", TIMES, "Source of the samples' stamps.", default="header")
@common.option("--joint-states", "TOPIC", "Topic of the crank.  [default: */joint_states]")
@common.option("--drive-torque", "TOPIC", "Topic of the torque.  [default: */drive_torque]")
@common.option("--foot-load", "TOPIC", "Topic of the foot load.  [default: */foot_load]")
@common.option(
    "--node",
    "NAME",
    "Full name of the node whose parameters are used. [default: leg_wear_monitor "
    "in the namespace of the crank's topic]",
)
@common.option("--crank-joint", "NAME", "Name of the crank joint.  [default: crank_joint in the parameters]")
@common.file_option(
    "--ledger", "FILE", "Ledger to continue or to start. The ledger in the parameters is never changed."
)
@common.flag("--allow-partial", "Exit with 0 even if parts of the recording cannot be read.")
@common.option(
    "--fail-on",
    "WHAT",
    "Exit with 1 on 'verdict' (inspect, stop or not monitored at the end), 'alarm' (any at ERROR), "
    "'warning' (any alarm), 'input' (any alarm of the input), or a kind of alarm: "
    f"{', '.join(KINDS)}. May be repeated.",
    type=click.Choice(("verdict", "alarm", "warning", "input", *KINDS)),
    multiple=True,
)
@common.json_option("the summary")
def replay(
    bags: tuple[Path, ...],
    out: Path | None,
    config: Path | None,
    crank_joint: str | None,
    json_file: Path | None,
    allow_partial: bool,
    fail_on: tuple[str, ...],
    **options: Any,
) -> int:
    """Replay recordings through the monitor: MCAP, .db3, CSV and Parquet files or bag directories.

    Several paths are one recording. Exits with 1 if parts of it were lost, if no gait cycle in it fits this
    leg, if all of it is in the ledger already, or if --fail-on matches the verdict or an alarm.
    """
    common.check_outputs(json_file, out)
    written, began, took = list[Path](), [0.0], [0.0]
    is_report_there = out is not None and (out / common.SUMMARY).exists()

    def ready(monitor: Any) -> None:
        common.warn_of(str(config or "parameters"), monitor.coefficient_doubts)
        with common.compilation(), closed_on_interrupt(monitor.abandon):
            monitor.warm_up()
        began[0] = time.perf_counter()

    def finish(result: "ReplayResult") -> None:
        took[0] = time.perf_counter() - began[0]
        written.extend(write_replay(result, took[0], out, json_file))

    from leg_wear_monitor.dynamics.clearance.stepper import advance_beside
    from leg_wear_monitor.recordings.replay import replay as run

    settings = _config(config, crank_joint, options["node"])
    with common.progress_bar("replaying") as progress, advance_beside():
        result = run(bags, settings, out=out, ready=ready, progress=progress, finish=finish, **options)
    common.print_findings([finding.line for finding in result.findings])
    if result.is_unusable:
        missing = result.evidence.missing()
        click.echo(f"warning: no gait cycle fits this leg, so no forces are reported: {missing}", err=True)
    if json_file != common.STDOUT:
        from leg_wear_monitor.cli.tables import print_replay

        print_replay(result, took[0], {"--config": config, "--ledger": options["ledger"]})
    common.say(json_file, (), written)
    if is_report_there and result.monitor.is_all_counted:
        click.echo(f"warning: {out}: no wear was added, so the earlier report stays as it is", err=True)
    return common.WITH_FINDINGS if is_failed(result, allow_partial, fail_on) else 0


def _config(path: Path | None, crank_joint: str | None, node: str | None) -> "MonitorConfig":
    import attrs

    from leg_wear_monitor.mechanism.loader import doubts, load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted, parameter_doubts
    from leg_wear_monitor.monitor.config.parameters import load_config

    config, source = load_config(path, node), str(path or "parameters")
    mechanism = load_mechanism(config.mechanism)
    leg = fitted(mechanism, config, source)
    common.warn_of(leg.source, doubts(mechanism))
    common.warn_of(source, parameter_doubts(config, leg))
    return config if crank_joint is None else attrs.evolve(config, crank_joint=crank_joint)


def is_failed(result: "ReplayResult", allow_partial: bool, fail_on: tuple[str, ...]) -> bool:
    """True if the exit code reports findings."""
    return (
        (result.is_partial and not allow_partial)
        or is_raised(result.history.worst, fail_on)
        or result.is_unusable
        or result.monitor.is_all_counted
        or ("verdict" in fail_on and asks_to_act(result.monitor.state.verdict.state))
    )


def asks_to_act(state: State) -> bool:
    """True if the verdict at the end asks the operator to act, or cannot be given."""
    return state in (State.NOT_MONITORED, State.INSPECT, State.STOP)


def is_raised(worst: dict[str, Level], fail_on: tuple[str, ...]) -> bool:
    """True if a requested alarm was raised at any time, by the highest level of each kind."""
    highest = max(worst.values(), default=Level.OK)
    if ("alarm" in fail_on and highest is Level.ERROR) or ("warning" in fail_on and highest > Level.OK):
        return True
    asked = {*fail_on, *(INPUT_KINDS if "input" in fail_on else ())}
    return any(level is Level.ERROR and kind in asked for kind, level in worst.items())


def write_replay(
    result: "ReplayResult", wall_s: float, out: Path | None, json_file: Path | None
) -> list[Path]:
    """Write the requested files, and return their paths."""
    if out is None and json_file is None:
        return []
    from leg_wear_monitor.recordings.replay import REPORTS_FILE

    summary = result.summary(wall_s, made_with={"leg_wear_monitor": package_version()})
    text, written = summary.to_json(), list[Path]()
    if out is not None and not (result.monitor.is_all_counted and (out / common.SUMMARY).exists()):
        files = {common.SUMMARY: text.encode(), common.PAGE: common.page_of(summary)}
        written = [out / REPORTS_FILE, *common.write_directory(out, files)]
    return written + common.write_json(json_file, text)


# ``leg-wear-monitor report``: the page of a run again, from its data.


@click.command(short_help="Write the HTML page of a study or a replay again.")
@click.argument("directory", type=click.Path(path_type=Path), metavar="DIR")
def report(directory: Path) -> int:
    """Draw the page of a study or a replay again from the data in DIR; nothing is computed."""
    if (directory / common.SUMMARY).is_file():
        return _replay(directory)
    if not (directory / "study.json").is_file():
        fault = "contains no study.json. Expected the --out of a study or of a replay"
        raise ConfigError(str(directory), "", fault)
    from leg_wear_monitor.cli.verbs.study import write_study_page

    return write_study_page(directory)


def _replay(directory: Path) -> int:
    from leg_wear_monitor.recordings.result import summary_of

    source = str(directory / common.SUMMARY)
    page = common.page_of(summary_of(read_json(source), source))
    for path in common.write_directory(directory, {common.PAGE: page}):
        click.echo(f"written: {path}")
    return 0
