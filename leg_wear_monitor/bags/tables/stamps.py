"""Times of the rows of a table as stamps, exact to the nanosecond where the table is."""

from collections.abc import Sequence
from decimal import Decimal

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.tables import DATE, STAMPS, TableInput

MOST_NS = (2**31 - 1) * 1_000_000_000  # the seconds of a ROS stamp are an int32: until 2038
_EXACT_NS = 1.0e15  # below, a double of the time has the nanosecond
_UTC = ("Z", "+00:00", "+0000")


@attrs.frozen
class Clock:
    """From the times of a table to stamps.

    Parameters
    ----------
    unit : str
        A key of `STAMPS`, or `DATE`.
    start_ns : int
        Stamp of time 0 [ns]; not for dates.
    """

    unit: str
    start_ns: int

    @classmethod
    def of(cls, table: TableInput) -> "Clock":
        """The clock that the parameters declare."""
        unit = table.units.stamp
        return cls(unit, 0 if unit == DATE else table.start_ns)

    def of_numbers(self, times: NDArray[np.number]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Stamps [ns] of times in the clock's unit, and whether each is within what a stamp can be."""
        if times.dtype.kind in "iu":
            scale = 10 ** STAMPS[self.unit]
            within = (times <= MOST_NS // scale) & (times >= -(MOST_NS // scale))
            stamps = np.where(within, times, 0).astype(np.int64) * scale
            return self._started(stamps, np.asarray(within))
        values = np.asarray(times, float)
        with np.errstate(invalid="ignore"):
            within = np.abs(values) <= MOST_NS / 10.0 ** STAMPS[self.unit]
        whole = np.floor(np.where(within, values, 0.0))
        rest = np.where(within, values, 0.0) - whole
        scale = 10 ** STAMPS[self.unit]
        stamps = whole.astype(np.int64) * scale + np.rint(rest * scale).astype(np.int64)
        return self._started(stamps, within)

    def of_texts(self, texts: Sequence[str], times: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Stamps [ns] of times that are also there as texts, and whether each is within its range."""
        stamps, within = self.of_numbers(times)
        power = STAMPS[self.unit]
        if np.abs(times[within]).max(initial=0.0) * 10.0**power >= _EXACT_NS:
            # below 1 a double has the nanosecond, and the text may have an exponent that no Decimal takes
            for k in np.flatnonzero(within & (np.abs(times) >= 1.0)).tolist():
                exact = int(Decimal(texts[k].strip().replace("_", "")).scaleb(power).to_integral_value())
                stamps[k] = exact + self.start_ns
        return stamps, within

    def _started(
        self, stamps: NDArray[np.int64], within: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        stamps = stamps + self.start_ns
        return stamps, within & (np.abs(stamps) <= MOST_NS)


def dates(texts: Sequence[str]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps [ns] of dates and times in UTC, and whether each is one."""
    plain = [_without_zone(text.strip()) for text in texts]
    try:
        return _parsed(plain), np.ones(len(plain), bool)
    except ValueError:
        stamps, good = np.zeros(len(plain), np.int64), np.zeros(len(plain), bool)
    for k, text in enumerate(plain):
        try:
            stamps[k], good[k] = _parsed([text])[0], bool(text)
        except ValueError:
            continue
    return stamps, good


def _without_zone(text: str) -> str:
    """Text without the mark of UTC; another zone is refused, as numpy reads it with a warning only."""
    for mark in _UTC:
        text = text.removesuffix(mark)
    is_one = len(text) >= 10 and "1970" <= text[:4] < "2038" and "+" not in text and text.count("-") == 2
    return text.strip() if is_one else "?"


def _parsed(texts: Sequence[str]) -> NDArray[np.int64]:
    parsed = np.array(texts, "datetime64[ns]")
    if np.isnat(parsed).any():
        raise ValueError("not a time")
    return parsed.astype(np.int64)
