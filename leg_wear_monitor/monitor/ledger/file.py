"""The ledger's file: created completely or not at all, checked before use, written in transactions."""

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

MOVE = "move it away to begin with new parts, or put a copy of it back"

_MODE = 0o640  # mode of new files, reduced by the umask
_PAGE = 512  # bytes: besides the surfaces, an entry changes mostly single rows
_HEADER = 100
_MAGIC = b"SQLite format 3\0"
_IN_USE = "is in use by another monitor; end that one, or set another ledger.path"
_SHARED_FIRST, _SHARED_SIZE = 0x40000002, 510  # bytes that SQLite locks
_ROLLBACK = b"\1\1"  # versions of writing and reading: journal, not WAL


class LedgerError(LegWearError):
    """A ledger cannot be continued; the file is left unchanged."""


def beside(path: Path, ending: str) -> Path:
    """Path of a file beside a ledger, with the given ending."""
    return path.with_name(path.name + ending)


def create(path: Path, binding: Binding) -> None:
    """Create a ledger; at any instant the path has no ledger or a complete one.

    Raises
    ------
    LedgerError
    """
    new = beside(path, ".new")
    try:
        new.unlink(missing_ok=True)
        os.close(os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _MODE))
        with closing(_connect(new, "rw")) as db:
            db.execute(f"PRAGMA page_size = {_PAGE}")
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
    """Open a ledger for this hardware and mechanism, with an exclusive lock while it is open.

    On a read-only disk the ledger can be read, and every write fails.

    Raises
    ------
    LedgerError
        If the file is damaged, not a ledger, of another format, of another leg, or in use.
    """
    try:
        _check_header(path)
        writable = _is_writable(path)
        if writable and _is_hot(beside(path, "-journal")):
            _rehearse(path, binding)
        db = _connect(path, "rw" if writable else "ro&immutable=1")
    except OSError as error:
        raise LedgerError(f"{path}: cannot be opened: {_reason(error)}") from error
    except (sqlite3.Error, ValueError) as error:
        raise _refusal(path, error) from error
    try:
        _begin(db, path, binding, writable)
    except BaseException:
        db.close()
        raise
    return db


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """Write completely or not at all; the data is on the disk when the context ends."""
    db.execute("BEGIN EXCLUSIVE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise


def hardware_id_of(path: Path) -> str:
    """Hardware id that a ledger belongs to; empty if it cannot be read, which opening it reports."""
    if not path.is_file():
        return ""
    try:
        with closing(_connect(path, "ro")) as db:
            row = db.execute("SELECT value FROM binding WHERE key = 'hardware_id'").fetchone()
    except sqlite3.Error:
        return ""
    return str(row[0]) if row else ""


def measurements_of(path: Path) -> str:
    """The measured clearances of a ledger as a text, empty without any; it is read without a lock.

    Where they cannot be read (damaged, of another format, being written), the text says so: opening it
    decides.
    """
    return _rows_as_text(path, "SELECT * FROM measurement ORDER BY rowid")


def last_changes_of(path: Path) -> str:
    """Numbers of the last changes of parts, alarms and verdict in a ledger, read as by `measurements_of`."""
    last = (f"(SELECT max(id) FROM {table})" for table in ("audit", "alarm_history", "verdict"))
    return _rows_as_text(path, f"SELECT {', '.join(last)}")


def _rows_as_text(path: Path, query: str) -> str:
    if not path.is_file():
        return ""
    try:
        with closing(_connect(path, "ro")) as db:
            return "\n".join(map(repr, db.execute(query)))
    except sqlite3.Error as error:
        return f"not readable: {error}"


@contextmanager
def copy_of(path: str | Path) -> Iterator[Path]:
    """Make a temporary private copy of a ledger, for a trial; without a ledger, no file is created.

    Raises
    ------
    LedgerError
        If the ledger cannot be read; errors of the copy are raised again with the name of the ledger itself.
    """
    original = Path(path)
    with tempfile.TemporaryDirectory(prefix="leg_wear_") as place:
        copy = Path(place) / original.name
        try:
            for part in ("", "-journal", "-wal"):  # what SQLite left decides whether it can be used
                if beside(original, part).exists():
                    shutil.copyfile(beside(original, part), beside(copy, part))
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
    # The node's executor may call from another thread than the one that opened it, never from two at once.
    db = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=0.5,
        isolation_level=None,
        check_same_thread=False,
    )
    db.execute("PRAGMA trusted_schema = OFF")  # SQL functions in a manipulated schema must not run
    db.execute("PRAGMA cell_size_check = ON")
    db.execute("PRAGMA secure_delete = OFF")  # it would write zeros over freed pages before their reuse
    db.execute("PRAGMA temp_store = MEMORY")
    db.execute("PRAGMA synchronous = EXTRA")
    # The lock lasts until the connection is closed; after a kill, the system releases it.
    db.execute("PRAGMA locking_mode = EXCLUSIVE")
    return db


def _check_header(path: Path) -> None:
    """Refuse what is not a ledger of this format by its header, before SQLite opens the file."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise LedgerError(f"{path}: cannot be opened: it is not a file")
    if status.st_size == 0:
        raise LedgerError(f"{path}: is empty, not a ledger; {MOVE}")
    with path.open("rb") as file:
        header = file.read(_HEADER)
    if not header.startswith(_MAGIC) or len(header) < _HEADER:
        raise LedgerError(f"{path}: is damaged or not a ledger: it is not an SQLite file; {MOVE}")
    application, found = (int.from_bytes(header[at : at + 4]) for at in (68, 60))
    if application == schema.UNRELEASED_ID:
        raise LedgerError(
            f"{path}: has the unreleased format {found}, this version knows only the released ones, up to "
            f"{schema.FORMAT}; go on with the version that wrote it, or move it away to begin with new parts"
        )
    if application != schema.APPLICATION_ID:
        raise LedgerError(f"{path}: is an SQLite file, but not a ledger; {MOVE}")
    if found > schema.FORMAT:
        raise LedgerError(
            f"{path}: has format {found}, this version knows up to {schema.FORMAT}; install a newer one"
        )
    log = beside(path, "-wal")
    if _has_content(log):
        raise LedgerError(f"{path}: {log.name} beside it belongs to another ledger; move it away")
    if found != schema.FORMAT or header[18:20] != _ROLLBACK:
        raise LedgerError(f"{path}: is damaged: its header is not what was written; {MOVE}")


def _rehearse(path: Path, binding: Binding) -> None:
    """Undo an interrupted transaction in a copy first: its journal may be of another file or time."""
    with tempfile.TemporaryDirectory() as directory, _locked(path):
        copy = Path(directory) / path.name
        for ending in ("", "-journal"):
            shutil.copyfile(beside(path, ending), beside(copy, ending))
        try:
            with closing(_connect(copy, "rw")) as db:
                _begin(db, copy, binding, writable=True)
        except (sqlite3.Error, ValueError, LedgerError) as error:
            fault = error if isinstance(error, LedgerError) else _refusal(copy, error)
            reason = str(fault).removeprefix(f"{copy}: ").removesuffix(f"; {MOVE}")
            raise LedgerError(
                f"{path}: with {path.name}-journal beside it, it {reason}; that is of another file or time: "
                "move it away, or put a copy of both back"
            ) from error


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock the file for others as SQLite does: https://sqlite.org/src/file?name=src/os.h."""
    with path.open("r+b") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, _SHARED_SIZE, _SHARED_FIRST)
        except (BlockingIOError, PermissionError) as error:
            raise LedgerError(f"{path}: {_IN_USE}") from error
        yield


def _begin(db: sqlite3.Connection, path: Path, binding: Binding, writable: bool) -> None:
    """Lock a file, and check that it is complete and contains only what was written."""
    try:
        db.execute("BEGIN EXCLUSIVE" if writable else "BEGIN")
        if schema.definitions(db) != schema.expected_definitions():
            raise LedgerError(f"{path}: is damaged: it has other tables or triggers than a ledger; {MOVE}")
        faults = [fault for (fault,) in db.execute("PRAGMA integrity_check")]
        if faults != ["ok"]:
            raise LedgerError(f"{path}: is damaged: {' '.join(faults[0].split())}; {MOVE}")
        schema.verify(db)
        _check_binding(db, path, binding)
        db.execute("COMMIT")
    except (sqlite3.Error, ValueError, TypeError, OverflowError) as error:
        raise _refusal(path, error) from error


def _check_binding(db: sqlite3.Connection, path: Path, binding: Binding) -> None:
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
    """Error for a file that cannot be used; damage causes ValueError and TypeError, also within sqlite3."""
    if not isinstance(error, sqlite3.Error):
        return LedgerError(f"{path}: is damaged: {_reason(error)}; {MOVE}")
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT)  # Python's own errors have no code
    if code == sqlite3.SQLITE_BUSY:
        return LedgerError(f"{path}: {_IN_USE}")
    if code & 0xFF in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR):
        return LedgerError(f"{path}: is damaged or not a ledger: {_reason(error)}; {MOVE}")
    return LedgerError(f"{path}: cannot be read: {_reason(error)}; expected a writable disk")


def _has_content(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 0


def _is_hot(journal: Path) -> bool:
    """Whether a transaction was interrupted: otherwise the journal is empty, or its first bytes are 0."""
    if not journal.exists():
        return False
    with journal.open("rb") as file:
        return file.read(1) not in (b"", b"\0")


def _is_writable(path: Path) -> bool:
    """Whether the file is writable, or has to be because an interrupted transaction is beside it."""
    places = (path, path.parent)
    cut_off = any(_has_content(beside(path, ending)) for ending in ("-wal", "-journal"))
    return cut_off or all(os.access(place, os.W_OK) for place in places)


def _reason(error: Exception) -> str:
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    return " ".join(text.split())
