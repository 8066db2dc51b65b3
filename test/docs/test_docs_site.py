"""The site: clicks from the index, numbers of decisions, names in the reference of Python."""

import re
import runpy
from pathlib import Path

import leg_wear_monitor as lw

DOCS = Path(__file__).parents[2] / "docs"


def test_clicks_are_counted_over_the_shortest_way():
    clicks = runpy.run_path(str(DOCS / "_ext" / "three_clicks.py"))["clicks"]
    entries = {"index": ["a", "b"], "a": ["c"], "b": ["a", "c"], "c": ["d", "index"], "x": ["y"]}
    assert clicks("index", entries) == {"index": 0, "a": 1, "b": 1, "c": 2, "d": 3}


def test_decisions_are_numbered_without_holes_and_listed():
    files = sorted(path.name for path in DOCS.glob("decisions/[0-9]*.md"))
    assert [name[:4] for name in files] == [f"{number:04}" for number in range(1, len(files) + 1)]
    index = (DOCS / "decisions" / "index.md").read_text()
    for name in files:
        assert f"[{name[:4]}]({name})" in index and f"\n{name[:-3]}\n" in index
        assert (DOCS / "decisions" / name).read_text().startswith(f"# {name[:4]} ")


def test_every_public_name_has_its_place_in_the_reference_of_python():
    pages = "".join(path.read_text() for path in DOCS.glob("reference/python/*.rst"))
    documented = re.findall(r"^\.\. auto(?:function|class|exception):: (\w+)$", pages, re.MULTILINE)
    assert sorted(documented) == sorted(lw.__all__)


def test_the_picture_on_top_is_there_and_light():
    picture = DOCS / "knee_breaks.png"
    for page in (DOCS.parent / "README.md", DOCS / "index.rst"):
        shown = re.findall(r'src="(\S+)"', page.read_text())
        assert [DOCS / Path(each).name for each in shown] == [picture], page
    assert picture.stat().st_size < 400_000
