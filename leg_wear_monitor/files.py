"""Files that are written whole or not at all, JSON, data frames, and where the files of the package lie."""

import fcntl
import glob
import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar
from xml.etree import ElementTree

import attrs

from leg_wear_monitor.errors import ConfigError, LegWearError, system_asked

if TYPE_CHECKING:
    import pandas as pd

_Record = TypeVar("_Record", bound=attrs.AttrsInstance)


# Files that are written whole or not at all.


def write_whole(path: Path, content: bytes) -> None:
    """Write a file and bring it to the disk; readers never see a partial file.

    Several processes may write the same file at the same time: the last one counts.

    Parameters
    ----------
    path : pathlib.Path
        Its directory is made if it does not exist. A symbolic link stays, and the file that it leads to is
        written.
    content : bytes

    Raises
    ------
    ConfigError
        If the disk does not take it; the file is then as it was.
    """
    target = path.resolve()
    with system_asked(path, "cannot be written"):
        target.parent.mkdir(parents=True, exist_ok=True)
        with unfinished(target) as part:
            with part.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            part.replace(target)


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """A new file next to ``path`` to write into; it is removed at the end, unless it was put in its place.

    Files of killed processes are removed at the start.

    Parameters
    ----------
    path : pathlib.Path
        In a directory that exists, on a file system with locks.

    Raises
    ------
    OSError
        If the disk cannot be written.
    """
    remove_parts(path.parent, f"{glob.escape(path.name)}.[0-9]*")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    while True:
        with part.open("wb") as locked:
            fcntl.flock(locked, fcntl.LOCK_EX)  # prevents other processes from removing it
            if not _is_at(part, locked):  # a process has removed it before it was locked
                continue
            try:
                yield part
            finally:
                part.unlink(missing_ok=True)
            return


def _is_at(path: Path, file: IO[bytes]) -> bool:
    """True if an open file is still the file at a path."""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    return False


def remove_parts(directory: Path, names: str) -> None:
    """Remove parts of files that killed processes left in a directory.

    Parameters
    ----------
    directory : pathlib.Path
        It may not exist.
    names : str
        Pattern of the names of the files.
    """
    for part in directory.glob(f".{names}.part"):
        with suppress(OSError):  # in use by a process, or not removable, which is harmless
            if part.is_file() and not part.is_symlink():
                with part.open("r+b") as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    if _is_at(part, file):
                        part.unlink()


# JSON as files and standard output hold it, and numbers that are not known, which it has not.


def json_text(value: Any) -> str:
    """JSON of a plain value, indented, with a newline at its end.

    Raises
    ------
    ValueError
        For a number that JSON has not: NaN or infinite.
    """
    return json.dumps(value, indent=1, allow_nan=False) + "\n"


def read_json(path: str) -> Any:
    """Content of a JSON file that a parameter names.

    Raises
    ------
    ConfigError
        If it cannot be read, or is not JSON.
    """
    try:
        with system_asked(path, "cannot be read"):
            return json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ConfigError(path, "", f"is not JSON: {' '.join(str(error).split())}") from error


def finite_or_none(value: float | None) -> float | None:
    """A number for JSON or a table, None where it is NaN or infinite."""
    return None if value is None or not math.isfinite(value) else float(value)


def or_nan(value: float | None) -> float:
    """A number out of JSON or a table, NaN for None."""
    return math.nan if value is None else value


def number_of(text: str | None) -> float:
    """The number in a text of a table or a message; NaN if the text is not a number."""
    try:
        return float(text or "nan")
    except ValueError:
        return math.nan


def with_same_fields(kind: type[_Record], *of: object, **own: Any) -> _Record:
    """A record with its own values, and with attributes from the first object that has them."""
    names = attrs.fields_dict(kind).keys() - own.keys()
    return kind(
        **own, **{name: getattr(next(one for one in of if hasattr(one, name)), name) for name in names}
    )


# Directories of the files that come with the package: config/, launch/, bags/.


class ShareNotFoundError(LegWearError):
    """The package was copied somewhere without its share/ directory."""


def share_directory() -> Path:
    """Directory that contains config/, in every form of installation.

    A checkout is its own share directory; an editable install and ``colcon build --symlink-install`` lead
    back to it. Otherwise pip and colcon put ``share/leg_wear_monitor`` into the prefix that holds this file
    in its ``lib/python3.x/site-packages``, so a search upwards finds it: no ROS and no environment variable
    is needed.

    Returns
    -------
    pathlib.Path
        The checkout, or ``<prefix>/share/leg_wear_monitor``.

    Raises
    ------
    ShareNotFoundError
        If neither exists.
    """
    package = Path(__file__).resolve().parent
    if (package.parent / "package.xml").is_file():
        return package.parent
    for prefix in package.parents:
        share = prefix / "share" / package.name
        if (share / "config").is_dir():
            return share
    raise ShareNotFoundError(
        f"{package}: no share/{package.name}/config in any parent directory; install with pip or colcon"
    )


def package_version() -> str:
    """Version of this package, as package.xml has it."""
    return ElementTree.parse(share_directory() / "package.xml").findtext("version") or "unknown"


# Tables in pandas form; pandas is imported only if a caller asks for one.


def data_frame(columns: Any, index: str | list[str] | None = None) -> "pd.DataFrame":
    """Columns of equal length, or rows, as a data frame.

    Parameters
    ----------
    columns : mapping of str to sequence, or list of dict
    index : str or list of str, optional
        Columns that name the rows.

    Raises
    ------
    LegWearError
        If pandas is not installed.
    """
    try:
        import pandas as pd
    except ModuleNotFoundError as error:
        raise LegWearError("tables need pandas, which is not installed; pip install pandas") from error
    frame = pd.DataFrame(columns)
    return frame if index is None else frame.set_index(index)


def received_json(text: str, source: str, most: int) -> Any:
    """Contents of a JSON message from an unknown sender; NaN and infinities become None.

    Parameters
    ----------
    text : str
    source : str
        Name of the topic, for messages.
    most : int
        Characters that it may have.

    Raises
    ------
    ConfigError
        If it is longer, or no JSON.
    """
    if len(text) > most:
        raise ConfigError(source, "", f"has {len(text)} characters. Expected {most} at most")
    try:
        return json.loads(text, parse_constant=lambda _: None)
    except (ValueError, RecursionError) as error:
        raise ConfigError(source, "", "is not JSON") from error
