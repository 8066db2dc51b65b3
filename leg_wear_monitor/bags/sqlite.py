"""Recordings in SQLite (.db3): opening a database that is not trusted, and reading its messages."""

import errno
import shutil
import sqlite3
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from urllib.parse import quote

import numpy as np

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity, open_regular
from leg_wear_monitor.bags.piece import Channel, Due, Piece
from leg_wear_monitor.messages.cdr import MESSAGE

# Opening of an untrusted database: nothing is written to the file, no code in it (views, triggers, virtual
# tables) is executed, and memory and work are bounded.


_COLUMNS = {
    "topics": {"id", "name", "type", "serialization_format"},
    "messages": {"id", "topic_id", "timestamp", "data"},
    # as a whole, this one may be missing
    "message_definitions": {"topic_type", "encoding", "encoded_message_definition"},
}
_JOURNALS = ("-wal", "-journal")  # endings of the files of transactions that were not written back
_LEAST_ROW_LIMIT = 2**25  # bytes; a longer row needs a larger --memory-mb
_TEXT_DIVISOR = 32  # a text of the schema or of a topic may have this part of `Budget.part_limit`
_MOST_COLUMNS, _LONGEST_SQL = 64, 100_000  # far above those of rosbag2
# Work is bounded in instructions of SQLite's virtual machine, since a damaged tree whose branches meet again,
# or a query without end, takes any number. A row takes about 80 in all, and has 30 bytes or more: 16 a byte
# are ample, with a minimum for small files. They are counted in steps of 1000.
_SCHEMA_INSTRUCTIONS, _INSTRUCTIONS_PER_BYTE, _LEAST_INSTRUCTIONS = 200_000, 16, 10**7
_INSTRUCTIONS_PER_CHECK = 1000
_FUNCTIONS = {"count", "length", "typeof"}  # of SQL, as used by the queries below
UNREADABLE = (sqlite3.Error, UnicodeDecodeError, MemoryError)
"""Errors of reading a damaged database; sqlite3 raises UnicodeDecodeError where its message quotes bytes."""


def open_database(
    path: Path, file: Path, budget: Budget, stack: ExitStack
) -> tuple[sqlite3.Connection, list[str]]:
    """Open a rosbag2 database for reading, including all committed transactions.

    A ``-wal`` or ``-journal`` file beside the database is part of it. SQLite recovers such a file by
    writing, so the recovery takes place in a private copy.

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
        If the file is not a rosbag2 database.
    OSError
        If the system cannot read it.
    """
    journals = _journals_of(file)
    try:
        open_regular(file).close()  # SQLite does not say why it cannot open a file
        if journals:
            address = f"file:{quote(str(_private_copy(file, journals, budget, stack)))}?mode=rw"
        else:
            address = f"file:{quote(str(file.absolute()))}?mode=ro&immutable=1"
        database = sqlite3.connect(address, uri=True, isolation_level=None)
        stack.callback(database.close)
        database.text_factory = lambda raw: raw.decode("utf-8", "replace")
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, budget.part_limit // _TEXT_DIVISOR)
        database.setlimit(sqlite3.SQLITE_LIMIT_COLUMN, _MOST_COLUMNS)
        database.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, _LONGEST_SQL)
        _limit_work(database, _SCHEMA_INSTRUCTIONS)
        database.execute("PRAGMA trusted_schema = OFF")
        database.set_authorizer(_authorized)
        _check_tables(database)
        size = sum(map(_size, (file, *journals)))
        _limit_work(database, _LEAST_INSTRUCTIONS + _INSTRUCTIONS_PER_BYTE * size)
    except DamageError as error:
        raise RecordingError(str(path), "", str(error)) from error
    except UNREADABLE as error:
        _raise_of_the_system(error)
        raise RecordingError(str(path), "", f"is not a readable .db3 file: {one_line(error)}") from error
    names = " and ".join(each.name for each in journals)
    return database, [f"was not closed: the content of {names} beside it is read as well"] if journals else []


def allow_rows(database: sqlite3.Connection, budget: Budget) -> None:
    """Raise the limit of a row from that of texts, which `open_database` sets, to that of messages."""
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(_LEAST_ROW_LIMIT, budget.part_limit // 8 + 2**16))


def one_line(error: BaseException) -> str:
    """Text of an error on one line."""
    if str(error) == "interrupted":  # by `_limit_work`
        return "reading it takes more work than its size explains"
    return " ".join(str(error).split()) or type(error).__name__


def _raise_of_the_system(error: BaseException) -> None:
    """Raise an OSError, as of other files, where the system could not read: that is no damage of the file."""
    code = getattr(error, "sqlite_errorcode", 0)
    is_cut_off = code == sqlite3.SQLITE_IOERR_SHORT_READ
    if code & 0xFF == sqlite3.SQLITE_IOERR and not is_cut_off:
        raise OSError(errno.EIO, str(error)) from error


def _limit_work(database: sqlite3.Connection, most: int) -> None:
    """Let SQLite stop with the error "interrupted" after so many instructions from now on."""
    left = most // _INSTRUCTIONS_PER_CHECK

    def is_over() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    database.set_progress_handler(is_over, _INSTRUCTIONS_PER_CHECK)


def _authorized(action: int, first: str | None, second: str | None, _: str | None, inside: str | None) -> int:
    """Whether SQLite may do something (see `set_authorizer`); `inside` is the view or trigger that does it.

    Only reading is allowed, by the queries of this module themselves.
    """
    if inside is None:
        is_reading = (
            action in (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)
            or (action == sqlite3.SQLITE_FUNCTION and second in _FUNCTIONS)
            or (action == sqlite3.SQLITE_PRAGMA and first == "table_xinfo")
        )
        return sqlite3.SQLITE_OK if is_reading else sqlite3.SQLITE_DENY
    return sqlite3.SQLITE_DENY


def _size(file: Path) -> int:
    """Size of a file [bytes]; 0 if it does not exist."""
    try:
        return file.stat().st_size
    except FileNotFoundError:
        return 0


def _journals_of(file: Path) -> list[Path]:
    """Files beside a database with transactions that were not written back to it."""
    return [each for end in _JOURNALS if _size(each := file.with_name(file.name + end))]


def _private_copy(file: Path, journals: list[Path], budget: Budget, stack: ExitStack) -> Path:
    """Copy a database and its journal files to a temporary directory."""
    budget.reserve(sum(_size(each) for each in (file, *journals)))
    copy = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "content.db3"
    for each in (file, *journals):
        target = copy.with_name(copy.name + each.name.removeprefix(file.name))
        with open_regular(each) as source, target.open("xb") as content:
            shutil.copyfileobj(source, content)
    return copy


def _check_tables(database: sqlite3.Connection) -> None:
    """Check that the tables are plain: a view or a virtual table would execute code when it is read.

    Names are compared without case, as SQLite does. An entry without a text is refused.
    """
    found: dict[str, list[tuple[str, str]]] = {}
    for name, kind, text in database.execute("SELECT name, type, sql FROM sqlite_master"):
        found.setdefault(str(name).lower(), []).append((str(kind), str(text)))
    for table, needed in _COLUMNS.items():
        entries = found.get(table, [])
        if not entries and table == "message_definitions":
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


# The reader of one .db3 file: its topics, and its messages in pieces in order of log time.


_Row = tuple[int, int, int]  # id, time, topic
_ROWS_PER_PAGE = 4096  # ids and times fetched at once, without contents
_MOST_TOPICS = 65536  # no recording has as many; bounds the memory of their lists
# memory of a topic or definition, with its copies and escapes [bytes]
_BYTES_PER_ROW, _BYTES_PER_CHARACTER = 1000, 16
_NO_CHECKSUMS = "has no checksums, like all .db3 files: a damaged number would not be detected"


class SqliteFile:
    """An open .db3 file; its faults are listed in `findings`.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : pathlib.Path
        File that is opened; nothing is written to it.
    budget : Budget
    stack : contextlib.ExitStack
        Closes the file.

    Raises
    ------
    RecordingError
        If the file is not a rosbag2 database.
    OSError
        If the system cannot read it.
    """

    def __init__(self, path: Path, file: Path, budget: Budget, stack: ExitStack) -> None:
        self.path, self.budget = path, budget
        self.findings: list[Finding] = [Finding(path, _NO_CHECKSUMS, Severity.NOTE)]
        self._database, notes = open_database(path, file, budget, stack)
        self.findings += [Finding(path, note, Severity.NOTE) for note in notes]
        try:
            self.size = sum(map(_size, (file, *_journals_of(file))))
            self.channels = _channels(self._database, budget)
            allow_rows(self._database, budget)
            self._counts = _counts(self._database)
        except DamageError as error:
            raise RecordingError(str(path), "", str(error)) from error
        except UNREADABLE as error:
            _raise_of_the_system(error)
            raise RecordingError(str(path), "", f"is not a readable .db3 file: {one_line(error)}") from error
        self._read = 0
        self._report_unlisted()

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels; unreadable messages are skipped.

        Each is loaded before the next one is asked for: that takes its rows off the page.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        expected = sum(self._counts.get(number, 0) for number in types)
        for rows in self._pages(types):
            while rows:
                yield Due(rows[0][1], partial(self._piece, rows, types, self.size // max(expected, 1)))
        if self._read != expected:
            text = f"{self._read} messages could be read of the {expected} that it counts"
            self.findings.append(Finding(self.path, text))

    def _pages(self, types: dict[int, int]) -> Iterator[deque[_Row]]:
        """Message rows without contents, in order of log time, a page at a time."""
        if not types:
            return
        places = ", ".join("?" * len(types))
        try:
            cursor = self._database.execute(
                f"SELECT id, timestamp, topic_id FROM messages WHERE topic_id IN ({places}) "
                "AND typeof(timestamp) = 'integer' AND typeof(data) = 'blob' ORDER BY timestamp, id",
                list(types),
            )
            while rows := cursor.fetchmany(_ROWS_PER_PAGE):
                yield deque(rows)
        except UNREADABLE as error:
            _raise_of_the_system(error)
            self.findings.append(Finding(self.path, f"ends early: {one_line(error)}"))

    def _piece(self, rows: deque[_Row], types: dict[int, int], bytes_per_message: int) -> Piece:
        """Read the messages of the next rows, as memory permits; these rows are removed from `rows`.

        `bytes_per_message` is the part of the file's size that counts as read with each of them.
        """
        contents: list[bytes] = []
        kept: list[_Row] = []
        start_ns, room, number = rows[0][1], self.budget.part_limit // 4, len(rows)
        while rows and room > 0:
            row = rows.popleft()
            content = self._content(row[0])
            if content is not None:
                contents.append(content)
                kept.append(row)
                room -= len(content)
        self._read += len(kept)
        messages = np.zeros(len(kept), MESSAGE)
        messages["end"] = np.cumsum([len(content) for content in contents])
        messages["begin"][1:] = messages["end"][:-1]
        messages["log_time_ns"] = messages["publish_time_ns"] = [time for _, time, _ in kept]
        messages["type"] = [types[topic] for _, _, topic in kept]
        data = np.frombuffer(b"".join(contents), np.uint8)
        return Piece(start_ns, data, messages, bytes_per_message * (number - len(rows)))

    def _content(self, number: int) -> bytes | None:
        """Content of one message; None if it is unreadable or too large for memory."""
        try:
            row = self._database.execute(
                "SELECT data FROM messages WHERE id = ? AND length(data) <= ?",
                (number, self.budget.part_limit // 8),
            ).fetchone()
        except UNREADABLE as error:
            _raise_of_the_system(error)
            return None  # `pieces` reports how many are missing
        return row[0] if row and isinstance(row[0], bytes) else None

    def _report_unlisted(self) -> None:
        """Report the number of messages that belong to no listed topic."""
        count = sum(count for topic, count in self._counts.items() if topic not in self.channels)
        if count:
            text = f"contains {count} messages of topics that it does not list: they are lost"
            self.findings.append(Finding(self.path, text))


def _counts(database: sqlite3.Connection) -> dict[int | None, int]:
    """Number of messages by topic number; under None, messages whose topic number is no integer.

    Raises
    ------
    DamageError
        If there are more than 65536 topics.
    """
    # NOT INDEXED: an index is data of the file, too, and may disagree with the table
    number = "CASE WHEN typeof(topic_id) = 'integer' THEN topic_id END"
    query = f"SELECT {number}, COUNT(*) FROM messages NOT INDEXED GROUP BY 1 LIMIT ?"
    counts = dict(database.execute(query, (_MOST_TOPICS + 1,)).fetchall())
    if len(counts) > _MOST_TOPICS:
        raise DamageError(f"has messages of more than {_MOST_TOPICS} topics")
    return counts


def _channels(database: sqlite3.Connection, budget: Budget) -> dict[int, Channel]:
    """Channels by topic number, with the definitions of their types if the file has them.

    Raises
    ------
    DamageError
        If their texts do not fit into memory, or there are more than 65536 topics.
    """
    texts: dict[str, tuple[str, str]] = {}
    is_there = "SELECT 1 FROM sqlite_master WHERE name = 'message_definitions' COLLATE NOCASE"
    size = 0

    def rows(query: str) -> Iterator[tuple[object, ...]]:
        nonlocal size
        for row in database.execute(f"{query} LIMIT ?", (_MOST_TOPICS + 1,)):
            size += _BYTES_PER_ROW + _BYTES_PER_CHARACTER * sum(
                len(text) for text in row if isinstance(text, str | bytes)
            )
            budget.check(size)
            yield row

    if database.execute(is_there).fetchone():
        for name, encoding, text in rows(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        ):
            texts[str(name)] = str(encoding), str(text)
    channels = {}
    for number, name, kind, encoding in rows("SELECT id, name, type, serialization_format FROM topics"):
        definition_encoding, text = texts.get(str(kind), ("ros2msg", ""))
        if isinstance(number, int):
            channels[number] = Channel(str(name), str(kind), str(encoding), text, definition_encoding)
    if len(channels) > _MOST_TOPICS:
        raise DamageError(f"has more than {_MOST_TOPICS} topics")
    return channels
