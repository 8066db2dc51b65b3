"""A chart as data: its series are a CSV file inside the page, which the page's script draws with uPlot."""

import csv
import io
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats


@attrs.frozen(kw_only=True, eq=False)
class Series:
    """A column of values.

    Attributes
    ----------
    name, unit : str
        Title of its column; no unit if empty.
    values : (n,) array
        NaN where it is not known.
    colour : str
        CSS variable of the page.
    style : str
        ``line``, ``dashed``, ``points`` or ``steps``.
    width : float
        Of a line [CSS pixels].
    """

    name: str
    unit: str
    values: Floats
    colour: str = "--series-0"
    style: str = "line"
    width: float = 1.5

    @property
    def head(self) -> str:
        """Title of the column with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@attrs.frozen(kw_only=True, eq=False)
class Panel:
    """Axes with series over the chart's x axis.

    Attributes
    ----------
    title : str
    series : sequence of Series
    low, high : float or None
        Ends of the y axis; those of the values if None.
    height : int
        [CSS pixels].
    lanes : sequence of str
        Words for the values 0, 1, … of each series, which is then drawn in a lane of its own.
    """

    title: str
    series: Sequence[Series]
    low: float | None = None
    high: float | None = None
    height: int = 170
    lanes: Sequence[str] = ()


@attrs.frozen(kw_only=True, eq=False)
class Chart:
    """Panels above each other, over one x axis.

    Attributes
    ----------
    name : str
        Stem of the name of its CSV file.
    alt, caption : str
    x : Series
    panels : sequence of Panel
    group : str
        Charts of one group share cursor and zoom.
    ends : tuple of float or None
        Of the x axis; the first and the last value if None.
    """

    name: str
    alt: str
    caption: str
    x: Series
    ends: tuple[float, float] | None = None
    panels: Sequence[Panel]
    group: str
    kind: str = attrs.field(default="chart", init=False)

    @property
    def columns(self) -> tuple[Series, ...]:
        """The x axis, and the series of all panels."""
        return (self.x, *(series for panel in self.panels for series in panel.series))

    @property
    def csv(self) -> str:
        """All columns as CSV, with units in the titles; an empty cell for what is not known."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(series.head for series in self.columns)
        for row in zip(*(series.values.tolist() for series in self.columns), strict=True):
            writer.writerow("" if np.isnan(value) else f"{value:.9g}" for value in row)
        return text.getvalue()

    @property
    def address(self) -> str:
        """The CSV file as a ``data:`` URL."""
        return "data:text/csv;charset=utf-8," + quote(self.csv, safe=",.-+()/: ")

    @property
    def settings(self) -> dict[str, Any]:
        """What the script needs beside the values, as plain data."""
        panels = list(map(_settings, self.panels))
        return {"group": self.group, "x": self.x.head, "ends": self.ends, "panels": panels}


def _settings(panel: Panel) -> dict[str, Any]:
    series = [
        {
            "name": each.name,
            "unit": each.unit,
            "colour": each.colour,
            "style": each.style,
            "width": each.width,
        }
        for each in panel.series
    ]
    ends = {"low": panel.low, "high": panel.high, "height": panel.height, "lanes": list(panel.lanes)}
    return {"title": panel.title, "series": series, **ends}
