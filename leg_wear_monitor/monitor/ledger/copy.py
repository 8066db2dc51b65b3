"""Temporary private copy of a ledger, for trial runs."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.log import ENDING

# the last entries are in the log; what SQLite left beside the file decides whether it can be used
_PARTS = ("", ENDING, "-journal", "-wal")


@contextmanager
def copy_of(path: str | Path) -> Iterator[Path]:
    """Copy a ledger, including its last entries; without a ledger, no file is created.

    Raises
    ------
    LedgerError
        If the ledger cannot be read; errors of the copy are raised again with the name of the ledger itself.
    """
    original = Path(path)
    with tempfile.TemporaryDirectory(prefix="leg_wear_") as place:
        copy = Path(place) / original.name
        try:
            for part in _PARTS:
                source = original.with_name(original.name + part)
                if source.exists():
                    shutil.copyfile(source, copy.with_name(copy.name + part))
        except OSError as error:
            raise LedgerError(f"{original}: cannot be read: {error.strerror}") from error
        try:
            yield copy
        except LedgerError as error:
            raise LedgerError(str(error).replace(str(copy), str(original))) from error
