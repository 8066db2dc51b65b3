"""Tables for pandas: what happens without it, and that nothing but it is needed."""

import sys

import pytest

from leg_wear_monitor import LegWearError
from leg_wear_monitor.files import data_frame

pytestmark = pytest.mark.plain


def test_without_pandas_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(LegWearError, match=r"^tables need pandas, .*; pip install pandas$"):
        data_frame({"joint": ["A"]})


def test_columns_become_a_frame():
    pytest.importorskip("pandas")
    frame = data_frame({"joint": ["A", "B"], "force_n": [1.0, 2.0]}, index="joint")
    assert frame.loc["B", "force_n"] == 2.0
    assert list(frame.columns) == ["force_n"]
