"""The command line, run in this process."""

import inspect
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import attrs
import numpy as np
import pytest
from click.testing import CliRunner, Result

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.cli import common
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarm_specs import KINDS
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import AlarmEvent, Entry, JointWear
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.operator_actions import note_verdict

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Call the command line in an empty directory; a bug's exception is raised, not swallowed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(common, "compilation", nullcontext)  # no line says that kernels compile
    # Before click 8.2, stderr was mixed into stdout unless one asked.
    old = "mix_stderr" in inspect.signature(CliRunner).parameters
    runner = CliRunner(mix_stderr=False) if old else CliRunner()

    def call(*arguments: str) -> Result:
        result = runner.invoke(cli, list(arguments), prog_name="leg-wear-monitor")
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return call


@pytest.fixture
def refused(run: Run) -> Callable[..., str]:
    """Call the command line with what cannot be: exit code 2, nothing on stdout; the one line on stderr."""

    def call(*arguments: str) -> str:
        result = run(*arguments)
        (line,) = result.stderr.splitlines()
        assert (result.exit_code, result.stdout) == (2, "")
        assert line.startswith("error: ")
        return line

    return call


@pytest.fixture
def shipped() -> Callable[[str], str]:
    """Text of a mechanism that comes with the package."""
    return lambda name: (share_directory() / "config" / "mechanisms" / f"{name}.yaml").read_text()


@pytest.fixture
def complaints() -> Callable[[Result], list[str]]:
    """Lines on stderr, but for the one that says why the very first run takes long."""
    return lambda result: [
        line for line in result.stderr.splitlines() if not line.startswith("compiling numerical kernels")
    ]


@pytest.fixture
def worn_ledger(tmp_path: Path) -> Callable[..., Path]:
    """Write a ledger of the default leg whose joints have opened by 60 µm in 4000 of 5000 gait cycles."""

    def write(config: MonitorConfig | None = None, alarms: tuple[Alarm, ...] = ()) -> Path:
        """The alarms were raised at their worst values; the verdict is that of them."""
        alarms = tuple(attrs.evolve(alarm, unit=KINDS[alarm.kind].unit) for alarm in alarms)
        config, path, leg = config or MonitorConfig(), tmp_path / "wear.ledger", load_mechanism("bionic_leg")
        config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(path)))
        kept = open_ledger(leg, config)
        worn = np.full((2, 720), 3.0e-5)
        nominal = {name: sum(leg.clearances[name].wear_coefficient) for name in leg.clearance_joints}
        joints = tuple(JointWear(name, worn, 4000, 4000.0, 0, k) for name, k in nominal.items())
        totals = {"cycles": 5e3, "moving_s": 5e3}
        entry = Entry(stamp_ns=10**9, joints=joints, totals=totals, alarms=alarms, spans=((0, 10**9, 0),))
        for alarm in alarms:
            kept.note(AlarmEvent(alarm.raised_ns, attrs.evolve(alarm, value=alarm.worst)))
        kept.keep(entry, closed=True)
        kept.close()
        kept = open_ledger(leg, config)
        note_verdict(MonitoredLeg(leg, config, kept), 10**9)
        kept.keep(entry, closed=True)
        kept.close()
        return path

    return write
