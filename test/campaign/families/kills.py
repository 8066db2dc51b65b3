"""Replays killed at random instants and repeated: ledger, reports and summary as if nothing had happened."""

import json
import random
import sqlite3
import tempfile
import time
from contextlib import closing
from functools import cache, partial
from pathlib import Path
from typing import Any

import attrs

from campaign.case import Case, Outcome
from campaign.child import done
from campaign.warm_twin import keep_twin

KILLS = 2  # in each case
SHORT, LONG = 3, 50

_BAG = Path(__file__).parents[3] / "bags" / "healthy.mcap"
_KNOCKING = _BAG.with_name("knocking.mcap")
_KINDS = ("a new ledger", "a ledger with another recording in it", "the ledger of a live run that was killed")


def warm() -> None:
    """Make the ledgers, and what uninterrupted replays into them give."""
    keep_twin()
    _whole(0)
    for kind in range(len(_KINDS)):
        _whole(kind)


def case(seed: int) -> Case:
    """Kills, and the replay to its end."""
    kind = seed % len(_KINDS)
    return Case(
        description=f"kills of a replay into {_KINDS[kind]}",
        prepare=lambda directory: _begun(kind, directory),
        run=lambda directory: _killed(directory, kind, random.Random(seed)),
        seconds=300.0,
    )


def _killed(directory: Path, kind: int, choose: random.Random) -> tuple[Outcome, str]:
    whole, after = _whole(kind), []
    for _ in range(KILLS):
        delay_s = whole.took_s * choose.uniform(0.0, 1.1)
        if done(partial(_replay, directory), delay_s):
            break
        after.append(round(delay_s, 3))
        if _is_done(directory, whole):
            break
    if not _is_done(directory, whole):
        done(partial(_replay, directory))
    found = _result(directory)
    wrong = [name for name, value in attrs.asdict(whole).items() if found.get(name, value) != value]
    text = f"killed after {after} s"
    return (Outcome.SILENT, f"{text}: other {wrong}") if wrong else (Outcome.SOUND, text)


def _is_done(directory: Path, whole: "_Whole") -> bool:
    """Whether the last one came to its end: what was killed then was Python on its way out."""
    return (directory / "wear.ledger").exists() and _rows(directory / "wear.ledger") == whole.rows


def _replay(directory: Path) -> None:
    import leg_wear_monitor as lw

    out = directory / "out"
    lw.replay(
        _BAG,
        ledger=directory / "wear.ledger",
        out=out,
        finish=lambda result: (out / "summary.json").write_text(result.summary().to_json()),
    )


# --- what an uninterrupted one gives ---


@attrs.frozen
class _Whole:
    """Rows of the ledger, reports, summary; and how long it took [s]."""

    rows: list[str]
    reports: bytes
    summary: Any
    took_s: float = attrs.field(eq=False)


@cache
def _whole(kind: int) -> _Whole:
    with tempfile.TemporaryDirectory() as place:
        directory = Path(place)
        _begun(kind, directory)
        began = time.perf_counter()
        done(partial(_replay, directory))
        return _Whole(**_result(directory), took_s=time.perf_counter() - began)


def _result(directory: Path) -> dict[str, Any]:
    summary = json.loads((directory / "out" / "summary.json").read_text())
    reports = (directory / "out" / "reports.mcap").read_bytes()
    return {"rows": _rows(directory / "wear.ledger"), "reports": reports, "summary": summary}


def _rows(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as db:
        return list(db.iterdump())


def _begun(kind: int, directory: Path) -> None:
    """The ledger that is there before."""
    for name, content in _ledger(kind).items():
        (directory / name).write_bytes(content)


@cache
def _ledger(kind: int) -> dict[str, bytes]:
    if kind == 0:
        return {}
    import leg_wear_monitor as lw
    from leg_wear_monitor.bags.reader import Recording
    from leg_wear_monitor.monitor.config.parameters import config_from

    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "wear.ledger"
        if kind == 1:
            lw.replay(_KNOCKING, ledger=path)
        else:  # of the very walk of the recording: the replay makes up for what was lost
            config = config_from({"ledger.path": str(path), "ledger.checkpoint_s": 1.0})
            leg = lw.load_mechanism(config.mechanism)
            monitor = lw.WearMonitor(leg, config, ledger := lw.open_ledger(leg, config))
            with Recording([_BAG], config) as recording:
                for block in recording.blocks():
                    for at in range(0, len(block.samples) // 2, 100):
                        monitor.update(block.samples[at : at + 100])
            if ledger is not None:
                ledger.close()  # as a kill leaves it
        return {each.name: each.read_bytes() for each in path.parent.iterdir()}
