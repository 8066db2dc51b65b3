"""JSON as files and standard output hold it, and numbers that are not known, which it has not."""

import json
import math
from typing import Any


def json_text(value: Any) -> str:
    """JSON of a plain value, indented, with a newline at its end.

    Raises
    ------
    ValueError
        For a number that JSON has not: NaN or infinite.
    """
    return json.dumps(value, indent=1, allow_nan=False) + "\n"


def finite_or_none(value: float | None) -> float | None:
    """A number for JSON or a table, None where it is NaN or infinite."""
    return None if value is None or not math.isfinite(value) else float(value)


def or_nan(value: float | None) -> float:
    """A number out of JSON or a table, NaN for None."""
    return math.nan if value is None else value
