"""Safe opening of untrusted SQLite files: nothing is written to the file and no code in it is executed."""

import shutil
import sqlite3
import tempfile
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import quote

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, RecordingError
from leg_wear_monitor.bags.regular_file import open_regular

_NEEDED = {"topics": {"id", "name", "type"}, "messages": {"id", "topic_id", "timestamp", "data"}}
_JOURNALS = ("-wal", "-journal")
_LONGEST_ROW = 2**25  # bytes
UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
"""What reading a damaged database raises; its own complaint may hold bytes of it that are no text."""


def open_database(
    path: Path, file: Path, budget: Budget, stack: ExitStack
) -> tuple[sqlite3.Connection, list[str]]:
    """Open a rosbag2 database for reading, including all committed transactions.

    A ``-wal`` or ``-journal`` file beside the database is part of it. SQLite recovers such a file by writing,
    so the recovery takes place in a private copy.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in notes and errors.
    file : pathlib.Path
        File that is opened.
    budget : Budget
    stack : contextlib.ExitStack
        Closes the database.

    Returns
    -------
    database : sqlite3.Connection
    notes : list of str
        Remarks for the user.

    Raises
    ------
    RecordingError
        If the file cannot be read or is not a rosbag2 database.
    """
    beside = [each for end in _JOURNALS if _size(each := file.with_name(file.name + end))]
    try:
        if beside:
            address = f"file:{quote(str(_copied(file, beside, budget, stack)))}?mode=rw"
        else:
            address = f"file:{quote(str(file.absolute()))}?mode=ro&immutable=1"
        database = sqlite3.connect(address, uri=True, isolation_level=None)
        stack.callback(database.close)
        database.text_factory = lambda raw: raw.decode("utf-8", "replace")
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(_LONGEST_ROW, budget.at_once // 8 + 2**16))
        database.execute("PRAGMA trusted_schema = OFF")
        _check_tables(database)
    except DamageError as error:
        raise RecordingError(str(path), "", str(error)) from error
    except (*UNREADABLE, OSError) as error:
        raise RecordingError(str(path), "", f"is not a readable .db3 file: {one_line(error)}") from error
    names = " and ".join(each.name for each in beside)
    return database, [f"was not closed: the content of {names} beside it is read as well"] if beside else []


def one_line(error: Exception) -> str:
    """Text of an error on one line."""
    return " ".join(str(error).split()) or type(error).__name__


def _size(file: Path) -> int:
    """Size of a file [bytes]; 0 if it does not exist."""
    try:
        return file.stat().st_size
    except FileNotFoundError:
        return 0


def _copied(file: Path, beside: list[Path], budget: Budget, stack: ExitStack) -> Path:
    """Make a private copy of a database and of its journal files."""
    budget.take(sum(_size(each) for each in (file, *beside)))
    copy = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "content.db3"
    for each in (file, *beside):
        target = copy.with_name(copy.name + each.name.removeprefix(file.name))
        with open_regular(each) as source, target.open("xb") as content:
            shutil.copyfileobj(source, content)
    return copy


def _check_tables(database: sqlite3.Connection) -> None:
    """Check that the tables are plain: a view or a virtual table would execute code when it is read."""
    query = "SELECT name, type, sql FROM sqlite_master WHERE name IN ('topics', 'messages')"
    tables = {name: (kind, str(text)) for name, kind, text in database.execute(query)}
    for table, needed in _NEEDED.items():
        kind, text = tables.get(table, ("", ""))
        if kind != "table" or text[:20].upper().startswith("CREATE VIRTUAL"):
            raise DamageError(f"is not a readable .db3 file: it has no table {table}")
        plain = {row[1] for row in database.execute(f"PRAGMA table_xinfo({table})") if not row[6]}
        if missing := sorted(needed - plain):
            raise DamageError(f"is not a readable .db3 file: its table {table} has no {', '.join(missing)}")
