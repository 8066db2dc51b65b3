"""Fields of JSON documents as the classes declare them: path, type, unit, description."""

import inspect
import re
import types
from collections.abc import Iterator
from enum import Enum, IntEnum
from functools import cache
from typing import Any, Union, get_args, get_origin

import attrs
import numpy as np

# What names the entries of a mapping; joints do, unless a mapping is here.
KEYS = {
    "topics": "topic", "faulty": "fault", "made_with": "program", "values": "key", "bodies_m": "body",
    "counts": "state", "cycles_not_used": "reason",
    "standard_error": "field",
}  # fmt: skip
UNITS = {
    "m": "m", "mps": "m/s", "mps2": "m/s²", "n": "N", "nm": "N m", "j": "J", "s": "s", "ns": "ns", "h": "h",
    "hours": "h", "days": "d", "rad": "rad", "deg": "°", "rpm": "rpm", "cycles": "gait cycles",
    "nms": "N m s", "hz": "Hz",
}  # fmt: skip
PLAIN = {str: "text", bool: "true or false", int: "whole number", float: "number"}

Row = tuple[str, str, str, str]


def unit_of(path: str, field: "attrs.Attribute[Any] | None" = None) -> str:
    """The field's declared unit, or what the innermost name that ends in a unit says."""
    if field is not None and "unit" in field.metadata:
        return str(field.metadata["unit"])
    for name in reversed(re.sub(r"<\w+>|\[\]", "", path).split(".")):
        stem, per, _ = name.partition("_per_cycle")
        if (unit := UNITS.get(stem.split("_")[-1])) and not (unit == "gait cycles" and stem != name):
            return f"{unit} a gait cycle" if per else unit
    return ""


def descriptions(kind: type) -> dict[str, str]:
    """What the section Attributes of a class's docstring says of each attribute; '' where it says nothing."""
    text = inspect.cleandoc(kind.__doc__ or "")
    section = re.search(r"\nAttributes\n-+\n(.*?)(?=\n\n\S|\Z)", text, re.DOTALL)
    found: dict[str, str] = {}
    names: list[str] = []
    for line in section[1].splitlines() if section else ():
        if line[:1].strip():
            names = [name.strip() for name in line.partition(" : ")[0].split(",")]
            found |= dict.fromkeys(names, "")
        else:
            found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
    return found


def described(kind: type, field: "attrs.Attribute[Any]") -> str:
    """What a field is: its own words, those of the docstring, or of the class if that has one line."""
    if "doc" in field.metadata:
        return str(field.metadata["doc"])
    for each in kind.__mro__:  # what a class inherits is described where it is declared
        if texts := descriptions(each).get(field.name):
            return texts
    return inspect.cleandoc(kind.__doc__ or "").replace("\n", " ")


def rows_of(kind: type, prefix: str = "", left_out: tuple[str, ...] = ()) -> Iterator[Row]:
    """Rows of all fields below a class of parts."""
    for field in attrs.fields(attrs.resolve_types(kind)):
        if field.name not in left_out:
            flat = field.metadata.get("flat")
            path = prefix.removesuffix(".") if flat else prefix + field.name
            yield from _rows(field.type, path, field, described(kind, field), is_flat=bool(flat))


def _rows(
    kind: Any, path: str, field: "attrs.Attribute[Any]", text: str, note: str = "", is_flat: bool = False
) -> Iterator[Row]:
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        known = [part for part in parts if part is not types.NoneType]
        null = " or null" if len(known) < len(parts) else ""
        if all(part in PLAIN for part in known):
            words = " or ".join(PLAIN[part] for part in known)
            yield path, words + null + note, unit_of(path, field), text
        else:
            yield from _rows(known[0], path, field, text, null + note)
    elif attrs.has(kind):
        if not is_flat:
            yield path, "object" + note, "", text
        yield from rows_of(kind, f"{path}.")
    elif origin is dict:
        key = f"{path}.<{KEYS.get(field.name, 'joint')}>"
        yield from _rows(parts[1], key, field, text, note)
    elif origin is tuple and parts[-1] is Ellipsis:
        yield from _rows(parts[0], f"{path}[]", field, text, note)
    else:
        yield path, _word(kind) + note, unit_of(path, field), text


def _word(kind: Any) -> str:
    """The type of a plain value."""
    if get_origin(kind) is tuple:
        return f"list of {len(get_args(kind))} numbers"
    if get_origin(kind) is np.ndarray:
        return "list of numbers"
    if isinstance(kind, type) and issubclass(kind, Enum):
        values = [each.name if issubclass(kind, IntEnum) else str(each.value) for each in kind]
        return "one of " + ", ".join(f"`{value}`" for value in values)
    return PLAIN[kind]


def leaves(value: Any, path: str = "") -> Iterator[str]:
    """Paths of plain values, of lists of them, and of what is null or empty; entries of lists in brackets."""
    if isinstance(value, dict) and value:
        for name, part in value.items():
            yield from leaves(part, f"{path}.{name}" if path else name)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for part in value:
            yield from leaves(part, f"{path}[]")
    else:
        yield path


@cache
def _patterns(row: str) -> tuple["re.Pattern[str]", ...]:
    """Of what a row lists, and of the parts above it."""
    names = row.split(".")
    above = (".".join(names[: number + 1]) for number in range(len(names)))
    return tuple(re.compile(re.sub(r"<\w+>", "[^.]+", re.escape(each))) for each in above)


def is_of(row: str, leaf: str) -> bool:
    """Whether a leaf is what a row lists, or a part above it that is null or empty."""
    return any(pattern.fullmatch(leaf) for pattern in _patterns(row))
