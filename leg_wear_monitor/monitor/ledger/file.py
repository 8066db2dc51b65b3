"""The ledger's file: created completely or not at all, checked before use, written in transactions.

A ledger keeps the wear of a leg, its alarms and its history over runs of the monitor, in an SQLite database.
`schema` defines its tables, `rows` reads and writes them. Numbers of SQLite's file format are from
https://sqlite.org/fileformat2.html.
"""

import fcntl
import os
import shutil
import sqlite3
import stat
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.ledger import schema
from leg_wear_monitor.monitor.ledger.entry import Binding

REMEDY = "move it away to begin with new parts, or put a copy of it back"  # ends messages about damage

_MODE = 0o640  # mode of new files, reduced by the umask
# SQLite writes whole pages, and besides the surfaces an entry changes mostly single rows. With pages of 4096
# bytes and zeros over freed pages (secure_delete), an entry with surfaces wrote 328 kB instead of 80 kB.
_PAGE_BYTES = 512
_HEADER_BYTES = 100
_MAGIC = b"SQLite format 3\0"
_APPLICATION_AT, _FORMAT_AT = 68, 60  # bytes of the header: application id and user version, four each
_ROLLBACK = b"\1\1"  # bytes 18 and 19 of the header: a journal undoes transactions; 2 for a write-ahead log
# Bytes that SQLite locks, whether the file has them or not: https://sqlite.org/src/file?name=src/os.h
_LOCK_FIRST, _LOCK_SIZE = 0x40000002, 510
_IN_USE = "is in use by another monitor; end that one, or set another ledger.path"


class LedgerError(LegWearError):
    """A ledger cannot be used; its file is left unchanged."""


def beside(path: Path, ending: str) -> Path:
    """Path of a file beside a ledger, whose name has an ending such as ``-journal`` in addition."""
    return path.with_name(path.name + ending)


def create(path: Path, binding: Binding) -> None:
    """Create a ledger without wear; even if this is cut off, the path has no ledger or a complete one.

    Parameters
    ----------
    path : pathlib.Path
        A file there is replaced.
    binding : Binding
        The leg that the ledger belongs to.

    Raises
    ------
    LedgerError
        If it cannot be written.
    """
    new = beside(path, ".new")
    try:
        new.unlink(missing_ok=True)
        os.close(os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _MODE))
        with closing(_connect(new, "rw")) as db:
            db.execute(f"PRAGMA page_size = {_PAGE_BYTES}")
            with transaction(db):
                schema.create_tables(db)
                schema.replace(db, "binding", binding.as_texts().items())
        new.rename(path)
        _sync_directory(path)
    except (sqlite3.Error, OSError) as error:
        raise LedgerError(
            f"{path}: cannot be created: {_reason(error)}; expected a writable place"
        ) from error


def connect(path: Path, binding: Binding) -> sqlite3.Connection:
    """Open a ledger, check all of it, and lock others out until the connection is closed.

    On a read-only disk the ledger can be read, and every write fails.

    Parameters
    ----------
    path : pathlib.Path
    binding : Binding
        The leg that the ledger must belong to.

    Raises
    ------
    LedgerError
        If the file is damaged, not a ledger, of another format, of another leg, or in use.
    """
    try:
        _check_header(path)
        writable = _is_opened_to_write(path)
        # SQLite undoes an interrupted transaction as soon as it reads the file
        if _is_hot(beside(path, "-journal")):
            _recover_a_copy(path, binding)
        # immutable: nobody writes, so SQLite takes no lock
        db = _connect(path, "rw" if writable else "ro&immutable=1")
    except OSError as error:
        raise LedgerError(f"{path}: cannot be opened: {_reason(error)}") from error
    except (sqlite3.Error, ValueError) as error:
        raise _refusal(path, error) from error
    try:
        _lock_and_check(db, path, binding, writable)
    except BaseException:
        db.close()
        raise
    return db


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """A transaction: what is written within the context is on the disk at its end, or not at all."""
    db.execute("BEGIN EXCLUSIVE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise


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
            for ending in ("", "-journal", "-wal"):  # with what an interrupted transaction has left
                if beside(original, ending).exists():
                    shutil.copyfile(beside(original, ending), beside(copy, ending))
        except OSError as error:
            raise LedgerError(f"{original}: cannot be read: {error.strerror}") from error
        try:
            yield copy
        except LedgerError as error:
            raise LedgerError(str(error).replace(str(copy), str(original))) from error


def _sync_directory(path: Path) -> None:
    """Write the creation or removal of a file's name to the disk."""
    handle = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Connection to a file that is not checked; ``mode``, such as ``ro``, is that of an SQLite URI."""
    db = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=0.5,  # seconds to wait for a lock of another process
        isolation_level=None,  # transactions begin where this module begins them
        # the node's executor may call from another thread than the one that opened it, never from two at once
        check_same_thread=False,
    )
    db.execute("PRAGMA trusted_schema = OFF")  # SQL functions in a manipulated schema must not run
    db.execute("PRAGMA cell_size_check = ON")  # finds damaged pages as they are read
    db.execute("PRAGMA secure_delete = OFF")  # ON writes zeros over freed pages
    db.execute("PRAGMA temp_store = MEMORY")
    db.execute("PRAGMA synchronous = EXTRA")  # a transaction survives a power cut once it has ended
    # The lock lasts until the connection is closed; after a kill, the system releases it.
    db.execute("PRAGMA locking_mode = EXCLUSIVE")
    return db


def _check_header(path: Path) -> None:
    """Refuse what is not a ledger of this format by its header, before SQLite opens the file."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise LedgerError(f"{path}: cannot be opened: it is not a file")
    if status.st_size == 0:
        raise LedgerError(f"{path}: is empty, not a ledger; {REMEDY}")
    with path.open("rb") as file:
        header = file.read(_HEADER_BYTES)
    if not header.startswith(_MAGIC) or len(header) < _HEADER_BYTES:
        raise LedgerError(f"{path}: is damaged or not a ledger: it is not an SQLite file; {REMEDY}")
    application, found = (int.from_bytes(header[at : at + 4]) for at in (_APPLICATION_AT, _FORMAT_AT))
    if application == schema.UNRELEASED_ID:
        raise LedgerError(
            f"{path}: has the unreleased format {found}, this version knows only the released ones, up to "
            f"{schema.FORMAT}; go on with the version that wrote it, or move it away to begin with new parts"
        )
    if application != schema.APPLICATION_ID:
        raise LedgerError(f"{path}: is an SQLite file, but not a ledger; {REMEDY}")
    if found > schema.FORMAT:
        raise LedgerError(
            f"{path}: has format {found}, this version knows up to {schema.FORMAT}; install a newer one"
        )
    wal = beside(path, "-wal")
    if _has_content(wal):  # a ledger has no write-ahead log of its own
        raise LedgerError(f"{path}: {wal.name} beside it belongs to another ledger; move it away")
    # no format is below the first one
    if found != schema.FORMAT or header[18:20] != _ROLLBACK:
        raise LedgerError(f"{path}: is damaged: its header is not what was written; {REMEDY}")


def _recover_a_copy(path: Path, binding: Binding) -> None:
    """Undo an interrupted transaction in a copy, which must then be a sound ledger, before it is done here.

    The journal beside the ledger may be of another file, or of another time of it, as after a copy was put
    back. To undo that would damage the ledger.
    """
    with tempfile.TemporaryDirectory() as directory, _locked(path):
        copy = Path(directory) / path.name
        for ending in ("", "-journal"):
            shutil.copyfile(beside(path, ending), beside(copy, ending))
        try:
            with closing(_connect(copy, "rw")) as db:
                _lock_and_check(db, copy, binding, writable=True)
        except (sqlite3.Error, ValueError, LedgerError) as error:
            fault = error if isinstance(error, LedgerError) else _refusal(copy, error)
            # of that message only the reason: this one has another file and another remedy
            reason = str(fault).removeprefix(f"{copy}: ").removesuffix(f"; {REMEDY}")
            raise LedgerError(
                f"{path}: with {path.name}-journal beside it, it {reason}; that is of another file or time: "
                "move it away, or put a copy of both back"
            ) from error


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock others out as SQLite does, while SQLite itself does not have the file open."""
    with path.open("r+b") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, _LOCK_SIZE, _LOCK_FIRST)
        except (BlockingIOError, PermissionError) as error:
            raise LedgerError(f"{path}: {_IN_USE}") from error
        yield


def _lock_and_check(db: sqlite3.Connection, path: Path, binding: Binding, writable: bool) -> None:
    """Lock a file, and check that it is complete, contains only what was written, and is of this leg."""
    try:
        # the lock outlasts the transaction, see `_connect`; a file that is only read is not locked
        db.execute("BEGIN EXCLUSIVE" if writable else "BEGIN")
        if schema.definitions(db) != schema.expected_definitions():
            raise LedgerError(f"{path}: is damaged: it has other tables or triggers than a ledger; {REMEDY}")
        faults = [fault for (fault,) in db.execute("PRAGMA integrity_check")]
        if faults != ["ok"]:
            raise LedgerError(f"{path}: is damaged: {' '.join(faults[0].split())}; {REMEDY}")
        schema.verify(db)
        _check_binding(db, path, binding)
        db.execute("COMMIT")
    except (sqlite3.Error, ValueError, TypeError, OverflowError) as error:
        raise _refusal(path, error) from error


def _check_binding(db: sqlite3.Connection, path: Path, binding: Binding) -> None:
    """Refuse the ledger of another leg, or of other parameters of this one."""
    found = dict(db.execute("SELECT key, value FROM binding"))
    for key, ours in binding.as_texts().items():
        if found.get(key) != ours:
            what = f"{path}: is of {key.replace('_', ' ')} {found.get(key)}, not {ours}; "
            if key == "hardware_id":
                what += f"if it is this leg's, set {key}: {found.get(key)}, else "
            raise LedgerError(
                what + "set ledger.path to another file for this leg, or the parameters back to that one"
            )


def _refusal(path: Path, error: Exception) -> LedgerError:
    """Error for a file that cannot be used.

    Damage shows as an error of SQLite, or as a ValueError or TypeError here or in Python's module sqlite3.
    """
    if not isinstance(error, sqlite3.Error):
        return LedgerError(f"{path}: is damaged: {_reason(error)}; {REMEDY}")
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT)  # Python's module sets none
    if code == sqlite3.SQLITE_BUSY:
        return LedgerError(f"{path}: {_IN_USE}")
    # the lowest byte is the kind of error, the others are details of it
    if code & 0xFF in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR):
        return LedgerError(f"{path}: is damaged or not a ledger: {_reason(error)}; {REMEDY}")
    # the disk is full, failing or read-only
    return LedgerError(f"{path}: cannot be read: {_reason(error)}; expected a writable disk")


def _has_content(path: Path) -> bool:
    """Whether there is a file with at least one byte."""
    return path.exists() and path.stat().st_size > 0


def _is_hot(journal: Path) -> bool:
    """Whether SQLite would undo a transaction by a journal; a finished one's is empty or begins with 0."""
    if not journal.exists():
        return False
    with journal.open("rb") as file:
        return file.read(1) not in (b"", b"\0")


def _is_opened_to_write(path: Path) -> bool:
    """Whether a ledger is opened for writing: if it can be written, or has a journal that is not empty.

    In the second case a read-only disk is an error, because a transaction may have to be undone.
    """
    is_interrupted = _has_content(beside(path, "-journal"))
    return is_interrupted or all(os.access(place, os.W_OK) for place in (path, path.parent))


def _reason(error: Exception) -> str:
    """Text of an error on one line, without the file name that OSError adds."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return " ".join(text.split())
