"""Fleets: updates killed at random instants, files damaged, names, links and copies that mislead."""

import random
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from functools import cache, partial
from pathlib import Path

import pyarrow  # noqa: F401 - without it, the family is left out
from short_walk import torque_of_a_cycle, write_walk

from campaign.case import Case, Outcome
from campaign.child import done
from campaign.warm_twin import keep_twin
from leg_wear_monitor import load_mechanism
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.fleet.description import load_fleet
from leg_wear_monitor.fleet.directory import LegDirectory
from leg_wear_monitor.fleet.overview import load_overview
from leg_wear_monitor.fleet.update import update_fleet

KILLS = 3  # in each case of kills
SHORT, LONG = 7, 140

_LEGS = ("a", "b")
_UPDATE = ("fleet", "update", "fleet.yaml", "--workers", "1")
_NAMES = "\x1b]0;x\x07", "\n", "\u202e", "'\"<&", "\udcff\udcfe", "[*]", "é" * 60, "-rf", " "


@cache
def _walks() -> Path:
    """A fleet with its recordings: names that do not sort by time, one truncated, one that is none."""
    home, cycle = Path(tempfile.mkdtemp(prefix="fleets_")), torque_of_a_cycle(load_mechanism())
    for number, leg in enumerate(_LEGS):
        write_walk(cycle, home / leg / "z.mcap", seed=2 * number)
        whole = write_walk(cycle, home / leg / "y.mcap", begin_s=100.0, seed=2 * number + 1)
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size * 7 // 8])
    (home / "b/trash.mcap").write_bytes(b"no recording")
    entries = "".join(f'  - {{id: {leg}, recordings: "{leg}/**", lot: x}}\n' for leg in _LEGS)
    (home / "fleet.yaml").write_text(f"legs:\n{entries}")
    return home


def warm() -> None:
    """Write the recordings, and build the twin that all updates take."""
    keep_twin()
    _walks()


def case(seed: int) -> Case:
    """A case of one of the kinds."""
    name, kind = list(_KINDS.items())[seed % len(_KINDS)]
    return Case(
        description=name,
        prepare=lambda directory: shutil.copytree(_walks(), directory, dirs_exist_ok=True),
        run=lambda directory: kind(directory, random.Random(seed)),
        seconds=300.0,
    )


# --- kinds ---


def _kills(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """An update is killed, repeated, killed and ended."""
    return _killed(directory, choose, lambda out: None)


def _kills_of_workers(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """So is one with two workers, which end with it."""
    return _killed(directory, choose, lambda out: None, workers=2)


def _kills_after_a_measurement(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """So is one that only renews forecasts."""
    _update(directory, directory / "first")
    line = ["measure", "A", "0.31", "--sigma", "0.001", "--ledger", str(directory / "first/legs/a/ledger")]
    _command(*line)
    return _killed(directory, choose, lambda out: shutil.copytree(directory / "first", out))


def _killed(
    directory: Path, choose: random.Random, begin: Callable[[Path], object], workers: int = 1
) -> tuple[Outcome, str]:
    whole, out, after = directory / "whole", directory / "killed", []
    begin(whole)
    began = time.perf_counter()
    _update(directory, whole, workers=workers)
    took_s = time.perf_counter() - began
    begin(out)
    for _ in range(KILLS):
        after.append(round(choose.uniform(0.0, 1.05) * took_s, 3))
        _update(directory, out, after[-1], workers)
    _update(directory, out)
    expected, found = _contents(whole), _contents(out)
    wrong = sorted(name for name in expected | found if expected.get(name) != found.get(name))
    text = f"killed after {after} s of {took_s:.2f} s"
    return (Outcome.SILENT, f"{text}: other {wrong}") if wrong else (Outcome.SOUND, text)


def _names(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """Recordings with names that mislead a terminal, a pattern or JSON."""
    for number in range(3):
        name = "".join(choose.sample(_NAMES, 2)) + f"{number}.mcap"
        source = directory / "a" / ("z.mcap" if number else "y.mcap")
        if number == 1:
            source = directory / "b/trash.mcap"
        shutil.copy(source, directory / "a" / name)
    return _counted_once(directory)


def _links(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """Links that lead back, in all directories."""
    for _ in range(choose.randint(2, 12)):
        places = [path for path in directory.rglob("*") if path.is_dir() and not path.is_symlink()]
        place = choose.choice([each for each in places if each.is_relative_to(directory / "a")])
        (place / f"link{choose.random()}").symlink_to(choose.choice([directory / "a", place, place / "no"]))
        (place / f"deeper{choose.random()}").mkdir()
    return _counted_once(directory)


def _copies(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """Copies before and after their original was counted: each has its line in the log."""
    out, expected = directory / "out", 0
    for _ in range(3):
        for _ in range(choose.randint(0, 2)):
            original = choose.choice(sorted((directory / "a").iterdir()))
            shutil.copy(original, directory / "a" / f"{choose.random()}.mcap")
            expected += 1
        _update(directory, out)
    lines = (out / "legs/a/log").read_text().splitlines()
    found = sum("is a copy of" in line for line in lines)
    if found != expected or len(lines) != expected + 2:
        return Outcome.SILENT, f"{found} of {expected} copies in the log"
    return _counted_once(directory)


def _damage(directory: Path, choose: random.Random) -> tuple[Outcome, str]:
    """A file of an updated fleet is damaged: refused, said, or made again as it was."""
    out = directory / "fleet"
    _update(directory, out)
    before = _contents(out)
    path = choose.choice([each for each in sorted(out.rglob("*")) if each.is_file() and each.stat().st_size])
    raw = bytearray(path.read_bytes())
    for _ in range(choose.randint(1, 4)):
        raw[choose.randrange(len(raw))] = choose.randrange(256)
    if choose.random() < 0.3:
        del raw[choose.randrange(len(raw)) :]
    path.write_bytes(raw)
    code = _command(*_UPDATE)  # a refusal is judged by its one line
    after, name = _contents(out), str(path.relative_to(out))
    changed = [each for each in before if after.get(each) != before[each] and each != name]
    if changed and not code:
        return Outcome.SILENT, f"{name} damaged, and other {changed}"
    return (Outcome.REPORTED if code else Outcome.SOUND), f"{name} damaged, exit code {code}"


_KINDS: dict[str, Callable[[Path, random.Random], tuple[Outcome, str]]] = {
    "update killed": _kills,
    "names": _names,
    "links": _links,
    "copies": _copies,
    "damage": _damage,
    "renewal killed": _kills_after_a_measurement,
    "update with workers killed": _kills_of_workers,
}


# --- what they share ---


def _counted_once(directory: Path) -> tuple[Outcome, str]:
    """Whether an update counts each content once, and all that it writes is legible."""
    out = directory / "out"
    _update(directory, out)
    health = load_overview(out).leg("a").recordings
    lines = [each for leg in _LEGS for each in LegDirectory(out, leg).lines()]
    texts = [line["file"] for line in lines] + (out / "legs/a/log").read_text().split("\n")
    if health.counted != 2 or not all(text.isprintable() for text in texts):
        return Outcome.SILENT, f"{health.counted} of 2 counted; {texts}"
    return Outcome.SOUND, f"{health.found} found, {health.counted} counted"


def _command(*line: str) -> int:
    """Exit code of a command line, which prints as a user would see it; a refusal ends the case."""
    try:
        cli.main([*line], prog_name="leg-wear-monitor")
    except SystemExit as end:
        if end.code == 2:
            raise
        return int(end.code or 0)
    return 0


def _update(directory: Path, out: Path, kill_after_s: float | None = None, workers: int = 1) -> None:
    """Update in a process of its own, which may be killed."""
    fleet = load_fleet(directory / "fleet.yaml")
    done(partial(update_fleet, fleet, out, workers=workers), kill_after_s)


def _contents(out: Path) -> dict[str, object]:
    """All files of a fleet by name; ledgers by their rows, since their pages need not have one order."""
    found: dict[str, object] = {}
    for path in sorted(out.rglob("*")):
        if not path.is_file() or path.name in (".lock", "ledger-journal"):  # applied below, or empty
            continue
        found[str(path.relative_to(out))] = _rows(path) if path.name == "ledger" else path.read_bytes()
    return found


def _rows(path: Path) -> object:
    try:
        with closing(sqlite3.connect(path)) as db:
            return sorted(db.iterdump())  # a process writes rows of equal rank in an order of its own
    except (sqlite3.Error, UnicodeDecodeError) as error:
        return str(error)
