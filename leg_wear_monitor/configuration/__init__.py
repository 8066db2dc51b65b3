"""Settings: YAML within bounds, strict conversion with one clear line per error. Each key is declared once.

The modules imported here import neither numpy nor numba.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from typing import Any

import attrs

# A key of a file with its unit, bounds and meaning, declared once for checks and documentation.


USUAL = "{value:g} {unit}, usually {usual} {unit}"
LEAST = 1.0e-30  # least positive value: in SI units, its square and its inverse stay finite


class FieldError(ValueError):
    """The value of a key is not allowed.

    Parameters
    ----------
    key : str
        Dotted path of the key.
    fault : str
        Found and expected value.
    """

    def __init__(self, key: str, fault: str) -> None:
        self.key, self.fault = key, fault
        super().__init__(f"{key}: {fault}" if key else fault)


@attrs.frozen
class Doubt:
    """A value that is valid, but far outside the usual: likely in a wrong unit.

    Attributes
    ----------
    key : str
        Dotted path in the file.
    fault : str
        The value, the usual range, and the likely confusion of units.
    """

    key: str
    fault: str

    def __str__(self) -> str:
        return f"{self.key}: {self.fault}"


def described(
    doc: str,
    *,
    unit: str = "",
    default: Any = attrs.NOTHING,
    factory: Callable[[], Any] | None = None,
    check: Callable[[Any], str | None] | None = None,
    metadata: Mapping[str, Any] | None = None,
    in_repr: bool = True,
) -> Any:
    """Attrs field with its unit and a description.

    Parameters
    ----------
    doc : str
        Meaning of the field, in one line.
    unit : str
        SI unit, ``""`` if there is none.
    default, factory : optional
        Value when the key is absent; without either the key is required.
    check : callable, optional
        Returns the fault of a value, None if there is none.
    metadata : mapping, optional
        Further metadata, stored with unit and doc.
    in_repr : bool
        True if it is in the object's repr; False for a field that no result depends on.

    Raises
    ------
    FieldError
        When an instance is made, naming the key.
    """

    def validate(_instance: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
        fault = check(value) if check and value is not None else None
        if fault:
            raise FieldError(attribute.name, fault)

    return attrs.field(
        default=default if factory is None else attrs.Factory(factory),
        validator=validate,
        repr=in_repr,
        metadata={"doc": doc, "unit": unit, **(metadata or {})},
    )


def quantity(
    unit: str,
    doc: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    within: tuple[float, float] | None = None,
    usual: tuple[float, float] | None = None,
    doubt: str | Callable[[float], str] = USUAL,
    default: Any = attrs.NOTHING,
    check: Callable[[Any], str | None] | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Any:
    """Attrs field for a number, or a tuple of numbers, that checks its bounds.

    Parameters
    ----------
    unit : str
        SI unit, ``""`` for a pure number.
    doc : str
        Meaning of the field, in one line.
    above, at_least, at_most : float, optional
        Bounds, the first exclusive.
    within : tuple of float, optional
        Both of `at_least` and `at_most`.
    usual : tuple of float, optional
        Least and most of its size beyond which `doubts` names it.
    doubt : str or callable
        Message for a value beyond, with ``{value}``, ``{unit}`` and ``{usual}``; a function of the value
        if the unit that is likely meant depends on it.
    default : optional
        Value when the key is absent; without it the key is required.
    check : callable, optional
        Returns a further fault of a value within its bounds, None if there is none.
    metadata : mapping, optional
        Further metadata, stored with unit, doc and bounds.

    Raises
    ------
    FieldError
        When an instance is made, with a text such as ``mass: -4.0 is not above 0 kg``.
    """
    at_least, at_most = within or (at_least, at_most)

    def fault(value: Any) -> str | None:
        for number in value if isinstance(value, tuple) else (value,):
            if above is not None and not number > above:
                return f"{number!r} is not above {above:g} {unit}".rstrip()
            if above == 0.0 and number < LEAST:
                return f"{number!r} is too close to 0. Expected more than {LEAST:g} {unit}".rstrip()
            if at_least is not None and not number >= at_least:
                return f"{number!r} is not at least {at_least:g} {unit}".rstrip()
            if at_most is not None and not number <= at_most:
                return f"{number!r} is not at most {at_most:g} {unit}".rstrip()
        return check(value) if check else None

    bounds = {"above": above, "at_least": at_least, "at_most": at_most, "usual": usual, "doubt": doubt}
    return described(doc, unit=unit, default=default, check=fault, metadata={**bounds, **(metadata or {})})


def doubts(thing: Any, section: str = "") -> Iterator[Doubt]:
    """Unusual values of an attrs object; if a key has several numbers, the largest unusual number."""
    for field in attrs.fields(type(thing)):
        if not (usual := field.metadata.get("usual")):
            continue
        value = getattr(thing, field.name)
        if value == field.default:  # such as an undeclared key
            continue
        numbers = [one for one in (value if isinstance(value, tuple) else (value,)) if one is not None]
        beyond = [one for one in numbers if not usual[0] <= abs(one) <= usual[1]]
        if beyond:
            number, doubt = max(beyond, key=abs), field.metadata["doubt"]
            text = doubt(number) if callable(doubt) else doubt
            words = " to ".join(map(_short, usual)) if usual[0] else f"below {_short(usual[1])}"
            fault = text.format(value=number, unit=field.metadata["unit"], usual=words)
            yield Doubt(f"{section}{field.name}", fault)


def _short(bound: float) -> str:
    """A bound as people write it: 0.0001, 300, 1e4, 2e12."""
    return f"{bound:g}" if 1.0e-4 <= bound < 1.0e4 else re.sub(r"e\+?(-?)0?", r"e\1", f"{bound:.0e}")


def choice(names: tuple[str, ...], doc: str, *, default: str) -> Any:
    """Attrs field for one of several names."""

    def fault(value: str) -> str | None:
        return None if value in names else f"{value!r} is not one of {', '.join(names)}"

    return described(doc, default=default, check=fault, metadata={"names": names})


# Back to plain data, as JSON has it.


def part_document(part: Any) -> Any:
    """Fields of a part, or a plain value; null for unknown values."""
    if attrs.has(type(part)):
        return part_document(attrs.asdict(part, recurse=False))
    if isinstance(part, dict):
        return {name: part_document(value) for name, value in part.items()}
    if isinstance(part, tuple | list):
        return [part_document(value) for value in part]
    if hasattr(part, "tolist"):  # an array, without the time to import numpy
        return part_document(part.tolist())
    if isinstance(part, Enum):
        return part.name if isinstance(part, int) else part.value  # types that configuration.strict reads
    return None if isinstance(part, float) and not math.isfinite(part) else part
