"""Verbs of upkeep: ``acknowledge``, ``reset``, ``measure``."""

import functools
import getpass
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, LegWearError

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor


# Where an operator's entry goes: into a ledger, or to a running monitor, which has its own parameters.

_TARGET = (
    common.config_option,
    common.file_option(
        "--ledger", "FILE", "Ledger to write into.  [default: the one in the parameters]", exists=True
    ),
    common.option(
        "--node",
        "NAME",
        "Full name of a running monitor, such as /left/leg_wear_monitor. With --config: of the node whose "
        "parameters and ledger are used.",
    ),
    common.positive(
        "--wait",
        "S",
        "With --node: longest wait [s] for the monitor, and then for its answer.",
        "wait_s",
        default=10.0,
    ),
)


def target_options(verb: Callable[..., int]) -> Callable[..., int]:
    """Add the options that select a ledger or a running monitor."""
    return functools.reduce(lambda changed, add: add(changed), reversed(_TARGET), verb)


def _live_node(config: Path | None, ledger: Path | None, node: str | None, **_: Any) -> str | None:
    """Name of the running monitor from ``--node``; None for a ledger."""
    if node is None or config is not None:
        return None
    if ledger is not None:
        raise click.UsageError("--node cannot be combined with --ledger")
    return node


@contextmanager
def opened(
    joint: str | None = None, *, config: Path | None, ledger: Path | None, node: str | None, **_: Any
) -> Iterator["WearMonitor"]:
    """A monitor on the given ledger; the ledger is written at the end or not at all."""
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.parameters import load_config
    from leg_wear_monitor.monitor.ledger.file import hardware_id_of
    from leg_wear_monitor.monitor.wear_monitor import open_monitor

    settings = load_config(config, node)
    if ledger is not None:
        # a named ledger selects its leg, unless the parameters name a leg
        hardware = settings.hardware_id or hardware_id_of(ledger)
        place = attrs.evolve(settings.ledger, path=str(ledger))
        settings = attrs.evolve(settings, ledger=place, hardware_id=hardware)
    elif node is not None:
        settings = settings.on_node(node)
    if not settings.ledger.path:
        raise ConfigError(
            "--ledger", "", "no ledger is given. Expected --ledger FILE, or ledger.path in the parameters"
        )
    leg = load_mechanism(settings.mechanism)
    if joint is not None:
        leg.clearance_joint(joint)  # refuses an unknown joint before a ledger is made
    with common.compilation():
        monitor = open_monitor(leg, settings, at_end=True)
    try:
        if config is None:  # different limits could end a stop
            for doubt in (*monitor.limit_doubts, *monitor.coefficient_doubts):
                raise ConfigError("--config", "", f"{doubt}; name the parameter file of this leg")
        common.warn_of(str(config), monitor.coefficient_doubts)
        yield monitor
    except BaseException:
        monitor.abandon()
        raise
    monitor.close()


def _need_wear(monitor: "WearMonitor") -> None:
    if not monitor.has_ledger_entry:
        raise LegWearError("the ledger contains no wear yet")


def _withdraw(monitor: "WearMonitor", joint: str) -> str:
    """Withdraw the last measurement of a joint, and return its new state in a line."""
    name = monitor.mechanism.clearance_joint(joint)
    own = [each.id for each in monitor.measurements if each.joint == name and not each.is_withdrawn]
    if not own:
        raise ConfigError("--withdraw", "", f"no measurement of joint {name} can be withdrawn")
    found = monitor.withdraw(own[-1], time.time_ns(), getpass.getuser())
    entered = datetime.fromtimestamp(1.0e-9 * found.stamp_ns, UTC).strftime("%Y-%m-%d %H:%M")
    value = f"{1.0e3 * found.clearance_m:.4g} mm ± {1.0e3 * found.sigma_m:.2g} mm"
    return f"{name}: {value}, entered {entered} by {found.who}, is withdrawn"


def _triggered(node: str, service: str, wait_s: float) -> int:
    """Have a running monitor do it."""
    common.need_rclpy()
    from leg_wear_monitor.ros.measure import trigger_on

    return _answered(trigger_on(node, service, wait_s))


def _answered(reply: str) -> int:
    """Print the reply of a running monitor, and return the exit code."""
    from leg_wear_monitor.monitor.forecast.forecaster import has_codes

    click.echo(reply)
    return common.WITH_FINDINGS if has_codes(reply) else 0


# ``leg-wear-monitor acknowledge``: acknowledge alarms.


@click.command(short_help="Acknowledge the alarms.")
@target_options
def acknowledge(**target: Any) -> int:
    """Acknowledge all alarms. Alarms whose values are normal again clear.

    The service ~/acknowledge_alarms does the same. The other alarms stay, marked as acknowledged, and clear
    when their values are normal again. A running monitor locks its ledger: name it with --node, or stop it
    first.
    """
    if (live := _live_node(**target)) is not None:
        return _triggered(live, "acknowledge_alarms", target["wait_s"])
    from leg_wear_monitor.monitor.operator_actions import alarm_words

    with opened(**target) as monitor:
        _need_wear(monitor)
        line = alarm_words(*monitor.acknowledge(time.time_ns()))
    click.echo(line)  # once it is written
    return 0


# ``leg-wear-monitor reset``: a part that was replaced, into a ledger or into a running monitor.


@click.command(short_help="Enter a replaced part.")
@click.argument("joint")
@target_options
@common.flag("--undo", "Undo the last reset: the part was not replaced.")
def reset(joint: str, undo: bool, **target: Any) -> int:
    """Enter a replaced part of JOINT: its wear starts at 0, and its history stays in the ledger.

    JOINT is a name or a label, such as knee; with --node, a name. The alarms of the old part are acknowledged
    and clear. A running monitor locks its ledger: name it with --node, or stop it first.
    """
    if (live := _live_node(**target)) is not None:
        service = f"{'undo_reset' if undo else 'reset_wear'}/{joint}"
        return _triggered(live, service, target["wait_s"])
    from leg_wear_monitor.monitor.operator_actions import alarm_words, wear_words

    now_ns, who = time.time_ns(), getpass.getuser()
    with opened(joint, **target) as monitor:
        _need_wear(monitor)
        joint = monitor.mechanism.clearance_joint(joint)
        if undo:
            words = wear_words(monitor.undo_reset(joint, now_ns, who))
            lines = [f"the reset is undone, the wear is again {words}, including the wear since the reset"]
        else:
            words = wear_words(monitor.wear_of(joint))
            lines = [
                f"new surfaces, {words} are set to 0, history kept; --undo reverts this",
                f"alarms {alarm_words(*monitor.reset_wear(joint, now_ns, who))}",
                "let the leg walk: the next gait cycles confirm the repair",
            ]
    click.echo("\n".join([f"joint {joint}: {lines[0]}", *lines[1:]]))
    return 0


# ``leg-wear-monitor measure``: enters a measured clearance into the ledger.


@click.command(short_help="Enter a measured clearance, which updates the forecast.")
@click.argument("joint")
@click.argument("mm", type=common.POSITIVE, required=False)
@common.positive("--sigma", "MM", "Standard deviation of the measurement [mm].")
@common.flag("--accept", "Use the measurement even if it contradicts the model.")
@target_options
@common.flag(
    "--withdraw", "Withdraw the last measurement of JOINT: it stays in the ledger and no longer counts."
)
def measure(
    joint: str, mm: float | None, sigma: float | None, accept: bool, withdraw: bool, **target: Any
) -> int:
    """Enter the measured mean radial clearance of JOINT, a name or a label such as knee, in millimetres.

    Measure with a feeler gauge, a micrometer or a dial. A dial indicator shows twice the radial clearance if
    you move the pin from side to side. A running monitor locks its ledger: name it with --node, or stop it
    first. The modelled clearance does not change. Exit code 1 if the measurement contradicts the model or is
    at its limit.
    """
    live = _live_node(**target)
    if withdraw:
        if live is not None:
            raise click.UsageError("--node cannot be combined with --withdraw")
        if mm is not None or sigma is not None or accept:
            raise click.UsageError("--withdraw cannot be combined with MM, --sigma or --accept")
        with opened(joint, **target) as monitor:
            line = _withdraw(monitor, joint)
        click.echo(line)
        return 0
    if mm is None or sigma is None:
        raise click.UsageError("MM needs --sigma. Expected JOINT MM --sigma MM, or JOINT --withdraw")
    size = joint, 1.0e-3 * mm, 1.0e-3 * sigma
    if live is not None:
        common.need_rclpy()
        from leg_wear_monitor.ros.measure import measure_on

        return _answered(measure_on(live, *size, accept, target["wait_s"]))
    with opened(joint, **target) as monitor:
        found = monitor.measure(*size, time.time_ns(), getpass.getuser(), accept)
    click.echo("\n".join(found.lines))
    return common.WITH_FINDINGS if found.codes else 0
