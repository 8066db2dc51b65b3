"""Values in the verdict's sentences: units that operators read, in three digits."""

import math

_KEYS = {"m/h": "m_per_hour", "N m": "nm"}
_UNITS = {key: unit for unit, key in _KEYS.items()} | {"n": "N", "hz": "Hz", "pa": "Pa"}
_SHOWN = {"m": (1.0e3, "mm"), "m/h": (1.0e6, "um/h"), "s": (1.0e3, "ms"), "rad": (1.0e3, "mrad")}


def with_unit(name: str, unit: str) -> str:
    """Key of a value in a status: a name that ends in the value's unit."""
    key = _KEYS.get(unit, unit.lower())
    return f"{name}_{key}" if key and not name.endswith(f"_{key}") else name


def unit_of(key: str, name: str) -> str:
    """Unit of a value by its key, for which `with_unit` was given a name; empty if the key is not of it."""
    if not key.startswith(f"{name}_"):
        return ""
    found = key.removeprefix(f"{name}_")
    return _UNITS.get(found, found)


def amount(value: float, unit: str) -> str:
    """A value [SI] with its unit, such as ``0.62 mm``; a fraction has none."""
    factor, shown = _SHOWN.get(unit, (1.0, unit))
    if unit == "s" and abs(value) >= 1.0:
        factor, shown = 1.0, unit
    return f"{_digits(factor * value)} {shown}".rstrip()


def estimate(value: float, sigma: float, unit: str) -> str:
    """A value [SI] and its standard deviation, such as ``0.62 mm ± 0.03 mm``."""
    return f"{amount(value, unit)} ± {amount(sigma, unit)}"


def _digits(value: float) -> str:
    if math.isnan(value):
        return "unknown"
    return f"{value:.0f}" if 999.5 <= abs(value) < 1.0e6 else f"{value:.3g}"
