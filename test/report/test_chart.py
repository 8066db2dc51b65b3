"""A chart's CSV file has its series, with units, and what is not known is an empty cell."""

import csv
import io
from urllib.parse import unquote

import numpy as np
import pytest
from html_reader import read
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from leg_wear_monitor.report.page import Chart, Page, Panel, Section, Series, page_html

pytestmark = pytest.mark.plain

VALUES = arrays.arrays(float, 5, elements=st.floats(-1e30, 1e30) | st.just(np.nan))


def chart(*columns, x=None):
    time = Series(name="time", unit="s", values=np.arange(5.0) if x is None else x)
    series = [Series(name=f"force {k}", unit="N", values=values) for k, values in enumerate(columns)]
    panels = [Panel(title="<b>", series=[one]) for one in series]
    return Chart(name="forces", alt='"a&b"', caption="c", x=time, panels=panels, group="time")


def rows_of(address):
    head, _, text = address.partition(",")
    assert head == "data:text/csv;charset=utf-8"
    return list(csv.reader(io.StringIO(unquote(text))))


@given(one=VALUES, other=VALUES)
def test_the_csv_file_has_the_series(one, other):
    drawn = chart(one, other)
    head, *rows = rows_of(drawn.address)
    assert head == ["time [s]", "force 0 [N]", "force 1 [N]"]
    values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    expected = np.stack([np.arange(5.0), one, other], axis=1)
    np.testing.assert_allclose(values, expected, rtol=1e-8, atol=0.0)


def test_a_page_has_the_chart_s_data_once_and_as_a_link_and_escapes_its_words():
    drawn = chart(np.arange(5.0))
    html = page_html(Page(title="t", summary="s", sections=[Section("x", [drawn])]))
    page = read(html)
    (link,) = (link for link in page.of("a") if "download" in link)
    assert link["download"] == "forces.csv"
    assert rows_of(link["href"])[1:] == [[f"{k}", f"{k}"] for k in range(5)]
    assert "<b>" not in html and [plots["aria-label"] for plots in page.of("div")] == ['"a&b"']
