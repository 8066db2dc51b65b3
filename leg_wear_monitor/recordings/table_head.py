"""Head of a CSV file: separator, decimal mark, lines before the rows; numbers, dates and units as text."""

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.monitor.config.tables import COUNTS

STAMP, CRANK_ANGLE, CRANK_SPEED, DRIVE_TORQUE = "stamp", "crank_angle", "crank_speed", "drive_torque"
"""Keys of columns: the last part of the parameters that name them."""

_SEPARATORS = "\t;|, "  # if several fit, the first wins, because a comma may be a decimal mark
_SAMPLE = 200  # lines


@attrs.frozen
class Head:
    """The known properties of a table before its rows are read.

    Attributes
    ----------
    names : list of str
        Names of all columns.
    units : list of str
        Units of the columns, from a row of units below the names; empty without such a row.
    lines : int
        Lines before the first row.
    taken : str
        The line that was read as the names, as ``line 1 ('time,angle')``; empty without such a line.
    separator : str
    has_decimal_comma : bool
    """

    names: list[str]
    units: list[str] = attrs.Factory(list)
    lines: int = 0
    taken: str = ""
    separator: str = ","
    has_decimal_comma: bool = False


def head_of(lines: Sequence[str], wanted: str) -> Head:
    """Head of a CSV file.

    Parameters
    ----------
    lines : sequence of str
        The first lines of the file.
    wanted : str
        Name of a column: a line of text with this cell has the names.
    """
    lines = lines[:_SAMPLE]
    separator = _separator([line for line in lines if not line.startswith("#")] or lines)
    rows = [_cells(line, separator) for line in lines]
    width = _usual_width(rows)
    at = next((k for k, row in enumerate(rows) if wanted in row and not _is_values(row)), None)
    if at is not None:
        first = at + 1 + (len(rows) > at + 1 and _is_units(rows[at + 1]))
    else:
        first = _first_values(rows, width)
        at = _names_before(lines, rows, first - (first > 1 and _is_units(rows[first - 1])), width)
    units = rows[first - 1] if at is not None and first > at + 1 and _is_units(rows[first - 1]) else []
    names = [str(k + 1) for k in range(width)] if at is None else _fitted(rows[at], rows, first)
    taken = "" if at is None else f"line {at + 1} ({lines[at].strip()[:120]!r})"
    return Head(names, units, first, taken, separator, _has_decimal_comma(rows[first:]))


def _separator(lines: Sequence[str]) -> str:
    """The separator that gives most lines the same number of cells, of at least two."""

    def lines_alike(separator: str) -> int:
        widths = Counter(len(row) for line in lines if len(row := _cells(line, separator)) > 1)
        return max(widths.values(), default=0)

    best = max(_SEPARATORS, key=lines_alike)
    return best if lines_alike(best) else ","


def _cells(line: str, separator: str) -> list[str]:
    # numpy.savetxt writes the names behind a number sign
    line = line.strip().removeprefix("#").strip() if line.startswith("#") else line.rstrip("\r\n")
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:  # a cell of more than 128 kB
        return []


def _usual_width(rows: Sequence[list[str]]) -> int:
    widths = Counter(len(row) for row in rows if any(row))
    return max(widths, key=lambda width: (widths[width], width), default=0)


def _is_values(row: Sequence[str]) -> bool:
    """True if a row has numbers or dates, and hardly any text."""
    filled = [cell for cell in row if cell]
    values = sum(is_number(cell.replace(",", ".", 1)) or is_date(cell) for cell in filled)
    return 2 * values >= len(filled) > 0


def _first_values(rows: Sequence[list[str]], width: int) -> int:
    """Place of the first row of numbers, or the place after the first line with text."""
    found = (k for k, row in enumerate(rows) if len(row) == width and _is_values(row))
    return next(found, next((k + 1 for k, row in enumerate(rows) if any(row)), 0))


def _is_units(row: Sequence[str]) -> bool:
    filled = [cell for cell in row if cell not in ("", "-")]
    return bool(filled) and all(units_named(cell) for cell in filled)


def _names_before(lines: Sequence[str], rows: Sequence[list[str]], end: int, width: int) -> int | None:
    """The last line before the first row that has a name per column, or else the last line that has text.

    A row may end with a separator, so it may have one cell more than the names.
    """
    filled = [k for k in range(end) if any(rows[k])]
    fitting = [k for k in filled if len(_trimmed(rows[k])) in (width - 1, width)]
    return max(fitting or [k for k in filled if not lines[k].startswith("#")], default=None)


def _trimmed(row: Sequence[str]) -> list[str]:
    """A row without the empty cells at its end."""
    filled = [k for k, cell in enumerate(row) if cell]
    return list(row[: filled[-1] + 1]) if filled else []


def _fitted(names: list[str], rows: Sequence[list[str]], first: int) -> list[str]:
    """Names, one per cell of the first row, where one of the two lines ends with a separator."""
    row = rows[first] if first < len(rows) else names
    if len(_trimmed(row)) <= len(_trimmed(names)) <= len(row):
        return [*names, *[""] * len(row)][: len(row)]
    return names


def _has_decimal_comma(rows: Sequence[list[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    with_comma = any("," in cell and is_number(cell.replace(",", ".", 1)) for cell in cells)
    has_point = any("." in cell and is_number(cell) for cell in cells)
    return with_comma and not has_point


# Numbers, units and dates as text.


def is_number(text: str) -> bool:
    """True if a text is a number, NaN or infinity."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


_UNITS: Mapping[str, tuple[str, str]] = {
    text: (key, unit)
    for key, units in {
        STAMP: {"s": "s sec seconds sekunden", "ms": "ms", "us": "us µs μs", "ns": "ns"},
        CRANK_ANGLE: {
            "rad": "rad", "deg": "deg degree degrees grad °", "rev": "rev turn turns umdrehungen",
            COUNTS: "counts ticks",
        },
        CRANK_SPEED: {
            "rad/s": "rad/s rads 1/s", "deg/s": "deg/s degs °/s", "rev/s": "rev/s rps",
            "rpm": "rpm 1/min u/min",
        },
        DRIVE_TORQUE: {"N m": "nm newtonmeter", "N mm": "nmm mnm"},
    }.items()
    for unit, texts in units.items()
    for text in texts.split()
}  # fmt: skip
"""Kind of column and unit of a parameter, by the unit as tables spell it."""


def units_named(text: str) -> tuple[str, str] | None:
    """Key of a column and unit of its parameter, by the text of a unit such as ``[Nm]``; None if unknown."""
    bare = text.strip().strip("[]()").lower()
    return _UNITS.get("".join(each for each in bare if each not in " ·*_."))


def is_date(text: str) -> bool:
    """True if a text is a date in ISO 8601."""
    return bool(dates([text])[1][0])


def dates(texts: Sequence[str], form: str = "") -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps [ns] of dates and times, and whether each text is one.

    Parameters
    ----------
    texts : sequence of str
    form : str
        Format of `datetime.strptime`; empty: ISO 8601. Without a time zone in it, the texts are in UTC.
    """
    stamps, good = np.zeros(len(texts), np.int64), np.zeros(len(texts), bool)
    try:
        return _parsed(texts, form), ~good
    except ValueError:
        if len(texts) == 1:
            return stamps, good
    for k, text in enumerate(texts):
        (stamps[k],), (good[k],) = dates([text], form)
    return stamps, good


def _parsed(texts: Sequence[str], form: str) -> NDArray[np.int64]:
    if form:
        times = [datetime.strptime(text.strip(), form) for text in texts]
        texts = [(time.astimezone(UTC) if time.tzinfo else time).isoformat() for time in times]
    return np.array([_without_zone(text.strip()) for text in texts], "datetime64[ns]").astype(np.int64)


def _without_zone(text: str) -> str:
    """Text without the mark of UTC. Raises ValueError where numpy would only warn, or wrap around."""
    for mark in ("Z", "+00:00", "+0000"):
        text = text.removesuffix(mark)
    if len(text) < 10 or not "1970" <= text[:4] < "2038" or "+" in text or text.count("-") != 2:
        raise ValueError("not a date from 1970 to 2037 in UTC")
    return text.strip().replace(",", ".")  # ISO 8601 permits a decimal comma, numpy does not
