"""YAML files within bounds, strict conversion to classes, libraries of files."""

import math
import reprlib
import stat
from collections.abc import Callable, Collection
from enum import Enum, IntEnum
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast, get_args, get_origin

import attrs
import cattrs
import numpy as np
from cattrs.errors import ClassValidationError, ForbiddenExtraKeysError
from cattrs.gen import make_dict_structure_fn
from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import CollectionStartEvent

from leg_wear_monitor.configuration import FieldError
from leg_wear_monitor.errors import ConfigError, did_you_mean, nearest
from leg_wear_monitor.files import share_directory


def unknown_fault(what: str, name: str, known: Collection[str], listed: str) -> str:
    """Error message for an unknown name.

    Parameters
    ----------
    what : str
        Kind of the name, such as ``key`` or ``parameter``.
    name : str
    known : collection of str
        Known names, to find a similar one.
    listed : str
        End of the message if there is no similar name: the place that lists the known names.
    """
    near = nearest(name, known)
    return f"unknown {what}, {f'did you mean {near}?' if near else listed}"


# Strict conversion with cattrs: no conversion between numbers and texts, unknown keys are errors.


MOST = 1.0e30  # bound in SI units, so that squares and ratios stay finite

_Hook = Callable[[Any, Any], Any]
_T = TypeVar("_T")

_FAULTS = (ClassValidationError, FieldError)


def structure(value: Any, kind: type[_T], source: str, key: str) -> _T:
    """Convert the value of a key in a file to the type ``kind``.

    Raises
    ------
    ConfigError
        Names the source, the key at fault, its value and the expected value.
    """
    try:
        return cast(_T, _part(key, value, kind))
    except FieldError as error:
        raise ConfigError(source, error.key, error.fault) from error


def structure_of_version(
    record: Any, kind: type[_T], version: int, source: str, again: str, missing: int | None = None
) -> _T:
    """Convert an object that a command wrote with one ``schema_version``; ``again`` says how to renew it."""
    record = structure(record, dict[str, Any], source, "")
    found = record.get("schema_version", missing)
    if found != version:
        fault = f"{reprlib.repr(found)} is not {version}, the only version that this command reads; {again}"
        raise ConfigError(source, "schema_version", fault)
    parts = {name: part for name, part in record.items() if name != "schema_version"}
    return structure(parts, kind, source, "")


def choose(kind: Any, pick: Callable[[Any], tuple[Any, Any]]) -> None:
    """Structure a type as a different type: for a value, ``pick`` returns this type and its value."""

    def hook(value: Any, _kind: Any) -> Any:
        chosen, taken = pick(value)
        return _converter.structure(taken, chosen)

    _converter.register_structure_hook_func(lambda other: other == kind, hook)


def mapping(value: Any) -> dict[str, Any]:
    """Return the value, a mapping of texts; raises FieldError if it is not."""
    if not isinstance(value, dict):
        raise FieldError("", f"{shown(value)} is not a mapping of keys")
    for key in value:
        if not isinstance(key, str) or not key.isprintable():
            raise FieldError("", f"the key {shown(key)} is not a text on one line")
    return value


def shown(value: Any) -> str:
    """Value for a message: on one line, and not too long."""
    return "nothing" if value is None else reprlib.repr(value)


def _part(step: str, value: Any, kind: Any) -> Any:
    """Convert a part of a file; errors name this part."""
    try:
        return _converter.structure(value, kind)
    except _FAULTS as error:
        inner = _field_error(error)
        raise FieldError(".".join(filter(None, (step, inner.key))), inner.fault) from error


def _field_error(error: BaseException) -> FieldError:
    """The first fault; unknown keys come first, because they may explain missing keys."""
    if isinstance(error, FieldError):
        return error
    if isinstance(error, ForbiddenExtraKeysError):
        key, known = min(error.extra_fields), [attribute.name for attribute in attrs.fields(error.cl)]
        return FieldError(key, unknown_fault("key", key, known, f"expected one of {', '.join(known)}"))
    if not isinstance(error, ClassValidationError):
        raise error
    located, elsewhere = error.group_exceptions()
    if elsewhere:
        return _field_error(elsewhere[0])
    inner, note = located[0]
    return _of_attribute(inner, getattr(attrs.fields(error.cl), note.name))


def _of_attribute(error: BaseException, attribute: "attrs.Attribute[Any]") -> FieldError:
    """Fault of one attribute of a class, with its unit."""
    unit = f" [{attribute.metadata['unit']}]" if attribute.metadata.get("unit") else ""
    if isinstance(error, KeyError):
        doc = attribute.metadata.get("doc")
        return FieldError(attribute.name, f"is missing. Expected: {doc}{unit}" if doc else "is missing")
    inner = _field_error(error)
    name = "" if attribute.metadata.get("flat") else attribute.name
    return FieldError(".".join(filter(None, (name, inner.key))), inner.fault + unit)


# --- conversions by type ---


def _number(value: Any, _kind: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FieldError("", f"{shown(value)} is not a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FieldError("", f"{shown(value)} is not a finite number")
    if abs(number) > MOST:
        raise FieldError("", f"{shown(value)} is too large. Expected at most {MOST:g}")
    return number


def _integer(value: Any, _kind: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise FieldError("", f"{shown(value)} is not a whole number")
    return value


def _flag(value: Any, _kind: Any) -> bool:
    if not isinstance(value, bool):
        raise FieldError("", f"{shown(value)} is not true or false")
    return value


def _text(value: Any, _kind: Any) -> str:
    if not isinstance(value, str) or not value.isprintable():
        raise FieldError("", f"{shown(value)} is not a text on one line")
    return value


def _member(value: Any, kind: type[Enum]) -> Enum:
    """A member of an enumeration: by its name if the values are numbers, by its text if they are texts."""
    members = {one.name if isinstance(one, int) else one.value: one for one in kind}
    if not isinstance(value, str) or value not in members:
        raise FieldError("", f"{shown(value)} is not one of {', '.join(map(repr, members))}")
    return members[value]


def _optional_number(value: Any, kind: Any) -> float | None:
    return None if value is None else _number(value, kind)


def _strict_class(kind: type) -> _Hook:
    inner: _Hook = make_dict_structure_fn(kind, _converter)
    flat = next((a.name for a in attrs.fields(kind) if a.metadata.get("flat")), None)
    own = {a.name for a in attrs.fields(kind)} - {flat}

    def hook(value: Any, _kind: Any) -> Any:
        given = mapping(value)
        if flat:  # a single attribute takes all remaining keys
            rest = {key: entry for key, entry in given.items() if key not in own}
            given = {key: entry for key, entry in given.items() if key in own} | {flat: rest}
        return inner(given, kind)

    return hook


def _strict_mapping(kind: Any) -> _Hook:
    item = get_args(kind)[1]
    return lambda value, _: {name: _part(name, entry, item) for name, entry in mapping(value).items()}


def _strict_tuple(kind: Any) -> _Hook:
    items = get_args(kind)
    what = {float: "numbers", str: "texts"}.get(items[0], "mappings" if attrs.has(items[0]) else "lists")
    wanted = f"a list of {what}" if items[-1] is Ellipsis else f"a list of {len(items)} {what}"

    def hook(value: Any, _kind: Any) -> tuple[Any, ...]:
        if not isinstance(value, list) or (items[-1] is not Ellipsis and len(value) != len(items)):
            raise FieldError("", f"{shown(value)} is not {wanted}")
        if attrs.has(items[0]):
            return tuple(_part(_place(k, entry), entry, items[0]) for k, entry in enumerate(value, 1))
        return tuple(_converter.structure(entry, items[0]) for entry in value)

    return hook


def _place(number: int, entry: Any) -> str:
    """Name of a mapping in a list: its id, or its number if it has no id."""
    name = entry.get("id") if isinstance(entry, dict) else None
    return name if isinstance(name, str) and name and name.isprintable() else str(number)


def _array(kind: Any) -> _Hook:
    """A list of numbers as an array; in arrays of floats, null means NaN."""
    (number,) = get_args(get_args(kind)[1])
    is_whole = issubclass(number, np.integer)

    def entry(value: Any) -> float:
        if is_whole:
            return _integer(value, int)
        return math.nan if value is None else _number(value, float)

    def hook(value: Any, _kind: Any) -> Any:
        if not isinstance(value, list):
            raise FieldError("", f"{shown(value)} is not a list of numbers")
        try:
            return np.array([entry(each) for each in value], number)
        except OverflowError as error:
            raise FieldError("", f"{shown(value)} has a number that is too large") from error

    return hook


def _generic(origin: Any) -> Callable[[Any], bool]:
    return lambda kind: get_origin(kind) is origin


_converter = cattrs.Converter(forbid_extra_keys=True, detailed_validation=True)
_converter.register_structure_hook(float, _number)
_converter.register_structure_hook(int, _integer)
_converter.register_structure_hook(bool, _flag)
_converter.register_structure_hook(str, _text)
_converter.register_structure_hook(Enum, _member)
_converter.register_structure_hook(IntEnum, _member)  # needs its own hook, because it is an int as well
_converter.register_structure_hook(float | None, _optional_number)
_converter.register_structure_hook_factory(attrs.has, _strict_class)
_converter.register_structure_hook_factory(_generic(dict), _strict_mapping)
_converter.register_structure_hook_factory(_generic(tuple), _strict_tuple)
_converter.register_structure_hook_factory(_generic(np.ndarray), _array)


# Reads a YAML file of bounded size, without lists and mappings that aliases expand.


MOST_BYTES = 1_000_000  # the largest file of the package has 3000


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
        Naming the line at fault, or the largest size.
    """
    try:
        text = _read_text(path, source)
        _check_anchors(text, source)
        document = YAML(typ="safe", pure=True).load(text)
    except UnicodeDecodeError as error:
        raise ConfigError(source, "", f"is not UTF-8 text: byte {error.start}") from error
    # an invalid date or number; a tag that does not fit its value; too deep
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
        raise ConfigError(source, "", f"is not YAML: {_fault(error)}") from error
    return document


def _check_anchors(text: str, source: str) -> None:
    """Refuse an anchor of a list or mapping: a few lines of its aliases can fill any memory."""
    for event in YAML(typ="safe", pure=True).parse(text):
        if isinstance(event, CollectionStartEvent) and event.anchor:
            fault = f"&{event.anchor} names a list or mapping. Expected a single value"
            raise ConfigError(source, "", f"line {event.start_mark.line + 1}: {fault}")


def _read_text(path: Path, source: str) -> str:
    """The text of the file; devices are refused, because reading them may never end."""
    try:
        kind = path.stat().st_mode
        if stat.S_ISCHR(kind) or stat.S_ISBLK(kind) or stat.S_ISSOCK(kind):
            raise ConfigError(source, "", "is a device. Expected a file")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ConfigError(source, "", f"cannot be read: {reason}") from error
    if len(content) > MOST_BYTES:
        raise ConfigError(source, "", f"has more than {MOST_BYTES} bytes. Expected a configuration")
    return content.decode("utf-8")


def _fault(error: Exception) -> str:
    """The fault and its line, without the excerpt that ruamel.yaml prints below."""
    mark = error.problem_mark if isinstance(error, MarkedYAMLError) else None
    text = error.problem if isinstance(error, MarkedYAMLError) and error.problem else str(error)
    text = next(iter(text.splitlines()), type(error).__name__)
    if isinstance(error, DuplicateKeyError):
        text = text.split(" with value ")[0].replace("found ", "")
    return f"line {mark.line + 1}: {text}" if mark else text


# Files of one kind that come with the package, and a user's own files of this kind.


@attrs.frozen
class Library:
    """Files of a folder of ``config/``, called by name.

    Attributes
    ----------
    folder : str
    what : str
        Word for such a file in messages.
    kind : type
        Class of the structured file.
    """

    folder: str
    what: str
    kind: type

    def files(self) -> dict[str, Path]:
        """Files that come with the package, by name."""
        return dict(_files(share_directory() / "config" / self.folder))

    def unknown(self, name_or_path: str | Path) -> str:
        """Fault of a name that none of the files has; empty for a path or a known name."""
        name, known = Path(name_or_path), self.files()
        if _is_path(name) or str(name) in known:
            return ""
        hint = did_you_mean(str(name), known)
        return f"no {self.what} of this name, leg-wear-monitor {self.folder} lists them{hint}"

    def load(self, name_or_path: str | Path) -> Any:
        """Read a file: by name, or by a path, which is anything with a suffix or a directory.

        Raises
        ------
        ConfigError
            Names file, key, value and the expected value.
        """
        path = Path(name_or_path)
        if _is_path(path):
            return _read(path, str(path), self.kind)
        fault = self.unknown(path)
        if fault:
            raise ConfigError(str(name_or_path), "", fault)
        return _shipped(self.files()[path.name], self.kind)


def _is_path(path: Path) -> bool:
    return bool(path.suffix) or path.parent != Path()


@cache
def _files(directory: Path) -> dict[str, Path]:
    return {path.stem: path for path in sorted(directory.glob("*.yaml"))}


@cache
def _shipped(path: Path, kind: type) -> Any:
    """A file of the package, which each joint of a leg asks for."""
    return _read(path, path.name, kind)


def _read(path: Path, source: str, kind: type) -> Any:
    try:
        document = read_document(path, source)
    except FileNotFoundError as error:
        raise ConfigError(source, "", f"cannot be read: {error.strerror}") from error
    return structure(document, kind, source, "")
