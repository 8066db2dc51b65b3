"""JSON as files and standard output hold it."""

import json
from typing import Any


def json_text(value: Any) -> str:
    """JSON of a plain value, indented, with a newline at its end.

    Raises
    ------
    ValueError
        For a number that JSON has not: NaN or infinite.
    """
    return json.dumps(value, indent=1, allow_nan=False) + "\n"
