"""The command line, run in this process."""

import inspect
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from leg_wear_monitor.cli import common
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.files import share_directory

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Call the command line in an empty directory; a bug's exception is raised, not swallowed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(common, "is_compiled", lambda _kernels: True)  # nor is it said that they compile
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
