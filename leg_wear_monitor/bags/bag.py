"""Resolve what a user names to an ordered list of recordings: bags (plain, split, compressed) and tables."""

import os
import re
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias, cast

import attrs
from numpy.typing import ArrayLike

from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.metadata import METADATA, read_metadata
from leg_wear_monitor.bags.regular_file import kind_of

MCAP, CSV, PARQUET, IN_MEMORY = ".mcap", ".csv", ".parquet", ""
TABLES = (CSV, PARQUET, IN_MEMORY)
_NAME = re.compile(r".*(\.mcap|\.db3)(\.zstd)?", re.DOTALL)
_TABLE = re.compile(r".*(\.csv|\.parquet)(\.zstd)?", re.DOTALL | re.IGNORECASE)
_EXPECTED = "a bag directory, .mcap, .db3, .csv or .parquet"


class DataFrame(Protocol):
    """What is used of a data frame, of pandas or of another library."""

    @property
    def columns(self) -> Iterable[Any]:
        """Names of the columns."""

    def __getitem__(self, name: Any, /) -> Any:
        """A column."""


Recordable: TypeAlias = str | Path | Mapping[str, ArrayLike] | DataFrame
"""A path, or a table in memory: columns by name."""


@attrs.frozen
class BagFile:
    """One file of a recording.

    Attributes
    ----------
    path : pathlib.Path
    storage : str
        `MCAP`, `SQLITE`, `CSV`, `PARQUET`, or `IN_MEMORY`.
    compressed : bool
        Whether the whole file is compressed.
    by_message : bool
        Whether each message in the file is compressed on its own.
    types : dict
        Message type by topic name, from metadata.yaml.
    recording : int
        Index of the given path that the file belongs to.
    table : optional
        Columns in memory.
    """

    path: Path
    storage: str
    compressed: bool = False
    by_message: bool = False
    types: dict[str, str] = attrs.Factory(dict)
    recording: int = 0
    table: Any = None


def listed_recordings(given: Recordable | Iterable[Recordable]) -> list[Recordable]:
    """Recordings that were given: one, or several."""
    if isinstance(given, str | os.PathLike | Mapping) or hasattr(given, "columns"):
        return [cast("Recordable", given)]
    return list(given)


def find_files(paths: Iterable[Recordable]) -> tuple[list[BagFile], list[Finding]]:
    """Find the recording files of paths, and report findings about their directories.

    Parameters
    ----------
    paths : iterable
        Files, bag directories, tables in memory.

    Raises
    ------
    RecordingError
        If a path does not exist, or its name is not that of a recording.
    """
    files: list[BagFile] = []
    findings: list[Finding] = []
    for number, given in enumerate(paths):
        if not isinstance(given, str | os.PathLike):
            name = Path(f"table {number + 1}")
            files.append(BagFile(name, IN_MEMORY, recording=number, table=given))
            continue
        path = Path(given)
        mode = _mode(path)
        if mode is None:
            raise RecordingError(str(path), "", f"does not exist, expected {_EXPECTED}")
        found = _directory(path, findings) if stat.S_ISDIR(mode) else [_file(path, mode)]
        files += [attrs.evolve(file, recording=number) for file in found]
    if not files:
        raise RecordingError("", "", f"no recording given, expected {_EXPECTED}")
    return files, findings


def is_recording_name(path: Path) -> bool:
    """Whether a file is a recording by its name."""
    return bool(_NAME.fullmatch(path.name) or _TABLE.fullmatch(path.name))


def is_bag_directory(path: Path) -> bool:
    """Whether a directory is one recording, not a collection of them.

    It has metadata, or files with the names that rosbag2 gives them: it writes the metadata last.
    """
    names = [file.name for file in path.iterdir() if _NAME.fullmatch(file.name)]
    return bool(names) and (
        (path / METADATA).is_file() or all(name.startswith(f"{path.name}_") for name in names)
    )


def _mode(path: Path) -> int | None:
    """File mode of a path, or None if it does not exist; not opened, because a pipe would block forever."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(str(path), "", f"cannot be read: {why}") from error


def _file(path: Path, mode: int, **parts: Any) -> BagFile:
    match = _NAME.fullmatch(path.name) or _TABLE.fullmatch(path.name)
    if match is None:
        raise RecordingError(str(path), "", f"is no recording by its name, expected {_EXPECTED}")
    if what := kind_of(mode):
        raise RecordingError(str(path), "", f"is {what}, expected a file")
    return BagFile(path, match[1].lower(), match[2] is not None, **parts)


def _directory(path: Path, findings: list[Finding]) -> list[BagFile]:
    """Files of a bag directory, ordered by its metadata; without metadata, ordered by file number."""
    recordings = _recordings(path, findings)
    named, parts = _metadata(path / METADATA, findings)
    if named:
        missing = [name for name in named if name not in recordings]
        for name in missing:
            findings.append(Finding(path / METADATA, f"names {name}, which does not exist: it is lost"))
        recordings = [name for name in named if name not in missing]
    if not recordings:
        raise RecordingError(str(path), "", "contains no .mcap or .db3 file")
    return [_file(path / name, stat.S_IFREG, **parts) for name in recordings]


def _recordings(path: Path, findings: list[Finding]) -> list[str]:
    """Names of the recording files in a directory (recognized by name), ordered by file number."""
    try:
        named = sorted((file for file in path.iterdir() if _NAME.fullmatch(file.name)), key=_by_number)
    except OSError as error:
        raise RecordingError(str(path), "", f"cannot be read: {error.strerror}") from error
    names = []
    for file in named:
        what = kind_of(_mode(file) or 0)
        if what:
            findings.append(Finding(file, f"is {what}, expected a file: it is not read", Severity.NOTE))
        else:
            names.append(file.name)
    return names


def _metadata(path: Path, findings: list[Finding]) -> tuple[list[str], dict[str, Any]]:
    """File names and common attributes from the metadata; empty if there is no reliable metadata."""
    if not os.path.lexists(path):
        return [], {}
    try:
        metadata = read_metadata(path)
    except DamageError as error:
        findings.append(Finding(path, f"{error}: the directory's files are taken instead", Severity.NOTE))
        return [], {}
    names = [name for name in metadata.files if _NAME.fullmatch(name)]
    if names != metadata.files:
        findings.append(
            Finding(path, "names other files than .mcap and .db3: they are not read", Severity.NOTE)
        )
    return names, {"by_message": metadata.by_message, "types": metadata.types}


def _by_number(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Sort key that orders run_2.mcap before run_10.mcap."""
    parts = re.findall(r"\d+|\D+", path.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], path.name
