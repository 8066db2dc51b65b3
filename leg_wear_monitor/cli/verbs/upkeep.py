"""Verbs of upkeep: ``acknowledge``, ``reset``, ``measure``."""

import getpass
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, LegWearError

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.ledger.entry import Measurement
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor


LAST = "last"


def leg_of(
    config: Path | None, ledger: Path | None, node: str | None = None
) -> tuple["MonitorConfig", "Mechanism"]:
    """The parameters of a node with the ledger that is asked for, and the leg by these parameters."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameters import load_config
    from leg_wear_monitor.monitor.ledger.file import hardware_id_of

    settings = load_config(config, node)
    if ledger is not None:
        # a named ledger selects its leg, unless the parameters name a leg
        hardware = settings.hardware_id or hardware_id_of(ledger)
        settings = attrs.evolve(_on(settings, ledger), hardware_id=hardware)
    elif node is not None:
        settings = settings.on_node(node)
    if not settings.ledger.path:
        raise ConfigError("--ledger", "", "no ledger given, neither by --ledger nor by ledger.path")
    return settings, fitted(load_mechanism(settings.mechanism), settings)


def _on(settings: "MonitorConfig", ledger: Path) -> "MonitorConfig":
    """The parameters with a different ledger."""
    return attrs.evolve(settings, ledger=attrs.evolve(settings.ledger, path=str(ledger)))


@contextmanager
def opened(
    config: Path | None, ledger: Path | None, dry_run: bool, joint: str | None = None, node: str | None = None
) -> Iterator["WearMonitor"]:
    """A monitor on the ledger, which is written at the end or not at all; on a copy of it for a dry run."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.ledger.file import copy_of
    from leg_wear_monitor.monitor.wear_monitor import open_monitor

    settings, leg = leg_of(config, ledger, node)
    path = Path(settings.ledger.path)
    if joint is not None:
        leg.clearance_joint(joint)  # refuses an unknown joint before a ledger is made
    with copy_of(path) if dry_run else nullcontext(path) as place:
        with common.compilation():
            monitor = open_monitor(load_mechanism(settings.mechanism), _on(settings, place), at_end=True)
        try:
            if config is None:
                _check_parameters(monitor)
            common.warn_of(str(config), monitor.coefficient_doubts)
            yield monitor
        except BaseException:
            monitor.abandon()
            raise
        monitor.close()


def _say(lines: Iterable[str], dry_run: bool) -> None:
    """Print the outcome of an action once it is written."""
    for line in (*lines, *(["dry run: nothing was written"] if dry_run else [])):
        click.echo(line)


def _check_parameters(monitor: "WearMonitor") -> None:
    """Refuse to act without the leg's own parameters: by different limits, a stop could end."""
    for doubt in (*monitor.limit_doubts, *monitor.coefficient_doubts):
        raise ConfigError("--config", "", f"{doubt}; name the parameter file of this leg")


def _need_wear(monitor: "WearMonitor") -> None:
    if not monitor.has_ledger_entry:
        raise LegWearError("the ledger contains no wear yet")


def list_measurements(joint: str | None, config: Path | None, ledger: Path | None, node: str | None) -> None:
    """Print the measurements of a ledger, or of a joint, a line each; the ledger is left as it is."""
    from leg_wear_monitor.monitor.ledger.entry import binding_of
    from leg_wear_monitor.monitor.ledger.ledger import read_ledger

    settings, leg = leg_of(config, ledger, node)
    name = leg.clearance_joint(joint) if joint else None
    content = read_ledger(Path(settings.ledger.path), binding_of(leg, settings))
    own = _of_joint(content.measurements, name)
    for each in own:
        click.echo(_line(each))
    if not own:
        click.echo("no clearance was measured yet")


def _of_joint(measurements: Iterable["Measurement"], joint: str | None) -> list["Measurement"]:
    """The measurements of a joint, or of all."""
    return [each for each in measurements if joint in (None, each.joint)]


def withdraw(joint: str | None, which: str, **options: Any) -> None:
    """Withdraw a measurement, by its number or the last one of a joint, and print its new state."""
    with opened(**options, joint=joint) as monitor:
        number = _number(monitor, monitor.mechanism.clearance_joint(joint) if joint else None, which)
        line = _line(monitor.withdraw(number, time.time_ns(), getpass.getuser()))
    _say([line], options["dry_run"])


def _number(monitor: "WearMonitor", joint: str | None, which: str) -> int:
    """Number of the measurement that is meant."""
    own = _of_joint(monitor.measurements, joint)
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
    from leg_wear_monitor.monitor.forecast.measurement import has_codes

    reply = common.trigger(node, service, wait_s, times)
    click.echo(reply)
    return common.WITH_FINDINGS if has_codes(reply) else 0


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
    from leg_wear_monitor.monitor.operators import alarm_words

    with opened(config, ledger, dry_run, node=node) as monitor:
        _need_wear(monitor)
        line = alarm_words(*monitor.acknowledge(time.time_ns()))
    _say([line], dry_run)
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
    from leg_wear_monitor.monitor.operators import alarm_words, wear_words

    now_ns, who = time.time_ns(), getpass.getuser()
    with opened(config, ledger, dry_run, joint, node) as monitor:
        _need_wear(monitor)
        joint = monitor.mechanism.clearance_joint(joint)
        if undo:
            words = wear_words(monitor.undo_reset(joint, now_ns, who))
            lines = [f"the reset is undone, the wear is again {words}, including the wear since the reset"]
        else:
            words = wear_words(monitor.wear_of(joint))
            lines = [
                f"new surfaces, {words} are set to 0, history kept; --undo reverts it",
                f"alarms {alarm_words(*monitor.reset_wear(joint, now_ns, who))}",
                "let the leg walk: the next gait cycles show whether the repair is good",
            ]
    _say([f"joint {joint}: {lines[0]}", *lines[1:]], dry_run)
    return 0


# ``leg-wear-monitor measure``: enters a measured clearance into the ledger.


@click.command(short_help="Enter a measured clearance, which updates the forecast.")
@click.argument("joint", required=False)
@click.argument("mm", type=common.POSITIVE, required=False)
@common.option("--sigma", "MM", "Standard deviation of the measurement [mm].", type=common.POSITIVE)
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
    accept: bool,
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
        is_new = mm is not None or sigma is not None or accept
        if is_new or (listed and withdrawn):
            raise click.UsageError(
                "--list and --withdraw cannot be combined, nor used with MM, --sigma or --accept"
            )
    if listed:
        list_measurements(joint, options["config"], options["ledger"], node)
        return 0
    if withdrawn:
        withdraw(joint, withdrawn, node=node, **options)
        return 0
    if joint is None or mm is None or sigma is None:
        raise click.UsageError("expected JOINT MM --sigma MM, or --list, or --withdraw")
    size = joint, 1.0e-3 * mm, 1.0e-3 * sigma
    if node is not None and is_live:
        return _on_node(node, *size, accept=accept, wait_s=wait_s)
    with opened(**options, joint=joint, node=node) as monitor:
        found = monitor.measure(*size, time.time_ns(), getpass.getuser(), accept)
    _say(found.lines, options["dry_run"])
    return common.WITH_FINDINGS if found.codes else 0


def _on_node(node: str, joint: str, clearance_m: float, sigma_m: float, accept: bool, wait_s: float) -> int:
    """Enter it into a running monitor, which says the same as the verb does with a ledger."""
    common.need_rclpy()
    from leg_wear_monitor.monitor.forecast.measurement import has_codes
    from leg_wear_monitor.ros.measure import measure_on

    reply = measure_on(node, joint, clearance_m, sigma_m, accept, wait_s)
    click.echo(reply)
    return common.WITH_FINDINGS if has_codes(reply) else 0
