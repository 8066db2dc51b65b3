"""Files of one leg of a fleet.

legs/ID/ledger            the ledger
legs/ID/recordings.jsonl  a line a recording: what was found in it; JSON
legs/ID/summary.json      result of the recording that was counted last, as `replay --out` writes it
legs/ID/pending.json      the recording whose result is about to be in the ledger
legs/ID/files.json        known files: size, time of change, key and begin of the recording
legs/ID/log               a line a recording, for people
priors/ID.json            what its forecast uses of the measured clearances of the fleet
cycles/leg=ID/KEY.parquet table of the gait cycles of a recording
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.fleet.directory.atomic import append_line
from leg_wear_monitor.monitor.ledger.file import measurements_of
from leg_wear_monitor.whole_file import remove_parts, write_whole

Line = dict[str, Any]


class LegDirectory:
    """Files of one leg.

    Parameters
    ----------
    out : pathlib.Path
        Directory of the fleet.
    leg : str
        Its id.
    """

    def __init__(self, out: Path, leg: str) -> None:
        self.path = out / "legs" / leg
        self.priors = out / "priors" / f"{leg}.json"
        self.ledger = self.path / "ledger"
        self.records = self.path / "recordings.jsonl"
        self.log = self.path / "log"
        self.summary = self.path / "summary.json"
        self.cycles = out / "cycles" / f"leg={leg}"
        self._pending, self._files = self.path / "pending.json", self.path / "files.json"

    def table(self, key: str) -> Path:
        """File of the gait cycles of a recording."""
        return self.cycles / f"{key}.parquet"

    def tables(self) -> list[Path]:
        """Files of the gait cycles of all counted recordings, in the order of time."""
        last = {line["key"]: line for line in self.lines()}
        lines = sorted(last.values(), key=lambda line: (line["begin_ns"], line["key"]))
        return [self.table(line["key"]) for line in lines if line["outcome"] == "counted"]

    def lines(self) -> Iterator[Line]:
        """Records of all recordings so far, in the order in which they were counted.

        Raises
        ------
        ConfigError
            If the file is damaged.
        """
        if not self.records.exists():
            return
        with self.records.open("rb") as file:
            for number, line in enumerate(file, 1):
                if line.endswith(b"\n"):  # otherwise it was cut off, and its recording is still pending
                    yield _object(line, f"{self.records}: line {number}")

    def last_counted(self) -> Line | None:
        """Record of the recording that was counted last, as it is now; None before the first."""
        lines = {line["key"]: line for line in self.lines()}
        return next((line for line in reversed(lines.values()) if line["outcome"] == "counted"), None)

    def knowledge(self) -> str:
        """Digest of what a forecast rests on besides walking: measured clearances, and what is learned."""
        learned = self.priors.read_bytes() if self.priors.exists() else b""
        return hashlib.sha256(measurements_of(self.ledger).encode() + b"\0" + learned).hexdigest()[:20]

    def keys(self) -> set[str]:
        """Keys of all recordings so far."""
        return {line["key"] for line in self.lines()}

    def add(self, line: Line, words: str) -> None:
        """Add the record of a recording, and its line in the log; it is no longer pending."""
        append_line(self.records, json.dumps(line, allow_nan=False))
        append_line(self.log, printable(words))
        self._pending.unlink(missing_ok=True)

    def renew(self, line: Line) -> None:
        """Replace the record of a recording; its line in the log stays."""
        append_line(self.records, json.dumps(line, allow_nan=False))

    def note(self, lines: Sequence[str]) -> None:
        """Add lines to the log, unless it has them."""
        known = set(self.log.read_text().splitlines()) if lines and self.log.exists() else set()
        for line in map(printable, lines):
            if line not in known:
                append_line(self.log, line)

    def remove_parts(self) -> None:
        """Remove parts of files that a killed update left."""
        remove_parts(self.path, "*.json")
        remove_parts(self.cycles, "*.parquet")

    def pending(self) -> Line | None:
        """Record of the recording that may or may not be in the ledger; None if there is none."""
        return _read(self._pending)

    def expect(self, line: Line) -> None:
        """Write a record down before its recording is in the ledger."""
        write_whole(self._pending, json.dumps(line, allow_nan=False).encode())

    def forget_pending(self) -> None:
        """Remove the record of a recording that is in `lines` already."""
        self._pending.unlink(missing_ok=True)

    def files(self) -> Line:
        """Known files by path; empty if nothing usable is there, since it can be found again."""
        try:
            return _read(self._files) or {}
        except ConfigError:
            return {}

    def keep_files(self, files: Mapping[str, Any]) -> None:
        """Replace the known files."""
        write_whole(self._files, json.dumps(files).encode())


def _read(path: Path) -> Line | None:
    try:
        return _object(path.read_bytes(), str(path))
    except FileNotFoundError:
        return None


def json_object(path: Path) -> Line:
    """The JSON object in a file.

    Raises
    ------
    ConfigError
        If it cannot be read, or is none.
    """
    try:
        return _object(path.read_bytes(), str(path))
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read: {error.strerror}") from error


def _object(content: bytes, source: str) -> Line:
    try:
        value = json.loads(content)
    except ValueError as error:
        raise ConfigError(source, "", "is damaged: it is not JSON") from error
    if not isinstance(value, dict):
        raise ConfigError(source, "", "is damaged: it is no JSON object")
    return value
