"""What an entry of a ledger holds, to the bit, to be compared; and a ledger in the midst of a transaction."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import attrs


def contents(entry: Any) -> object:
    """All of an entry, whatever the order of its joints and totals."""
    if entry is None:
        return None
    joints = sorted(attrs.astuple(attrs.evolve(j, depth=j.depth.tobytes())) for j in entry.joints)
    alarms = [(a.kind, a.subject, a.level, a.present, a.acknowledged, a.raised_ns) for a in entry.alarms]
    return entry.stamp_ns, joints, sorted(entry.totals.items()), sorted(alarms), entry.spans


def rows_of(path: Path, query: str) -> list[Any]:
    """What a query finds in a ledger."""
    with closing(sqlite3.connect(path)) as db:
        return db.execute(query).fetchall()


def cut_off(path: Path, copy: Path) -> None:
    """Copy a ledger and its journal in the midst of a transaction, as a power cut leaves them."""
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA cache_size = 1")
        db.execute("BEGIN")
        db.execute("UPDATE joint SET depth = zeroblob(length(depth))")
        db.execute("UPDATE run SET spans = '[]'")
        shutil.copy(f"{path}-journal", f"{copy}-journal")
        shutil.copy(path, copy)
        db.execute("ROLLBACK")
