"""Damaged ledgers: refused in a line and left alone, or as if whole.

A ledger of three runs is made, its last one killed. Whatever is opened has to hold what was kept last.
"""

import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing
from functools import cache
from pathlib import Path

import attrs
import numpy as np
from ledger_contents import contents, keep_journal

from campaign.case import Case, Outcome

SHORT, LONG = 52, 520

_NAME = "wear.ledger"
_SECOND = 10**9


def warm() -> None:
    """Make the ledger."""
    _made()


@attrs.frozen
class _Made:
    """Files of a killed ledger, of it as it was closed before, and what they hold."""

    killed: dict[str, bytes]
    closed: dict[str, bytes]
    earlier: dict[str, bytes]
    last: dict[str, str]


def case(seed: int) -> Case:
    """One damage."""
    rng = np.random.default_rng(seed)
    state = ("killed", "closed")[seed // len(_DAMAGES) % 2]
    damage = _DAMAGES[seed % len(_DAMAGES)]
    notes: list[str] = []

    def prepare(directory: Path) -> None:
        for name, content in getattr(_made(), state).items():
            (directory / name).write_bytes(content)
        notes.append(damage(directory, rng))

    return Case(
        description=f"{damage.__name__.strip('_')} in one that was {state}",
        prepare=prepare,
        run=lambda directory: _opened(directory, state),
        seconds=30.0,
    )


def _opened(directory: Path, state: str) -> tuple[Outcome, str]:
    """What opening does."""
    from leg_wear_monitor.monitor.ledger.file import LedgerError

    made, path = _made(), directory / _NAME
    before = {each.name: each.read_bytes() for each in directory.iterdir() if each.is_file()}
    try:
        ledger = _open(path)
    except LedgerError as error:
        text = str(error)
        after = {each.name: each.read_bytes() for each in directory.iterdir() if each.is_file()}
        if "\n" in text or "Traceback" in text:
            return Outcome.CRASH, f"not one line: {text}"
        if after != before:
            changed = sorted(name for name in {*before, *after} if before.get(name) != after.get(name))
            return Outcome.SILENT, f"refused, but {changed} changed: {text}"
        return Outcome.REFUSED, text.replace(str(directory), "")
    try:
        if _state(ledger) != made.last[state]:
            return Outcome.SILENT, "not what was kept last"
        return Outcome.SOUND, ""
    finally:
        ledger.close()


# --- the ledger ---


def _open(path: Path):  # type: ignore[no-untyped-def]
    from leg_wear_monitor.monitor.ledger.entry import Binding
    from leg_wear_monitor.monitor.ledger.ledger import Ledger

    binding = Binding(hardware_id="leg-7", mechanism="bionic_leg", fingerprint="00ff", joints=("A", "B"))
    return Ledger(path, binding, interval_s=5.0)


def _state(ledger) -> str:  # type: ignore[no-untyped-def]
    """All that a monitor takes from a ledger."""

    parts = (
        contents(ledger.entry),
        ledger.counted_ns.tolist(),
        ledger.measurements,
        (ledger.epoch, ledger.boot_id),
        [reset.stamp_ns if (reset := ledger.last_reset(name)) else 0 for name in "AB"],
    )
    return repr(parts)


@cache
def _made() -> _Made:
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / _NAME
        _walk(path, 0, closed=True)
        earlier = _files(path)
        _walk(path, 1, closed=True)
        closed = _files(path)
        _walk(path, 2, closed=False)
        killed = _files(path)
    return _Made(killed, closed, earlier, {"closed": _seen(closed), "killed": _seen(killed)})


def _walk(path: Path, run: int, closed: bool) -> None:
    """A run of nine entries with some events."""
    from leg_wear_monitor.monitor.ledger.entry import Audit, ClearancePoint, Measurement

    ledger = _open(path)
    for step in range(9):
        ledger.keep(entry := _entry(run, step), whole=step == 4)
        if step == 3:
            ledger.note(ClearancePoint(entry.stamp_ns, 7, "A", 3.0e-4, 4.0e-4))
            ledger.note(Audit(entry.stamp_ns, "ann", "reset_wear", entry.joints[0]))
            ledger.note(Measurement(run, "A", "ann", 3e-4, 1e-6, 1e-5, 3, 0, 0.3, True))
    if closed:
        ledger.keep(entry, closed=True)
    ledger.close()


def _entry(run: int, step: int):  # type: ignore[no-untyped-def]
    from leg_wear_monitor.monitor.alarms import Alarm
    from leg_wear_monitor.monitor.ledger.entry import Entry, JointWear
    from leg_wear_monitor.state import Level

    n = 9 * run + step + 1
    depth = np.random.default_rng(7).random((2, 2, 720)) * 1.0e-10 * n
    return Entry(
        stamp_ns=(5 * n + 100 * run) * _SECOND,
        joints=tuple(JointWear(name, depth[k], 5 * n, 5.0 * n, k) for k, name in enumerate("AB")),
        totals={"cycles": 5.0 * n, "moving_s": 5.0 * n},
        alarms=(Alarm(kind="clearance", subject="A", level=Level.WARN),),
        spans=(((5 * 9 * run + 100 * run) * _SECOND, (5 * n + 100 * run) * _SECOND, 0),),
    )


def _files(path: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in path.parent.iterdir()}


def _seen(files: dict[str, bytes]) -> str:
    """What files hold."""
    with tempfile.TemporaryDirectory() as place:
        for name, content in files.items():
            (Path(place) / name).write_bytes(content)
        ledger = _open(Path(place) / _NAME)
        found = _state(ledger)
        ledger.close()
    return found


# --- damages: each is given the directory and random numbers, and says what it did ---

_Damage = Callable[[Path, np.random.Generator], str]


def _in_file(name: str) -> Callable[[Callable[[bytearray, np.random.Generator], None]], _Damage]:
    """A damage of the bytes of one file, if it is there."""

    def made(change: Callable[[bytearray, np.random.Generator], None]) -> _Damage:
        def damage(directory: Path, rng: np.random.Generator) -> str:
            path = directory / name
            content = bytearray(path.read_bytes() if path.exists() else b"")
            if content:
                change(content, rng)
                path.write_bytes(content)
            return name

        damage.__name__ = f"{change.__name__} of {name}"
        return damage

    return made


def _bit(content: bytearray, rng: np.random.Generator) -> None:
    content[rng.integers(len(content))] ^= 1 << int(rng.integers(8))


def _bit_of_the_head(content: bytearray, rng: np.random.Generator) -> None:
    content[rng.integers(min(200, len(content)))] ^= 1 << int(rng.integers(8))


def _cut(content: bytearray, rng: np.random.Generator) -> None:
    del content[rng.integers(len(content)) :]


def _zeros(content: bytearray, rng: np.random.Generator) -> None:
    at = int(rng.integers(len(content)))
    content[at : at + 512] = bytes(len(content[at : at + 512]))


def _noise(content: bytearray, rng: np.random.Generator) -> None:
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 2000))
    content[at : at + size] = rng.bytes(len(content[at : at + size]))


def _more(content: bytearray, rng: np.random.Generator) -> None:
    content += rng.bytes(int(rng.integers(1, 5000)))


def _pages_exchanged(content: bytearray, rng: np.random.Generator) -> None:
    pages = len(content) // 512
    if pages > 1:
        a, b = (512 * int(at) for at in rng.choice(pages, 2, replace=False))
        content[a : a + 512], content[b : b + 512] = content[b : b + 512], content[a : a + 512]


def _part_twice(content: bytearray, rng: np.random.Generator) -> None:
    at = int(rng.integers(len(content)))
    content[at:at] = content[at : at + int(rng.integers(1, 3000))]


def _part_missing(content: bytearray, rng: np.random.Generator) -> None:
    at = int(rng.integers(len(content)))
    del content[at : at + int(rng.integers(1, 3000))]


def _nothing(content: bytearray, _rng: np.random.Generator) -> None:
    content.clear()


def _sql(directory: Path, rng: np.random.Generator) -> str:
    """A value changed, a row gone, or something planted, by SQLite itself."""
    tables = (
        "span", "run", "joint", "surface", "total", "alarm", "audit", "measurement", "history", "entry",
        "binding",
    )  # fmt: skip
    table = tables[rng.integers(len(tables))]
    statements = (
        f"DELETE FROM {table}",
        "UPDATE span SET end_ns = end_ns + 3600000000000",
        "UPDATE total SET value = value * 1.01",
        "UPDATE joint SET journal_m = journal_m * 1.01",
        f"CREATE TRIGGER t AFTER INSERT ON {table} BEGIN DELETE FROM span; END",
        "CREATE VIEW v AS SELECT * FROM run",
        f"DROP TABLE {table}",
        "PRAGMA user_version = 3",
        "PRAGMA user_version = 0",
        f"INSERT INTO {table} SELECT * FROM {table} WHERE 0",
    )
    with closing(sqlite3.connect(directory / _NAME, isolation_level=None)) as db:
        db.execute(statements[rng.integers(len(statements))])
    return ""


def _journal_of_another_time(directory: Path, _rng: np.random.Generator) -> str:
    copy = directory / "copy"
    copy.write_bytes(_made().earlier[_NAME])
    keep_journal(copy, directory / f"{_NAME}-journal")
    copy.unlink()
    return ""


def _journal_of_its_own(directory: Path, rng: np.random.Generator) -> str:
    """A transaction cut off; its journal whole, damaged, cut or gone."""
    kept, journal = directory / "kept", directory / f"{_NAME}-journal"
    keep_journal(directory / _NAME, kept, directory / "cut")
    shutil.move(directory / "cut", directory / _NAME)
    content = bytearray(kept.read_bytes())
    kept.unlink()
    change = (None, _bit, _cut, _noise, _nothing)[rng.integers(5)]
    if change:
        change(content, rng)
    journal.write_bytes(content)
    return ""


def _wal_beside(directory: Path, _rng: np.random.Generator) -> str:
    copy = directory / "copy"
    shutil.copy(directory / _NAME, copy)
    with closing(sqlite3.connect(copy, isolation_level=None)) as db:
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("DELETE FROM span")
        shutil.copy(directory / "copy-wal", directory / f"{_NAME}-wal")
    for name in ("copy", "copy-wal", "copy-shm"):
        (directory / name).unlink(missing_ok=True)
    return ""


_FILE = _in_file(_NAME)
_DAMAGES: tuple[_Damage, ...] = (
    *(_FILE(each) for each in (_bit, _bit, _bit_of_the_head, _cut, _zeros, _noise, _more)),
    *(_FILE(each) for each in (_pages_exchanged, _part_twice, _part_missing, _nothing)),
    _sql, _sql, _journal_of_another_time, _journal_of_its_own, _journal_of_its_own, _wal_beside,
)  # fmt: skip
