"""Pages of a Parquet column, by their headers: how many rows there are, whatever the footer claims.

A header is a struct in Thrift's compact protocol; the numbers of fields and types are those of
https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift.
"""

from typing import IO, Any

import attrs

from leg_wear_monitor.bags.findings import DamageError

_WINDOW = 2**14  # bytes; the header of a page of numbers has about a hundred
_TRUE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 1, 3, 7, 8, 9, 10, 12
_INTEGERS = (4, 5, 6)
_UNCOMPRESSED, _COMPRESSED, _CHECKSUM, _DATA, _DATA_V2 = 2, 3, 4, 5, 8  # fields of a PageHeader
_VALUES = 1  # field of either header of data
_DEEPEST = 8


@attrs.frozen
class Pages:
    """What the pages of a column contain.

    Attributes
    ----------
    values : int
        With nulls: a value a row, if the column is no list.
    size : int
        Uncompressed [bytes].
    are_checked : bool
        Whether each has a checksum.
    """

    values: int
    size: int
    are_checked: bool


def pages_of(file: IO[bytes], begin: int, stored: int, most: int) -> Pages:
    """Pages of a column in a row group.

    Parameters
    ----------
    file : binary file
    begin, stored : int
        Offset and size of the column [bytes].
    most : int
        Values that are expected; there cannot be many more pages.

    Raises
    ------
    DamageError
        If the pages do not fill the column's bytes.
    """
    values, size, at, number, are_checked = 0, 0, begin, 0, True
    while at < begin + stored:
        number += 1
        file.seek(at)
        try:
            window = _Compact(file.read(_WINDOW))
            head = window.struct()
            compressed, expanded = int(head[_COMPRESSED]), int(head[_UNCOMPRESSED])
            data = head.get(_DATA) or head.get(_DATA_V2) or {}
            found = int(data.get(_VALUES, 0))
        except (IndexError, KeyError, TypeError, AttributeError) as error:
            raise DamageError(f"has no page at byte {at}") from error
        if min(compressed, expanded, found) < 0 or number > most + 2:
            raise DamageError(f"has no page at byte {at}")
        are_checked &= _CHECKSUM in head
        values, size, at = values + found, size + expanded, at + window.at + compressed
    if at != begin + stored:
        raise DamageError("has pages beyond its end")
    return Pages(values, size, are_checked)


class _Compact:
    """Reader of values in Thrift's compact protocol; raises IndexError at the end of its bytes."""

    def __init__(self, data: bytes) -> None:
        self._data, self.at = data, 0

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """Values by the numbers of their fields."""
        found: dict[int, Any] = {}
        field = 0
        while head := self._byte():
            field = field + (head >> 4) if head >> 4 else self._integer()
            kind = head & 15
            found[field] = kind == _TRUE if kind in (1, 2) else self._value(kind, depth + 1)
        return found

    def _value(self, kind: int, depth: int) -> Any:
        if depth > _DEEPEST:
            raise IndexError(depth)
        if kind in (1, 2, _BYTE):
            return self._byte()
        if kind in _INTEGERS:
            return self._integer()
        if kind == _STRUCT:
            return self.struct(depth)
        if kind in (_LIST, _SET):
            head = self._byte()
            return [
                self._value(head & 15, depth + 1) for _ in range(head >> 4 if head < 0xF0 else self._number())
            ]
        if kind not in (_DOUBLE, _BINARY):
            raise IndexError(kind)
        size = 8 if kind == _DOUBLE else self._number()
        self.at += size
        return self._data[self.at - size : self.at]

    def _byte(self) -> int:
        self.at += 1
        return self._data[self.at - 1]

    def _number(self) -> int:
        number, shift = 0, 0
        while True:
            byte = self._byte()
            number |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return number

    def _integer(self) -> int:
        number = self._number()
        return (number >> 1) ^ -(number & 1)
