"""A ledger to try something on: a copy in a private place, thrown away afterwards."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from leg_wear_monitor.monitor.ledger.file import LedgerError

_PARTS = ("", "-wal")  # SQLite keeps the last entries beside the file


@contextmanager
def copy_of(path: str | Path) -> Iterator[Path]:
    """A copy of a ledger, its last entries included; none where there is no ledger yet.

    Raises
    ------
    LedgerError
        If it cannot be read, and in place of one of the copy: it names the ledger itself.
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
