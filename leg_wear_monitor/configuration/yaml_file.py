"""Reads a YAML file within bounds of its size, its depth and its expanded aliases."""

import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent, Event, NodeEvent

from leg_wear_monitor.errors import ConfigError

MOST_BYTES = 1_000_000  # the largest file of the package has 3000
MOST_VALUES, DEEPEST = 100_000, 50  # values that aliases add; depth with all of them expanded


def read_document(path: Path, source: str) -> Any:
    """Read a YAML 1.2 file as plain values.

    Parameters
    ----------
    path : pathlib.Path
    source : str
        Its name in messages.

    Raises
    ------
    FileNotFoundError
    ConfigError
        Naming the line at fault, or the exceeded bound.
    """
    try:
        text = _text(path, source)
        written = _values(text, source)
        document = YAML(typ="safe", pure=True).load(text)
    except UnicodeDecodeError as error:
        raise ConfigError(source, "", f"is not UTF-8 text: byte {error.start}") from error
    # an invalid date or number; a tag that does not fit its value; recursion
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
        raise ConfigError(source, "", f"is not YAML: {_fault(error)}") from error
    _check_size(document, written, source)
    return document


def _text(path: Path, source: str) -> str:
    """The file's text; devices are not read, since they may have no end."""
    try:
        kind = path.stat().st_mode
        if stat.S_ISCHR(kind) or stat.S_ISBLK(kind) or stat.S_ISSOCK(kind):
            raise ConfigError(source, "", "is a device, expected a file")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ConfigError(source, "", f"cannot be read: {reason}") from error
    if len(content) > MOST_BYTES:
        raise ConfigError(source, "", f"has more than {MOST_BYTES} bytes, it is not a configuration")
    return content.decode("utf-8")


def _values(text: str, source: str) -> int:
    """Number of values and keys as they are written; aliases count once.

    Stops at the first place that is too deep: to compose thousands of levels takes seconds.
    """
    number = 0
    try:
        for event, depth in events_with_depth(text):
            if depth > DEEPEST:
                raise ConfigError(source, "", f"is nested more than {DEEPEST} deep")
            number += isinstance(event, NodeEvent)
    except YAMLError:
        return number  # reported when the document is composed, after earlier faults
    return number


def events_with_depth(text: str) -> Iterator[tuple[Event, int]]:
    """Events of a YAML text during parsing, each with the number of open collections."""
    depth = 0
    for event in YAML(typ="safe", pure=True).parse(text):
        depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        yield event, depth


def _check_size(document: Any, written: int, source: str) -> None:
    """Check the size of a document with its aliases expanded, visiting each part only once."""
    values, levels = _extent(document, {}, frozenset())
    if levels > DEEPEST:
        raise ConfigError(source, "", f"is nested more than {DEEPEST} deep, or contains itself")
    if values > written + MOST_VALUES:
        raise ConfigError(source, "", f"its aliases expand to more than {MOST_VALUES} values")


def _extent(value: Any, known: dict[int, tuple[int, int]], above: frozenset[int]) -> tuple[int, int]:
    """Number of values in a value, including itself, and their depth; a recursive value has too many."""
    if not isinstance(value, dict | list | tuple | set):
        return 1, 0
    if id(value) in above or len(above) > DEEPEST:
        return 1, DEEPEST + 1
    if id(value) not in known:
        parts = [*value.keys(), *value.values()] if isinstance(value, dict) else list(value)
        extents = [_extent(part, known, above | {id(value)}) for part in parts]
        values, levels = 1 + sum(each[0] for each in extents), 1 + max((e[1] for e in extents), default=0)
        known[id(value)] = values, levels
    return known[id(value)]


def _fault(error: Exception) -> str:
    """The fault and its line, without the excerpt that ruamel.yaml prints below."""
    mark = error.problem_mark if isinstance(error, MarkedYAMLError) else None
    text = error.problem if isinstance(error, MarkedYAMLError) and error.problem else str(error)
    text = next(iter(text.splitlines()), type(error).__name__)
    if isinstance(error, DuplicateKeyError):
        text = text.split(" with value ")[0].replace("found ", "")
    return f"line {mark.line + 1}: {text}" if mark else text
