"""The command line, run in this process in an empty directory."""

from collections.abc import Callable
from pathlib import Path

import command_line
import pytest

import leg_wear_monitor as lw

Run = Callable[..., command_line.Done]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Call the command line in an empty directory."""
    monkeypatch.chdir(tmp_path)
    return command_line.run


@pytest.fixture
def refused(run: Run) -> Callable[..., str]:
    """Call the command line with what cannot be: exit code 2, nothing on stdout; the one line on stderr."""

    def call(*arguments: str) -> str:
        result = run(*arguments)
        (line,) = (each for each in result.err.splitlines() if not each.startswith("compiling "))
        assert (result.code, result.out) == (2, "")
        assert line.startswith("error: ")
        return line

    return call


@pytest.fixture(scope="session")
def shipped() -> Callable[[str], str]:
    """Text of a mechanism that comes with the package."""
    return lambda name: (lw.share_directory() / "config" / "mechanisms" / f"{name}.yaml").read_text()
