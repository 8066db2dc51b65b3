"""Head of a CSV file: separator, decimal mark, and the lines before the first row of numbers."""

import csv
from collections import Counter
from collections.abc import Sequence

import attrs

from leg_wear_monitor.recordings.table_layout import dates, is_number, units_named

_SEPARATORS = "\t;|, "  # if several fit, the first one wins: a comma may be a decimal mark
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
        The line that was taken for the names, as ``line 1 ('time,angle')``; empty without such a line.
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
    return Head(names, units, first, taken, separator, _has_decimal_comma(rows[first:], separator))


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
    values = sum(is_number(cell.replace(",", ".", 1)) or bool(dates([cell])[1][0]) for cell in filled)
    return 2 * values >= len(filled) > 0


def _first_values(rows: Sequence[list[str]], width: int) -> int:
    """Place of the first row of numbers; without one, the place behind the first line with text."""
    found = (k for k, row in enumerate(rows) if len(row) == width and _is_values(row))
    return next(found, next((k + 1 for k, row in enumerate(rows) if any(row)), 0))


def _is_units(row: Sequence[str]) -> bool:
    filled = [cell for cell in row if cell not in ("", "-")]
    return bool(filled) and all(units_named(cell) for cell in filled)


def _names_before(lines: Sequence[str], rows: Sequence[list[str]], end: int, width: int) -> int | None:
    """The last line before the first row that has a name per column, or else the last line that has text.

    A row may end with a separator, so it may have one cell more than there are names.
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


def _has_decimal_comma(rows: Sequence[list[str]], separator: str) -> bool:
    cells = [cell for row in rows for cell in row]
    with_comma = any("," in cell and is_number(cell.replace(",", ".", 1)) for cell in cells)
    has_point = any("." in cell and is_number(cell) for cell in cells)
    return with_comma and not has_point
