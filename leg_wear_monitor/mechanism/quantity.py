"""A number with its unit, bounds and meaning, declared once."""

from typing import Any

import attrs


def quantity(
    unit: str,
    doc: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    default: Any = attrs.NOTHING,
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

    Raises
    ------
    ValueError
        On structuring, with a text such as ``-4.0 is not above 0 kg``.
    """

    def check(_instance: object, _attribute: "attrs.Attribute[Any]", value: Any) -> None:
        if value is None:
            return
        for number in value if isinstance(value, tuple) else (value,):
            if above is not None and not number > above:
                raise ValueError(f"{number!r} is not above {above:g} {unit}".rstrip())
            if at_least is not None and not number >= at_least:
                raise ValueError(f"{number!r} is below {at_least:g} {unit}".rstrip())
            if at_most is not None and not number <= at_most:
                raise ValueError(f"{number!r} is above {at_most:g} {unit}".rstrip())

    metadata = {"unit": unit, "doc": doc, "above": above, "at_least": at_least, "at_most": at_most}
    return attrs.field(default=default, validator=check, metadata=metadata)
