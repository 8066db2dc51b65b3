"""Every family, a few cases or its short form: no crash, no hang, nothing silent, no memory unbound."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOM = Path(__file__).parent
NAMES = sorted(path.stem for path in (ROOM / "families").glob("[a-z]*.py"))


# So many of the first seeds in `make test`. Other families are left to `make test-slow` and `make campaign`;
# their laws are held in less time by test/bags/, test/dashboard/test_server.py, by
# test/test_beside.py and test/doors/test_kills.py.
QUICK = {"configurations": 16, "ledgers": 13}


def run(name: str, *how_many: str) -> None:
    """In a process of its own: what this one has loaded must not be in the cases."""
    paths = [str(ROOM.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    done = subprocess.run(
        [sys.executable, "-m", "campaign", name, *how_many, "--jobs", "1"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
    )
    if "left out" in done.stdout:
        pytest.skip(done.stdout.splitlines()[0])
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", QUICK)
def test_nothing_crashes_hangs_or_lies(name: str) -> None:
    run(name, "--number", str(QUICK[name]))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nothing_crashes_hangs_or_lies_in_the_short_form(name: str) -> None:
    run(name, "--short")
