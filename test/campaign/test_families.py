"""Every family, a few cases or its short form: no crash, no hang, nothing silent, no memory unbound."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOM = Path(__file__).parent
NAMES = sorted(path.stem for path in (ROOM / "families").glob("[a-z]*.py"))


# Of the first seeds: some of each kind where kinds follow one another from seed to seed.
FEW = {
    "configurations": 16,
    "dashboard": 6,
    "databases": 19,
    "fleets": 6,
    "floods": 2,
    "kills": 1,
    "ledgers": 13,
    "live_kills": 1,
    "parquet": 10,
    "recordings": 10,
    "workers": 2,
}


# Left to `make test-slow` and `make campaign`: other tests hold their laws in less time
# (test/doors/test_kills.py, test/test_beside.py, test/monitor/inputs/test_bad_input.py, test/bags/,
# test/fleet/, test/dashboard/test_server.py).
LONG = {"dashboard", "fleets", "floods", "kills", "live_kills", "recordings", "workers"}


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


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in NAMES]
)
def test_nothing_crashes_hangs_or_lies(name: str) -> None:
    run(name, "--number", str(FEW[name]))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nothing_crashes_hangs_or_lies_in_the_short_form(name: str) -> None:
    run(name, "--short")
