"""What an entry of a ledger holds, to the bit, to be compared; and a ledger in the midst of a transaction."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.monitor.ledger.entry import Entry, Measurement


def contents(entry: Entry | None) -> object:
    """All of an entry, whatever the order of its joints and totals."""
    if entry is None:
        return None
    joints = sorted(attrs.astuple(attrs.evolve(j, depth=j.depth.tobytes())) for j in entry.joints)
    alarms = [(a.kind, a.subject, a.level, a.present, a.acknowledged, a.raised_ns) for a in entry.alarms]
    spans = entry.spans, entry.loads
    return entry.stamp_ns, joints, sorted(entry.totals.items()), sorted(alarms), spans


def measured(**own: Any) -> Measurement:
    """A measured clearance of joint A that counts, good to 2 µm, after 60 µm of counted wear."""
    usual = {"stamp_ns": 1, "joint": "A", "who": "ann", "clearance_m": 4.2e-4, "sigma_m": 2e-6}
    usual |= {"wear_m": 6e-5, "cycles": 9, "replaced_ns": 0, "expected_below": 0.5, "counts": True}
    return Measurement(**(usual | own))


def rows_of(path: Path, query: str) -> list[Any]:
    """What a query finds in a ledger."""
    with closing(sqlite3.connect(path)) as db:
        return db.execute(query).fetchall()


def keep_journal(path: Path, journal: Path, cut: Path | None = None) -> None:
    """Copy a ledger's journal, and the ledger, in the midst of a transaction, as a power cut leaves them."""
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA cache_size = 1")
        db.execute("BEGIN")
        db.execute("UPDATE surface SET depth = zeroblob(length(depth))")
        db.execute("UPDATE span SET end_ns = 1")
        shutil.copy(f"{path}-journal", journal)
        if cut:
            shutil.copy(path, cut)
        db.execute("ROLLBACK")
