"""Verbs of upkeep: ``acknowledge``, ``reset``, ``measure``."""

import getpass
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import attrs
import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.ledger.entry import Measurement
    from leg_wear_monitor.monitor.ledger.ledger import Ledger


# The measurements of a ledger on the command line: opened, listed, withdrawn.


LAST = "last"


def leg_of(
    config: Path | None, ledger: Path | None, node: str | None = None
) -> tuple["MonitorConfig", "Mechanism"]:
    """The parameters of a node, with the ledger that is asked for, and the leg as they want it."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameters import load_config
    from leg_wear_monitor.monitor.ledger.file import hardware_id_of

    settings = load_config(config, node)
    if ledger is not None:
        # who names a ledger means its leg, unless the parameters name one
        hardware = settings.hardware_id or hardware_id_of(ledger)
        kept = attrs.evolve(settings.ledger, path=str(ledger))
        settings = attrs.evolve(settings, ledger=kept, hardware_id=hardware)
    elif node is not None:
        settings = settings.on_node(node)
    if not settings.ledger.path:
        raise ConfigError("--ledger", "", "no ledger given, neither by --ledger nor by ledger.path")
    return settings, fitted(load_mechanism(settings.mechanism), settings)


@contextmanager
def opened(
    config: Path | None,
    ledger: Path | None,
    dry_run: bool,
    joint: str | None = None,
    node: str | None = None,
) -> Iterator[tuple["Ledger", "Mechanism", "MonitorConfig"]]:
    """The ledger, the leg and its parameters; a copy of the ledger, if nothing shall be written."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.ledger.file import copy_of
    from leg_wear_monitor.monitor.ledger.ledger import open_ledger

    settings, leg = leg_of(config, ledger, node)
    if joint is not None:
        leg.clearance_joint(joint)  # refuses another one before a ledger is made
    plain = load_mechanism(settings.mechanism)  # without its parameters, which a ledger applies itself
    with copy_of(settings.ledger.path) if dry_run else nullcontext(settings.ledger.path) as path:
        kept = attrs.evolve(settings, ledger=attrs.evolve(settings.ledger, path=str(path)))
        with closing(cast("Ledger", open_ledger(plain, kept))) as there:  # a path is given
            yield there, leg, settings


def check_limit(
    kept: "Ledger", leg: "Mechanism", settings: "MonitorConfig", joint: str, config: Path | None
) -> float:
    """Limit of a joint's clearance [m]; that of a leg with a limit of its own is in its parameters only."""
    from leg_wear_monitor.monitor.operators import clearance_limits, limit_in

    limit_m, known_m = clearance_limits(leg, settings)[joint], limit_in(kept, joint)
    if config is None and known_m is not None and known_m != limit_m:
        fault = (
            f"the limit of joint {joint} is {1e3 * known_m:.4g} mm in the ledger and {1e3 * limit_m:.4g} mm "
            "without parameters; name the parameter file of this leg"
        )
        raise ConfigError("--config", "", fault)
    return limit_m


def check_limits(kept: "Ledger", leg: "Mechanism", settings: "MonitorConfig", config: Path | None) -> None:
    """Refuse to judge anew by other limits than the monitor's, which could end a stop."""
    for joint in leg.clearance_joints:
        check_limit(kept, leg, settings, joint, config)


def list_measurements(joint: str | None, config: Path | None, ledger: Path | None, node: str | None) -> None:
    """Print the measurements of a ledger, or of a joint, a line each; the ledger is left as it is."""
    with opened(config, ledger, True, joint, node) as (kept, leg, _):
        own = _of_joint(kept, leg.clearance_joint(joint) if joint else None)
        for each in own:
            click.echo(_line(each))
        if not own:
            click.echo("no clearance was measured yet")


def _of_joint(kept: "Ledger", joint: str | None) -> list["Measurement"]:
    """The measurements of a joint, or of all."""
    return [each for each in kept.measurements if joint in (None, each.joint)]


def withdraw(
    joint: str | None,
    which: str,
    who: str,
    config: Path | None,
    ledger: Path | None,
    dry_run: bool,
    node: str | None,
) -> None:
    """Withdraw a measurement, by its number or the last one of a joint, and print what it is then."""
    from leg_wear_monitor.monitor.operators import withdraw_in

    with opened(config, ledger, dry_run, joint, node) as (kept, leg, settings):
        number = _number(kept, leg.clearance_joint(joint) if joint else None, which)
        (own,) = (each.joint for each in kept.measurements if each.id == number)
        check_limit(kept, leg, settings, own, config)
        click.echo(_line(withdraw_in(kept, leg, settings, number, time.time_ns(), who)))


def _number(kept: "Ledger", joint: str | None, which: str) -> int:
    """Number of the measurement that is meant."""
    own = _of_joint(kept, joint)
    whose = f"of joint {joint} " if joint else ""
    if which == LAST:
        open_ones = [each.id for each in own if not each.is_withdrawn]
        if not open_ones:
            raise ConfigError("--withdraw", "", f"no measurement {whose}can be withdrawn")
        return open_ones[-1]
    if not which.isascii() or not which.isdecimal() or int(which) not in {each.id for each in own}:
        known = ", ".join(str(each.id) for each in own) or "none"
        raise ConfigError("--withdraw", "", f"{which!r} is not {LAST}, nor a measurement {whose}({known})")
    return int(which)


def _line(m: "Measurement") -> str:
    """A measurement for operators."""
    state = "counts" if m.counts else "does not count"
    if m.is_withdrawn:
        state = f"withdrawn {_date(m.withdrawn_ns)} by {m.withdrawn_by}"
    value = f"{1.0e3 * m.clearance_m:.4g} mm ± {1.0e3 * m.sigma_m:.2g} mm"
    return f"{m.id}: {m.joint} {value}, {_date(m.stamp_ns)} by {m.who}, {state}"


def _date(stamp_ns: int) -> str:
    return datetime.fromtimestamp(1.0e-9 * stamp_ns, UTC).strftime("%Y-%m-%d %H:%M")


def _triggered(node: str, service: str, wait_s: float, times: int = 1) -> int:
    """Have a running monitor do it, print its reply, and return the exit code."""
    from leg_wear_monitor.monitor.forecast.measurement import NOT_STORED

    reply = common.trigger(node, service, wait_s, times)
    click.echo(reply)
    return common.WITH_FINDINGS if NOT_STORED in reply else 0


# ``leg-wear-monitor acknowledge``: alarms that an operator has seen to.


@click.command(short_help="Acknowledge the alarms.")
@common.config_option
@common.ledger_option
@common.node_option
@common.wait_option
@common.dry_run_option
def acknowledge(
    config: Path | None, ledger: Path | None, node: str | None, wait_s: float, dry_run: bool
) -> int:
    """Acknowledge all alarms: those that have returned to normal clear, the others stay, marked as seen.

    The service ~/acknowledge_alarms does the same. The others clear when their values return. A running
    monitor locks its ledger: name it with --node, or stop it first.
    """
    if node is not None and config is None:
        common.check_alone(ledger=ledger, dry_run=dry_run)
        return _triggered(node, "acknowledge_alarms", wait_s)
    from leg_wear_monitor.monitor.operators import acknowledge_in

    with opened(config, ledger, dry_run, node=node) as (kept, leg, settings):
        check_limits(kept, leg, settings, config)
        click.echo(acknowledge_in(kept, leg, settings, time.time_ns()).words)
    if dry_run:
        click.echo("dry run: nothing was written")
    return 0


# ``leg-wear-monitor reset``: a part that was replaced, into a ledger or into a running monitor.


@click.command(short_help="Enter a replaced part.")
@click.argument("joint")
@common.config_option
@common.ledger_option
@common.node_option
@common.wait_option
@click.option("--undo", is_flag=True, help="Undo the last reset: the part was not replaced.")
@common.dry_run_option
def reset(
    joint: str,
    config: Path | None,
    ledger: Path | None,
    node: str | None,
    wait_s: float,
    undo: bool,
    dry_run: bool,
) -> int:
    """Enter that the parts of JOINT were replaced: its wear is 0 again, its history stays in the ledger.

    JOINT is a name or a label, such as knee; with --node, a name. The alarms that rested on the former part
    are acknowledged and clear. A running monitor locks its ledger: name it with --node, or stop it first.
    """
    if node is not None and config is None:
        common.check_alone(ledger=ledger, dry_run=dry_run)
        service = f"{'undo_reset' if undo else 'reset_wear'}/{joint}"
        return _triggered(node, service, wait_s, times=1 if undo else 2)  # a reset is confirmed
    _reset_in(joint, config, ledger, undo, dry_run, node)
    if dry_run:
        click.echo("dry run: nothing was written")
    return 0


def _reset_in(
    joint: str, config: Path | None, ledger: Path | None, undo: bool, dry_run: bool, node: str | None
) -> None:
    """Enter it into a ledger, and print what came of it."""
    from leg_wear_monitor.monitor.operators import reset_in, undo_in, wear_words

    now_ns, who = time.time_ns(), getpass.getuser()
    with opened(config, ledger, dry_run, joint, node) as (kept, leg, settings):
        check_limits(kept, leg, settings, config)
        joint = leg.clearance_joint(joint)
        if undo:
            words = wear_words(undo_in(kept, leg, settings, joint, now_ns, who))
            click.echo(
                f"joint {joint}: the reset is undone, {words} are counted, including those since the reset"
            )
            return
        was, done = reset_in(kept, leg, settings, joint, now_ns, who)
    words = wear_words(was)
    click.echo(f"joint {joint}: new surfaces, {words} are set to 0, history kept; --undo reverts it")
    click.echo(f"alarms {done.words}")
    click.echo("confirm by walking: the next gait cycles show whether the repair is good")


# ``leg-wear-monitor measure``: a clearance that somebody measured, into the ledger.


@click.command(short_help="Enter a measured clearance, which updates the forecast.")
@click.argument("joint", required=False)
@click.argument("mm", type=common.Number("mm", above=0.0), required=False)
@common.number_option("--sigma", "MM", "Standard deviation of the measurement.", "mm", above=0.0)
@common.config_option
@common.ledger_option
@click.option("--accept", is_flag=True, help="Use it even if it contradicts the model.")
@common.dry_run_option
@common.node_option
@common.wait_option
@click.option(
    "--list", "listed", is_flag=True, help="Print the measurements with their numbers, of JOINT if given."
)
@common.option(
    "--withdraw",
    f"NUMBER|{LAST}",
    f"Withdraw a measurement: it stays in the ledger and no longer counts. {LAST}: the last one, of "
    "JOINT if given.",
    "withdrawn",
)
def measure(
    joint: str | None,
    mm: float | None,
    sigma: float | None,
    listed: bool,
    withdrawn: str | None,
    node: str | None,
    wait_s: float,
    **options: Any,
) -> int:
    """Enter the measured mean radial clearance of JOINT, a name or a label such as knee, in millimetres.

    Measure with a feeler gauge, a micrometer or a dial. A dial shows twice the radial clearance if the pin is
    moved to and fro. A running monitor locks its ledger: name it with --node, or stop it first. The counted
    clearance stays as it is. Exit code 1 if the measurement contradicts the model or is at its limit.
    """
    is_live = node is not None and options["config"] is None
    if is_live:
        alone = {name: options[name] for name in ("ledger", "dry_run")}
        common.check_alone(**alone, list=listed, withdraw=withdrawn)
    if listed or withdrawn:
        is_new = mm is not None or sigma is not None or options.pop("accept")
        if is_new or (listed and withdrawn):
            raise click.UsageError(
                "--list and --withdraw cannot be combined, nor used with MM, --sigma or --accept"
            )
    if listed:
        list_measurements(joint, options["config"], options["ledger"], node)
        return 0
    if withdrawn:
        withdraw(joint, withdrawn, getpass.getuser(), node=node, **options)
        return 0
    if joint is None or mm is None or sigma is None:
        raise click.UsageError("expected JOINT MM --sigma MM, or --list, or --withdraw")
    size = joint, 1.0e-3 * mm, 1.0e-3 * sigma
    if node is not None and is_live:
        return _on_node(node, *size, accept=options["accept"], wait_s=wait_s)
    lines, has_findings = _measured(*size, node=node, **options)
    for line in lines:
        click.echo(line)
    if options["dry_run"]:
        click.echo("dry run: nothing was written")
    return common.WITH_FINDINGS if has_findings else 0


def _on_node(node: str, joint: str, clearance_m: float, sigma_m: float, accept: bool, wait_s: float) -> int:
    """Enter it into a running monitor, which says the same as the verb does with a ledger."""
    common.need_rclpy()
    from leg_wear_monitor.monitor.forecast.measurement import asks_to_act
    from leg_wear_monitor.ros.measure import measure_on

    reply = measure_on(node, joint, clearance_m, sigma_m, accept, wait_s)
    click.echo(reply)
    return common.WITH_FINDINGS if asks_to_act(reply) else 0


def _measured(
    joint: str,
    clearance_m: float,
    sigma_m: float,
    config: Path | None,
    ledger: Path | None,
    accept: bool,
    dry_run: bool,
    node: str | None,
) -> tuple[tuple[str, ...], bool]:
    """What came of a measurement, a line each, and whether the caller has to act."""
    from leg_wear_monitor.monitor.forecast.measurement import measure as evaluate
    from leg_wear_monitor.monitor.forecast.wear_coefficients import coefficient_doubts, usual_prior
    from leg_wear_monitor.monitor.ledger.entry import new_part
    from leg_wear_monitor.monitor.operators import measured_in, shown_in
    from leg_wear_monitor.monitor.verdict.situation import SOURCES

    with opened(config, ledger, dry_run, joint, node) as (kept, leg, settings):
        joint = leg.clearance_joint(joint)
        limit_m = check_limit(kept, leg, settings, joint, config)
        parts = {wear.name: wear for wear in kept.entry.joints} if kept.entry else {}
        part = parts.get(joint) or new_part(joint)
        common.warn_of(str(config or "parameters"), coefficient_doubts([part], leg))
        found = evaluate(
            settings.forecast,
            leg.clearances[joint],
            part,
            kept.measurements,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=time.time_ns(),
            who=getpass.getuser(),
            kept_ns=kept.kept_ns,
            accept=accept,
            prior=usual_prior(settings.forecast, leg.clearances[joint]),
            corrections=kept.corrections,
        )
        shown = shown_in(kept, joint)
        if shown:
            by = SOURCES[shown.by]
            found = attrs.evolve(found, shown_m=shown.clearance_m, shown_sigma_m=shown.sigma_m, shown_by=by)
        kept.note(found.measurement)
        entry, eased = measured_in(kept, leg, settings, found.measurement)
        kept.record(entry)
        found = attrs.evolve(found, eased=eased)
    lines = found.lines(limit_m, settings.limits.warn_fraction, kept.measurements)
    return lines, found.has_findings(limit_m)
