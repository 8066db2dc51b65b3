"""The ledger's file: created whole or not at all, checked before it is believed, written in transactions."""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.binding import Binding
from leg_wear_monitor.monitor.ledger_schema import APPLICATION_ID, FORMAT, MIGRATIONS

MOVE = "move it away to begin with new parts, or put a copy of it back"


class LedgerError(LegWearError):
    """A ledger that cannot be continued; it is left as it is."""


def create(path: Path, binding: Binding) -> None:
    """Create a ledger; at any instant there is none at the path or a whole one.

    Raises
    ------
    LedgerError
    """
    new = path.with_name(path.name + ".new")
    try:
        new.unlink(missing_ok=True)
        with closing(_connect(new, "rwc")) as db, transaction(db):
            db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            _migrate(db, 0)
            db.executemany("INSERT INTO binding VALUES (?, ?)", binding.as_texts().items())
        new.rename(path)
        _sync_directory(path.parent)
    except (sqlite3.Error, OSError) as error:
        raise LedgerError(
            f"{path}: cannot be created: {_reason(error)}; expected a writable place"
        ) from error


def connect(path: Path, binding: Binding) -> sqlite3.Connection:
    """Open a ledger for this hardware and mechanism alone; nobody else can while it is open.

    On a disk that is read-only it can be read, and every write fails.

    Raises
    ------
    LedgerError
        If it is damaged, none, of a newer format, of something else, or in use.
    """
    try:
        if path.stat().st_size == 0:
            raise LedgerError(f"{path}: is empty, not a ledger; {MOVE}")
        db = _connect(path, "rw" if _is_writable(path) else "ro&immutable=1")
    except (sqlite3.Error, OSError) as error:
        raise LedgerError(f"{path}: cannot be opened: {_reason(error)}") from error
    try:
        # Held until it is closed, by the system even after a kill; and WAL needs no shared memory then.
        db.execute("PRAGMA locking_mode = EXCLUSIVE")
        db.execute("PRAGMA synchronous = FULL")
        _check(db, path)
        _check_binding(db, path, binding)
    except sqlite3.Error as error:
        db.close()
        raise _refusal(path, error) from error
    except LedgerError:
        db.close()
        raise
    return db


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """All of it or nothing; on the disk when it is left."""
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    # The node's executor may call from another thread than the one that opened it, never from two at once.
    return sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=0.5,
        isolation_level=None,
        check_same_thread=False,
    )


def _check(db: sqlite3.Connection, path: Path) -> None:
    """Whether the file is a ledger, whole, and of a format that we know; an older one is migrated."""
    if db.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise LedgerError(f"{path}: is an SQLite file, but not a ledger; {MOVE}")
    found = db.execute("PRAGMA user_version").fetchone()[0]
    if found > FORMAT:
        raise LedgerError(
            f"{path}: has format {found}, this version knows up to {FORMAT}; install a newer one"
        )
    faults = [fault for (fault,) in db.execute("PRAGMA integrity_check")]
    if faults != ["ok"]:
        raise LedgerError(f"{path}: is damaged: {' '.join(faults[0].split())}; {MOVE}")
    db.execute("PRAGMA journal_mode = WAL")
    if found < FORMAT:
        with transaction(db):
            _migrate(db, found)


def _migrate(db: sqlite3.Connection, found: int) -> None:
    for step in MIGRATIONS[found:]:
        for statement in step.split(";\n"):
            if statement.strip():
                db.execute(statement)
    db.execute(f"PRAGMA user_version = {FORMAT}")


def _check_binding(db: sqlite3.Connection, path: Path, binding: Binding) -> None:
    found = dict(db.execute("SELECT key, value FROM binding"))
    for key, ours in binding.as_texts().items():
        if found.get(key) != ours:
            raise LedgerError(
                f"{path}: is of {key.replace('_', ' ')} {found.get(key)}, not {ours}; "
                "set ledger.path to another file for this leg, or the parameters back to that one"
            )


def _refusal(path: Path, error: sqlite3.Error) -> LedgerError:
    if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
        return LedgerError(f"{path}: is in use by another monitor; end that one, or set another ledger.path")
    if error.sqlite_errorcode & 0xFF in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
        return LedgerError(f"{path}: is damaged or not a ledger: {_reason(error)}; {MOVE}")
    return LedgerError(f"{path}: cannot be read: {_reason(error)}; expected a disk that can be written")


def _is_writable(path: Path) -> bool:
    """Whether it is, or must be since the last entries are still beside it."""
    log = path.with_name(path.name + "-wal")
    return all(os.access(place, os.W_OK) for place in (path, path.parent)) or log.exists()


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _sync_directory(directory: Path) -> None:
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
