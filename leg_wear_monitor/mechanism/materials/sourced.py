"""Numbers with their source, as material files have them."""

import math
from functools import partial
from typing import Any

import attrs

from leg_wear_monitor.configuration.quantity import FieldError, described
from leg_wear_monitor.mechanism.materials.units import UNITS, units_of


def _blank(text: str) -> str | None:
    return None if text.strip() else "is empty, expected a text"


def _interval(interval: tuple[float, float]) -> str | None:
    return None if interval[0] <= interval[1] else f"{list(interval)} does not rise"


@attrs.frozen(kw_only=True)
class SourcedValue:
    """A number with its source; a range alone stands for its middle."""

    value: float | None = described("the number; without it, the middle of the range", default=None)
    unit: str = described("its unit, one of those below")
    source: str = described("where it is from: author, title, year, or page", check=_blank)
    conditions: str = described("what it was measured on, or holds for", check=_blank)
    range: tuple[float, float] | None = described(
        "lowest and highest value that the source gives", default=None, check=_interval
    )

    def __attrs_post_init__(self) -> None:
        if self.unit not in UNITS:
            raise FieldError("unit", f"{self.unit!r} is not one of {', '.join(UNITS)}")
        if self.value is None and self.range is None:
            raise FieldError("value", "is missing, and so is range, expected one of them")

    @property
    def central(self) -> float:
        """The value in its own unit; of a range, its geometric middle, or the mean where it reaches 0."""
        if self.value is not None:
            return self.value
        low, high = self.range or (math.nan, math.nan)
        return math.sqrt(low * high) if low > 0.0 else 0.5 * (low + high)

    @property
    def si(self) -> float:
        """The value in SI units; a temperature in degrees Celsius."""
        return self.central * UNITS[self.unit].factor

    @property
    def text(self) -> str:
        """The number as its source gives it, with its range and unit."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        interval = "" if self.range is None else f"{self.range[0]:g} to {self.range[1]:g}"
        if self.value is None:
            return f"{interval}{unit}"
        return f"{self.value:g}{unit}" + (f" ({interval})" if interval else "")


@attrs.frozen(kw_only=True)
class WearCoefficient(SourcedValue):
    """A wear coefficient; a dimensionless K comes with the hardness that it belongs to."""

    hardness: SourcedValue | None = described(
        "hardness that a dimensionless K is divided by",
        default=None,
        check=lambda value: unit_fault("pressure", value),
    )
    spread: SourcedValue | None = described(
        "logarithmic standard deviation of the coefficient, from part to part and from test to test",
        default=None,
        check=lambda value: unit_fault("logarithmic standard deviation", value),
    )

    def __attrs_post_init__(self) -> None:
        super().__attrs_post_init__()
        needs = UNITS[self.unit].needs_hardness
        if needs and self.hardness is None:
            raise FieldError("hardness", f"is missing, expected the hardness H of {self.unit}")
        if not needs and self.hardness is not None:
            raise FieldError("hardness", f"does not belong to a coefficient in {self.unit}")

    @property
    def si(self) -> float:
        """The wear coefficient k of V = k F s [1/Pa]."""
        coefficient = self.central * UNITS[self.unit].factor
        return coefficient if self.hardness is None else coefficient / self.hardness.si


def unit_fault(dimension: str, value: SourcedValue) -> str | None:
    """What is wrong with the unit or the sign of a value that measures this; None if nothing is."""
    if UNITS[value.unit].dimension != dimension:
        known = " or ".join(units_of(dimension))
        return f"unit {value.unit!r} is not one of {dimension}, expected {known}"
    if dimension != "temperature" and not (value.central > 0.0 and min(value.range or (0.0,)) >= 0.0):
        return f"{value.central!r} {value.unit} is not above 0"
    return None


def sourced(dimension: str, doc: str) -> Any:
    """Attrs field for an optional `SourcedValue` that measures this."""
    return described(
        doc, default=None, check=partial(unit_fault, dimension), metadata={"dimension": dimension}
    )
