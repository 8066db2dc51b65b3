"""The measurements of a ledger on the command line: opened, listed, withdrawn."""

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.errors import ConfigError

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.ledger.entry import Measurement
    from leg_wear_monitor.monitor.ledger.ledger import Ledger

LAST = "last"


def leg_of(config: Path | None, ledger: Path | None) -> tuple["MonitorConfig", "Mechanism"]:
    """The parameters, with the ledger that is asked for, and the leg as they want it."""
    import attrs

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameter_file import load_config
    from leg_wear_monitor.monitor.ledger.file import hardware_id_of

    settings = load_config(config)
    if ledger is not None:
        # who names a ledger means its leg, unless the parameters name one
        hardware = settings.hardware_id or hardware_id_of(ledger)
        kept = attrs.evolve(settings.ledger, path=str(ledger))
        settings = attrs.evolve(settings, ledger=kept, hardware_id=hardware)
    if not settings.ledger.path:
        raise ConfigError("--ledger", "", "no ledger given, neither by --ledger nor by ledger.path")
    return settings, fitted(load_mechanism(settings.mechanism), settings)


@contextmanager
def opened(settings: "MonitorConfig", dry_run: bool) -> Iterator["Ledger"]:
    """The ledger; a copy of it that is thrown away, if nothing shall be written."""
    import attrs

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.ledger.file import copy_of
    from leg_wear_monitor.monitor.ledger.ledger import open_ledger

    leg = load_mechanism(settings.mechanism)  # without its parameters, which a ledger applies itself
    with copy_of(settings.ledger.path) if dry_run else nullcontext(settings.ledger.path) as path:
        kept = open_ledger(leg, attrs.evolve(settings, ledger=attrs.evolve(settings.ledger, path=str(path))))
        if kept is None:
            raise ConfigError("--ledger", "", "no ledger given, neither by --ledger nor by ledger.path")
        with closing(kept):
            yield kept


def list_measurements(config: Path | None, ledger: Path | None) -> None:
    """Print all measurements of a ledger, a line each; the ledger is left as it is."""
    settings, _ = leg_of(config, ledger)
    with opened(settings, dry_run=True) as kept:
        for each in kept.measurements:
            click.echo(_line(each))
        if not kept.measurements:
            click.echo("no clearance was measured yet")


def withdraw(
    joint: str | None, which: str, who: str, config: Path | None, ledger: Path | None, dry_run: bool
) -> None:
    """Withdraw a measurement, by its number or the last one of a joint, and print what it is then."""
    settings, _ = leg_of(config, ledger)
    with opened(settings, dry_run) as kept:
        number = _number(kept, joint, which)
        click.echo(_line(kept.withdraw(number, time.time_ns(), who)))
        kept.record()


def _number(kept: "Ledger", joint: str | None, which: str) -> int:
    """Number of the measurement that is meant."""
    own = [each for each in kept.measurements if joint in (None, each.joint)]
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
