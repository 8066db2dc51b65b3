"""The ledger's file, an SQLite database: created whole, checked before use, written in transactions."""

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from leg_wear_monitor.errors import LegWearError, one_line
from leg_wear_monitor.monitor.ledger.entry import Binding
from leg_wear_monitor.monitor.ledger.rows import FORMAT, create_tables

REMEDY = "move it away to begin with new parts, or put a copy of it back"  # ends messages about damage

_MODE = 0o640  # mode of new files, reduced by the umask
# Damage shows as an error of SQLite, or as a value that cannot be read.
_DAMAGE = (sqlite3.Error, ValueError, TypeError, LookupError, EOFError)
_NOT_WRITABLE = (
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_CANTOPEN,
)


class LedgerError(LegWearError):
    """A ledger cannot be used."""


def connect(path: Path, binding: Binding) -> sqlite3.Connection:
    """Open or create a ledger, and lock it until the connection is closed.

    Parameters
    ----------
    path : pathlib.Path
    binding : Binding
        The leg that the ledger must belong to.

    Raises
    ------
    LedgerError
        If the file is damaged, not a ledger, of a different leg, in use, or cannot be written.
    """
    if not os.path.lexists(path):
        _create(path, binding)
    if not path.is_file():
        raise LedgerError(f"{path}: cannot be opened: it is not a file")
    with damage_refused(path):
        db = _connect(path, "rw")
    try:
        with damage_refused(path):
            _lock_and_check(db, path, binding)
    except BaseException:
        db.close()
        raise
    return db


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """A transaction: data written within the context are on the disk at its end, or not at all."""
    db.execute("BEGIN EXCLUSIVE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise


@contextmanager
def damage_refused(path: Path) -> Iterator[None]:
    """Report in one line why a file is unusable."""
    try:
        yield
    except _DAMAGE as error:
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
        if code == sqlite3.SQLITE_BUSY:
            fault = "is in use by another monitor. End that monitor, or set a different ledger.path"
        elif code in _NOT_WRITABLE:
            fault = f"cannot be written: {one_line(error)}. Expected a writable disk"
        else:
            fault = f"is damaged or not a ledger: {one_line(error)}; {REMEDY}"
        raise LedgerError(f"{path}: {fault}") from error


def hardware_id_of(path: Path) -> str:
    """Hardware id that a ledger belongs to; empty if it cannot be read: `connect` then says why."""
    if not path.is_file():
        return ""
    try:
        with closing(_connect(path, "ro")) as db:
            row = db.execute("SELECT value FROM binding WHERE key = 'hardware_id'").fetchone()
    except sqlite3.Error:
        return ""
    return str(row[0]) if row else ""


@contextmanager
def copy_of(path: str | Path) -> Iterator[Path]:
    """Copy a ledger into a temporary directory, to try a change, or to read it while a monitor has it locked.

    The yielded path has no file if there is no ledger.

    Raises
    ------
    LedgerError
        If the ledger cannot be read. A LedgerError about the copy is raised again, about the ledger itself.
    """
    original = Path(path)
    with tempfile.TemporaryDirectory(prefix="leg_wear_") as place:
        copy = Path(place) / original.name
        try:
            for ending in ("", "-journal"):  # the journal undoes an interrupted transaction
                source = original.with_name(original.name + ending)
                if source.exists():
                    shutil.copyfile(source, copy.with_name(copy.name + ending))
        except OSError as error:
            raise LedgerError(f"{original}: cannot be read: {error.strerror}") from error
        try:
            yield copy
        except LedgerError as error:
            raise LedgerError(str(error).replace(str(copy), str(original))) from error


def _create(path: Path, binding: Binding) -> None:
    """Create a ledger without wear; even if this is cut off, the path has no ledger or a complete one."""
    new = path.with_name(f"{path.name}.new")
    try:
        new.unlink(missing_ok=True)
        os.close(os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _MODE))
        with closing(_connect(new, "rw")) as db, transaction(db):
            create_tables(db)
            db.executemany("INSERT INTO binding VALUES (?, ?)", binding.as_texts().items())
        new.rename(path)
    except (sqlite3.Error, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else one_line(error)
        raise LedgerError(f"{path}: cannot be created: {reason}. Expected a writable place") from error


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Connection to a file that is not checked; ``mode``, such as ``ro``, is an SQLite URI's."""
    db = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=0.5,  # seconds to wait for a lock of a different process
        isolation_level=None,  # transactions begin where this module begins them
        # the node's executor may call from a different thread than the one that opened it, never from two at
        # once
        check_same_thread=False,
    )
    db.execute("PRAGMA synchronous = EXTRA")  # a transaction survives a power cut once it has ended
    # The lock lasts until the connection is closed; after a kill, the system releases it.
    db.execute("PRAGMA locking_mode = EXCLUSIVE")
    return db


def _lock_and_check(db: sqlite3.Connection, path: Path, binding: Binding) -> None:
    """Lock a file, and check that it is sound, has this version's tables, and is of this leg."""
    with transaction(db):  # the lock outlasts it, see `_connect`
        if _tables(db) != _expected_tables() or db.execute("PRAGMA user_version").fetchone() != (FORMAT,):
            raise LedgerError(
                f"{path}: is not a ledger of format {FORMAT}, the only one that this version knows; use the "
                "version that wrote it, or move it away to begin with new parts"
            )
        faults = [fault for (fault,) in db.execute("PRAGMA integrity_check")]
        if faults != ["ok"]:
            raise ValueError(faults[0])
        _check_binding(db, path, binding)


def _tables(db: sqlite3.Connection) -> tuple[tuple[str, str], ...]:
    """Names and definitions of everything in a file, triggers and views included."""
    return tuple(db.execute("SELECT name, sql FROM sqlite_master ORDER BY name"))


def _expected_tables() -> tuple[tuple[str, str], ...]:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        create_tables(db)
        return _tables(db)


def _check_binding(db: sqlite3.Connection, path: Path, binding: Binding) -> None:
    """Refuse the ledger of a different leg, or with other parameters of this leg."""
    found = dict(db.execute("SELECT key, value FROM binding"))
    for key, ours in binding.as_texts().items():
        if found.get(key) != ours:
            what = f"{path}: belongs to {key.replace('_', ' ')} {found.get(key)}, not {ours}; "
            if key == "hardware_id":
                what += f"if it is the ledger of this leg, set {key}: {found.get(key)}, otherwise "
            raise LedgerError(
                what
                + "set ledger.path to a different file for this leg, or the parameters back to the former leg"
            )
