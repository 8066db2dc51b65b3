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
_LONGEST_TEXT = 32  # of the schema and of topics: this part of what may be read at once
_MOST_COLUMNS, _LONGEST_SQL = 64, 100_000
# Instructions of SQLite's machine: a row takes about 80 in all, and has 30 bytes or more.
# A tree whose branches meet again, or a query that never ends, takes any number.
_OF_THE_SCHEMA, _OF_A_BYTE, _AT_LEAST, _TOGETHER = 200_000, 16, 10**7, 1000
_FUNCTIONS = {"count", "length", "typeof"}
UNREADABLE = (sqlite3.Error, UnicodeDecodeError, MemoryError)
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
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, budget.at_once // _LONGEST_TEXT)
        database.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, _MOST_COLUMNS)
        database.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, _LONGEST_SQL)
        _limit_work(database, _OF_THE_SCHEMA)
        database.execute("PRAGMA trusted_schema = OFF")
        database.set_authorizer(_is_allowed)
        _check_tables(database)
        _limit_work(database, _AT_LEAST + _OF_A_BYTE * _size(file))
    except DamageError as error:
        raise RecordingError(str(path), "", str(error)) from error
    except (*UNREADABLE, OSError) as error:
        raise RecordingError(str(path), "", f"is not a readable .db3 file: {one_line(error)}") from error
    names = " and ".join(each.name for each in beside)
    return database, [f"was not closed: the content of {names} beside it is read as well"] if beside else []


def allow_rows(database: sqlite3.Connection, budget: Budget) -> None:
    """Allow rows as long as those of messages, which are longer than any text of the schema and of topics."""
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(_LONGEST_ROW, budget.at_once // 8 + 2**16))


def one_line(error: BaseException) -> str:
    """Text of an error on one line."""
    if str(error) == "interrupted":
        return "reading it takes more work than its size explains"
    return " ".join(str(error).split()) or type(error).__name__


def _limit_work(database: sqlite3.Connection, most: int) -> None:
    """Interrupt what takes more instructions, counted from now on."""
    left = most // _TOGETHER

    def is_over() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    database.set_progress_handler(is_over, _TOGETHER)


def _is_allowed(action: int, first: str | None, second: str | None, _: str | None, inside: str | None) -> int:
    """Allow reading of plain tables; `inside` is the view that reads."""
    if inside is None:
        is_one = (
            action in (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)
            or (action == sqlite3.SQLITE_FUNCTION and second in _FUNCTIONS)
            or (action == sqlite3.SQLITE_PRAGMA and first == "table_xinfo")
        )
        return sqlite3.SQLITE_OK if is_one else sqlite3.SQLITE_DENY
    return sqlite3.SQLITE_DENY


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
    """Check that the tables are plain: a view or a virtual table would execute code when it is read.

    SQLite takes names of any case, and passes over entries that have no text.
    """
    found: dict[str, list[tuple[str, str]]] = {}
    for name, kind, text in database.execute("SELECT name, type, sql FROM sqlite_master"):
        found.setdefault(str(name).lower(), []).append((str(kind), str(text)))
    for table, needed in (*_NEEDED.items(), ("message_definitions", set())):
        entries = found.get(table, [])
        if not entries and not needed:
            continue
        if (
            len(entries) != 1
            or entries[0][0] != "table"
            or not entries[0][1].upper().startswith("CREATE TABLE")
        ):
            raise DamageError(f"is not a readable .db3 file: it has no table {table}, or not a plain one")
        plain = {row[1] for row in database.execute(f"PRAGMA table_xinfo({table})") if not row[6]}
        if missing := sorted(needed - plain):
            raise DamageError(f"is not a readable .db3 file: its table {table} has no {', '.join(missing)}")
