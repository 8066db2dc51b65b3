"""An SQLite file of a stranger: opened so that nothing is written to it and nothing in it is carried out."""

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
    """Open a database of rosbag2 to read, with all that was committed to it.

    What stands in a ``-wal`` or ``-journal`` beside it is part of it. SQLite itself recovers that, in a
    private copy, for it writes when it does.

    Parameters
    ----------
    path : pathlib.Path
        Name for messages.
    file : pathlib.Path
        What is opened.
    budget : Budget
    stack : contextlib.ExitStack
        Closes it.

    Returns
    -------
    database : sqlite3.Connection
    notes : list of str
        What to say of it.

    Raises
    ------
    RecordingError
        If it cannot be read, or is no database of rosbag2.
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
    return database, [f"was not closed: the content of {names} beside it is read, too"] if beside else []


def one_line(error: Exception) -> str:
    """What an error says, on one line."""
    return " ".join(str(error).split()) or type(error).__name__


def _size(file: Path) -> int:
    """Bytes of a file; 0 where there is none."""
    try:
        return file.stat().st_size
    except FileNotFoundError:
        return 0


def _copied(file: Path, beside: list[Path], budget: Budget, stack: ExitStack) -> Path:
    """A private copy of a database and of what lies beside it."""
    budget.take(sum(_size(each) for each in (file, *beside)))
    copy = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "content.db3"
    for each in (file, *beside):
        target = copy.with_name(copy.name + each.name.removeprefix(file.name))
        with open_regular(each) as source, target.open("xb") as content:
            shutil.copyfileobj(source, content)
    return copy


def _check_tables(database: sqlite3.Connection) -> None:
    """See that what is read is plain tables: a view or a virtual table would be carried out, not read."""
    query = "SELECT name, type, sql FROM sqlite_master WHERE name IN ('topics', 'messages')"
    there = {name: (kind, str(text)) for name, kind, text in database.execute(query)}
    for table, needed in _NEEDED.items():
        kind, text = there.get(table, ("", ""))
        if kind != "table" or text[:20].upper().startswith("CREATE VIRTUAL"):
            raise DamageError(f"is not a readable .db3 file: it has no table {table}")
        plain = {row[1] for row in database.execute(f"PRAGMA table_xinfo({table})") if not row[6]}
        if missing := sorted(needed - plain):
            raise DamageError(f"is not a readable .db3 file: its table {table} has no {', '.join(missing)}")
