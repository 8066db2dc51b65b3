"""A key of a file with its unit, bounds and meaning, declared once for checks and documentation."""

from collections.abc import Callable, Mapping
from typing import Any

import attrs

LEAST = 1.0e-30  # least positive value: in SI units, its square and its inverse stay finite


class FieldError(ValueError):
    """The value of a key is not allowed.

    Parameters
    ----------
    key : str
        Dotted path of the key.
    fault : str
        What was found and what was expected.
    """

    def __init__(self, key: str, fault: str) -> None:
        self.key, self.fault = key, fault
        super().__init__(f"{key}: {fault}" if key else fault)


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
        What it is, in one line.
    unit : str
        SI unit, ``""`` where there is none.
    default, factory : optional
        Value when the key is absent; without either the key is required.
    check : callable, optional
        Returns the fault of a value, None if there is none.
    metadata : mapping, optional
        Further metadata, stored with unit and doc.
    in_repr : bool
        Whether it is in the object's repr; False for what no result depends on.

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
        What it is, in one line.
    above, at_least, at_most : float, optional
        Bounds, the first exclusive.
    default : optional
        Value when the key is absent; without it the key is required.
    check : callable, optional
        Returns another fault of a value within its bounds, None if there is none.
    metadata : mapping, optional
        Further metadata, stored with unit, doc and bounds.

    Raises
    ------
    FieldError
        When an instance is made, with a text such as ``mass: -4.0 is not above 0 kg``.
    """

    def fault(value: Any) -> str | None:
        for number in value if isinstance(value, tuple) else (value,):
            if above is not None and not number > above:
                return f"{number!r} is not above {above:g} {unit}".rstrip()
            if above == 0.0 and number < LEAST:
                return f"{number!r} is too close to 0, expected more than {LEAST:g} {unit}".rstrip()
            if at_least is not None and not number >= at_least:
                return f"{number!r} is not at least {at_least:g} {unit}".rstrip()
            if at_most is not None and not number <= at_most:
                return f"{number!r} is not at most {at_most:g} {unit}".rstrip()
        return check(value) if check else None

    bounds = {"above": above, "at_least": at_least, "at_most": at_most}
    return described(doc, unit=unit, default=default, check=fault, metadata={**bounds, **(metadata or {})})


def choice(names: tuple[str, ...], doc: str, *, default: str) -> Any:
    """Attrs field for one of several names."""

    def fault(value: str) -> str | None:
        return None if value in names else f"{value!r} is not one of {', '.join(names)}"

    return described(doc, default=default, check=fault, metadata={"names": names})
