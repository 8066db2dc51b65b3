"""Checksums over the whole content of a ledger, since SQLite has none over its pages.

Each table has a seal: a checksum over its rows. The head is a checksum over the seals, the tables'
definitions and the previous head, so that all entries form one chain. The checksums protect against damage
and mix-ups, not against somebody who computes them again.
"""

import hashlib
import sqlite3

import attrs

from leg_wear_monitor.monitor.ledger.schema import CHANGING, GROWING, definitions

_Seals = dict[str, tuple[int, bytes]]


@attrs.frozen
class Head:
    """The last transaction.

    Attributes
    ----------
    number : int
        Number of the transaction.
    previous, digest : bytes
        Checksum of the previous head, and of this one.
    """

    number: int
    previous: bytes
    digest: bytes


def read_head(db: sqlite3.Connection) -> Head:
    """Read the head of a verified file."""
    return Head(*db.execute("SELECT number, previous, digest FROM head").fetchone())


def write_head(db: sqlite3.Connection, number: int, previous: bytes) -> Head:
    """Write the checksums at the end of a transaction.

    Parameters
    ----------
    db : sqlite3.Connection
    number : int
        Number of the previous head plus one.
    previous : bytes
        Checksum of the previous head.
    """
    seals = _seals(db, {name: (last, digest) for name, last, digest in db.execute("SELECT * FROM seal")})
    head = Head(number, previous, _digest(db, number, previous, seals))
    rows = [(name, *seal) for name, seal in seals.items()]
    db.executemany("INSERT OR REPLACE INTO seal VALUES (?, ?, ?)", rows)
    db.execute("INSERT OR REPLACE INTO head VALUES (1, ?, ?, ?)", attrs.astuple(head))
    return head


def verify(db: sqlite3.Connection) -> None:
    """Compare all rows with their checksums.

    Raises
    ------
    ValueError
        If a checksum does not match.
    """
    kept = {name: (last, digest) for name, last, digest in db.execute("SELECT * FROM seal")}
    found = _seals(db, {})
    for name, seal in found.items():
        if kept.get(name) != seal:
            raise ValueError(f"the checksum of its table {name} is not that of the rows")
    heads = db.execute("SELECT number, previous, digest FROM head").fetchall()
    if len(heads) != 1 or len(kept) != len(found):
        raise ValueError("it has not one head and a checksum of each table")
    number, previous, digest = heads[0]
    if _digest(db, number, previous, found) != digest:
        raise ValueError("the checksum over all its tables is not that of their content")


def _seals(db: sqlite3.Connection, kept: _Seals) -> _Seals:
    """Seals of all tables; those of tables that only grow are continued from the kept ones.

    A file of an older format has fewer tables; its definitions are compared elsewhere.
    """
    there = {name for _, name, *_ in definitions(db)}
    seals = {name: _sealed(db, name, "", 0, b"") for name in CHANGING if name in there}
    for name in there.intersection(GROWING):
        last, digest = kept.get(name, (0, b""))
        seals[name] = _sealed(db, name, f"WHERE id > {int(last)}", last, digest)
    return seals


def _sealed(db: sqlite3.Connection, name: str, which: str, last: int, digest: bytes) -> tuple[int, bytes]:
    for row in db.execute(f"SELECT * FROM {name} {which} ORDER BY rowid"):
        digest = hashlib.sha256(digest + repr(row).encode()).digest()
        if name in GROWING:
            last = row[0]
    return last, digest


def _digest(db: sqlite3.Connection, number: int, previous: bytes, seals: _Seals) -> bytes:
    content = (number, previous, definitions(db), sorted(seals.items()))
    return hashlib.sha256(repr(content).encode()).digest()
