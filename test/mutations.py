"""How many of the small faults in ``mutations.yaml`` the tests find: ``make mutations``.

Each fault is put into a copy of the checkout. The tests that are likely to find it run first, then the rest
of `make test`. ``build/mutations.jsonl`` gets a line per fault; a fault that has a line is not tried again.
A test that finds a fault counts only if it passes without the fault.

``python test/mutations.py [NAME ...] [--jobs N] [--likely]``: these faults, N at a time, likely tests only.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
LOG = ROOT / "build" / "mutations.jsonl"
NEVER = "test/docs"  # `make docs` runs these
LONGEST_S = 3600.0
_FOUND = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)  # a case may have spaces

Fault = dict[str, str]


def copy(place: Path) -> None:
    """The files of the checkout as they are now, without its history and its environments."""
    names = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    for name in filter(None, names.split("\0")):
        if (ROOT / name).exists():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, place / name)


def changed(name: str, fault: Fault) -> tuple[Path, str]:
    """File of a fault, relative to the checkout, and its text with the fault."""
    path = Path("leg_wear_monitor", fault["file"])
    text = (ROOT / path).read_text(encoding="utf-8")
    if text.count(fault["old"]) != 1:
        sys.exit(f"mutations.yaml: {name}: occurs {text.count(fault['old'])} times in {path}. Expected once.")
    return path, text.replace(fault["old"], fault["new"])


def failed(place: Path, *options: str) -> str:
    """First test that fails in a copy; empty if all pass."""
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", "-p", "no:cacheprovider", *options]
    environment = {
        **os.environ,
        "PYTHONPATH": str(place),
    }  # the commands that a test starts import the copy, too
    done = subprocess.run(
        command, cwd=place, env=environment, capture_output=True, text=True, timeout=LONGEST_S, check=False
    )
    if done.returncode == 0:
        return ""
    found = _FOUND.search(done.stdout)
    return found[1] if found else f"pytest: {(done.stdout + done.stderr)[-500:]}"


def tried(name: str, fault: Fault, is_whole: bool) -> dict[str, Any]:
    """What the tests say to a fault: the one that finds it, by which of them, and after how many seconds."""
    path, text = changed(name, fault)
    likely = [f"test/{each}" for each in fault["tests"].split()]
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutation-") as directory:
        place = Path(directory)
        copy(place)
        (place / path).write_text(text, encoding="utf-8")
        found = failed(place, "-x", *likely)
        if not found and is_whole:
            others = [f"--ignore={each}" for each in (NEVER, *likely)]
            found = failed(place, "-x", "--numprocesses", "2", "--dist", "loadfile", *others)
    seconds = round(time.monotonic() - begin)
    return {"fault": name, "found_by": found, "seconds": seconds, "whole": is_whole}


def control(tests: list[str]) -> list[str]:
    """Of these tests, those that fail without a fault."""
    with tempfile.TemporaryDirectory(prefix="mutation-") as directory:
        place = Path(directory)
        copy(place)
        return [test for test in tests if failed(place, test)]


def known() -> dict[str, dict[str, Any]]:
    """Lines of the log by fault; the last one counts."""
    lines = LOG.read_text(encoding="utf-8").splitlines() if LOG.exists() else []
    return {line["fault"]: line for line in map(json.loads, lines)}


def main() -> None:
    """Try the faults that the log does not have, and print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("names", nargs="*", metavar="NAME", help="faults; default: all")
    options.add_argument("--jobs", type=int, default=1, help="faults at a time")
    options.add_argument(
        "--likely", action="store_true", help="only the tests that are likely to find a fault"
    )
    given = options.parse_args()
    faults: dict[str, Fault] = YAML(typ="safe", pure=True).load(Path(__file__).with_suffix(".yaml"))
    names, before = given.names or list(faults), known()
    for name in names:
        changed(name, faults[name])  # before hours have passed
    left = [
        name for name in names
        if name not in before or not (before[name]["found_by"] or before[name]["whole"] or given.likely)
    ]  # fmt: skip
    LOG.parent.mkdir(exist_ok=True)
    with ThreadPoolExecutor(given.jobs) as pool, LOG.open("a", encoding="utf-8") as log:
        for line in pool.map(partial(_of, faults, not given.likely), left):
            print(json.dumps(line), file=log, flush=True)
            print(f"{line['fault']:24}{line['seconds']:6} s  {line['found_by'] or 'SURVIVED'}", flush=True)
    lines = [line for name, line in known().items() if name in names]
    doubtful = control(sorted({line["found_by"] for line in lines if line["found_by"]}))
    for line in lines:
        doubt = "fails without the fault, too: " if line["found_by"] in doubtful else ""
        print(f"| {line['fault']} | {doubt}{line['found_by'] or 'survived'} | {line['seconds']} |")
    found = [line for line in lines if line["found_by"] and line["found_by"] not in doubtful]
    print(f"{len(found)} of {len(lines)} faults are found")


def _of(faults: dict[str, Fault], is_whole: bool, name: str) -> dict[str, Any]:
    return tried(name, faults[name], is_whole)


if __name__ == "__main__":
    main()
