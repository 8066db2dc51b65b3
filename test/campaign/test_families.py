"""The short form of every family: no crash, no hang, nothing silent, no memory without bound."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOM = Path(__file__).parent
NAMES = sorted(path.stem for path in (ROOM / "families").glob("[a-z]*.py"))


@pytest.mark.parametrize("name", NAMES)
def test_nothing_crashes_hangs_or_lies(name: str) -> None:
    """In a process of its own: what this one has loaded must not be in the cases."""
    paths = [str(ROOM.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    done = subprocess.run(
        [sys.executable, "-m", "campaign", name, "--short", "--jobs", "1"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
    )
    if "left out" in done.stdout:
        pytest.skip(done.stdout.splitlines()[0])
    assert done.returncode == 0, done.stdout + done.stderr
