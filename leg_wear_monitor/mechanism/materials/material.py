"""Types of a material file: one pair of bushing and journal, with its lubricant."""

from collections.abc import Iterator
from typing import Any

import attrs

from leg_wear_monitor.configuration.quantity import described
from leg_wear_monitor.mechanism.materials.sourced import SourcedValue, WearCoefficient, sourced
from leg_wear_monitor.shown import Shown


@attrs.frozen(kw_only=True)
class Side:
    """One of the two bodies in contact."""

    material: str = described("what it is made of")
    youngs_modulus: SourcedValue | None = sourced("pressure", "Young's modulus")
    poissons_ratio: SourcedValue | None = sourced("number", "Poisson's ratio")
    wear_coefficient: WearCoefficient | None = sourced("wear coefficient", "its own wear")
    roughness: SourcedValue | None = sourced("roughness", "Ra that the source asks for")
    is_counted: bool = described(
        "whether its own wear counts; false: the source measures the wear of the other body only",
        default=True,
    )

    @property
    def wear_si(self) -> float | None:
        """Its wear coefficient [1/Pa]; 0 if its wear is not counted, None if it is not known."""
        if self.wear_coefficient is not None:
            return self.wear_coefficient.si
        return None if self.is_counted else 0.0


@attrs.frozen(kw_only=True)
class Limits:
    """Limits of a pair, beyond which its coefficient does not hold."""

    static_pressure: SourcedValue | None = sourced("pressure", "largest pressure at rest")
    dynamic_pressure: SourcedValue | None = sourced("pressure", "largest pressure while sliding")
    sliding_speed: SourcedValue | None = sourced("speed", "largest sliding speed")
    oscillating_speed: SourcedValue | None = sourced(
        "speed", "largest sliding speed of a joint that swings; without it, that of any"
    )
    pressure_speed: SourcedValue | None = sourced("pressure times speed", "largest pressure times speed")
    lowest_temperature: SourcedValue | None = sourced("temperature", "lowest temperature")
    highest_temperature: SourcedValue | None = sourced("temperature", "highest temperature")


@attrs.frozen(kw_only=True)
class RatingLife:
    """Constants of the maker's formula of the life of a bushing."""

    constant: SourcedValue = sourced("number", "K_M, for p in N/mm^2, v in m/s and a life in h")
    exponent: SourcedValue = sourced("number", "n of (p v)^n")
    least_pressure_speed: SourcedValue = sourced("pressure times speed", "least p v to insert")
    largest_pressure_speed: SourcedValue | None = sourced(
        "pressure times speed", "largest p v for which these constants hold"
    )


@attrs.frozen(kw_only=True)
class Material(Shown):
    """A pair of bushing and journal with its lubricant."""

    name: str = described("name, as the file's")
    title: str = described("the pair, in words")
    bushing: Side = described("the bushing, a mapping of the keys below")
    journal: Side = described("the journal, a mapping of the keys below")
    lubricant: str = described("none, grease or oil, and which")
    regime: str = described("regime of wear that the numbers hold for")
    friction: SourcedValue | None = sourced("number", "friction coefficient")
    limits: Limits = described("limits, a mapping of the keys below", factory=Limits)
    rating_life: RatingLife | None = described("constants of the maker's formula of life", default=None)
    notes: str = described("what else a user must know", default="")

    @property
    def wear_coefficients(self) -> tuple[float, float] | None:
        """Wear coefficients of bushing and journal [1/Pa]; None unless both are known or not counted."""
        bushing, journal = self.bushing.wear_si, self.journal.wear_si
        return None if bushing is None or journal is None else (bushing, journal)

    def values(self) -> Iterator[tuple[str, SourcedValue]]:
        """Every number with its dotted key."""
        yield from _values(self, "")

    def to_dict(self) -> dict[str, Any]:
        """The keys of the file, and the SI value of each number as ``si``; absent ones are null."""
        document: dict[str, Any] = _document(self)
        return document


def _values(part: Any, path: str) -> Iterator[tuple[str, SourcedValue]]:
    for field in attrs.fields(type(part)):
        value, key = getattr(part, field.name), f"{path}{field.name}"
        if isinstance(value, SourcedValue):
            yield key, value
        if attrs.has(type(value)):
            yield from _values(value, f"{key}.")


def _document(part: Any) -> Any:
    if not attrs.has(type(part)):
        return list(part) if isinstance(part, tuple) else part
    record = {field.name: _document(getattr(part, field.name)) for field in attrs.fields(type(part))}
    return record | {"si": part.si} if isinstance(part, SourcedValue) else record
