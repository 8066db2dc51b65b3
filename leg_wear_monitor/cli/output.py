"""Files written whole or not at all, to places that are known to take them before the work begins."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.whole_file import write_whole

if TYPE_CHECKING:
    from leg_wear_monitor.playback.result.replay_summary import ReplaySummary

SUMMARY, PAGE = "summary.json", "report.html"

STDOUT = Path("-")


def check_file(option: str, path: Path) -> None:
    """Make sure that a file can be written.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if path.is_dir():
        raise ConfigError(option, str(path), "is a directory, expected a file to write")
    if _is_stream(path):
        return
    if not path.parent.is_dir():
        raise ConfigError(option, str(path), f"there is no directory {path.parent}")
    _try(option, path, path.resolve().parent)


def check_directory(option: str, path: Path) -> None:
    """Make sure that a directory can be written to, or made.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if path.exists() and not path.is_dir():
        raise ConfigError(option, str(path), "is a file, expected a directory to write to")
    above = path.resolve()
    while not above.exists():
        above = above.parent
    if not above.is_dir():
        raise ConfigError(option, str(path), f"{above} is a file, expected a directory")
    _try(option, path, above)


def check_outputs(json_file: Path | None, out: Path | None) -> None:
    """Make sure that the places of ``--json`` and ``--out`` can be written, as far as they are asked for.

    Raises
    ------
    ConfigError
        Naming the option, the path and why not.
    """
    if json_file is not None and json_file != STDOUT:
        check_file("--json", json_file)
    if out is not None:
        check_directory("--out", out)


def write_json(path: Path | None, text: str) -> list[Path]:
    """Write JSON to the place of ``--json``, and give the files written: none for stdout."""
    if path is None:
        return []
    if path == STDOUT:
        click.echo(text, nl=False)
        return []
    write_file(path, text.encode())
    return [path]


def write_file(path: Path, content: bytes) -> None:
    """Write a file such that no one ever sees a part of it; a device or a pipe just gets the bytes.

    Raises
    ------
    ConfigError
        When the disk does not take it.
    """
    if _is_stream(path):
        path.write_bytes(content)
        return
    write_whole(path, content)


def write_directory(path: Path, files: Mapping[str, bytes | None]) -> list[Path]:
    """Write files into a directory, each whole; None removes what an earlier run left.

    Returns
    -------
    list of pathlib.Path
        The files written, in the order given.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be made: {error.strerror}") from error
    for name, content in files.items():
        if content is None:
            (path / name).unlink(missing_ok=True)
        else:
            write_file(path / name, content)
    return [path / name for name, content in files.items() if content is not None]


def _is_stream(path: Path) -> bool:
    """A device or a pipe, which must not be replaced by a file."""
    return path.exists() and not path.is_file()


def _try(option: str, path: Path, directory: Path) -> None:
    """Only writing tells: rights, a read-only file system, and an administrator whom rights do not stop."""
    try:
        with tempfile.TemporaryFile(dir=directory):
            return
    except OSError as error:
        raise ConfigError(option, str(path), f"cannot be written: {error.strerror}") from error


def page_of(summary: "ReplaySummary") -> bytes:
    """The page of a replay."""
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.replay.page import replay_page

    return page_html(replay_page(summary)).encode()
