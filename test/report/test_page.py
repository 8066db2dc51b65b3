"""A page is whole: well formed, with nothing fetched from elsewhere, and a text for every picture."""

import pytest
from html_reader import read
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.report.figure import new_figure, png, svg
from leg_wear_monitor.report.page import (
    Fragment,
    Gallery,
    Page,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
    page_html,
)

pytestmark = pytest.mark.plain


def full_page():
    figure = new_figure(2.0, 1.0)
    one, other = (
        Picture(image=draw(figure), alt=f"an empty {draw.__name__}", caption="c") for draw in (png, svg)
    )
    rows = [["A", "1.0"], ["B", "2.0"]]
    table = Table(caption="numbers", head=("joint", "force [N]"), rows=rows, note="n")
    live = Fragment(
        markup='<svg id="s" role="img" aria-label="a leg"></svg>', script="let a = 1 < 2;", caption="l"
    )
    return Page(
        title="A page",
        summary="What was asked.",
        sections=[
            Section("Conclusions", [Sentences(["first", "second"])]),
            Section("Pictures", [one, Gallery(pictures=[one, other], caption="both"), live, live]),
            Section("Tables & texts", [table, Text("some text")]),
        ],
        configuration="speed_rpm: 60\n",
        versions={"leg_wear_monitor": "0.1.0", "seed": "1"},
    )


def test_a_page_is_well_formed_and_says_all_of_it():
    page = read(page_html(full_page()))
    said = "".join(page.texts)
    for text in (
        "A page",
        "What was asked.",
        "second",
        "numbers",
        "2.0",
        "some text",
        "speed_rpm: 60",
        "0.1.0",
    ):
        assert text in said
    assert {link["href"][1:] for link in page.of("a")} <= {part.get("id") for part in page.of("section")}
    assert len(page.of("a")) == 3


def test_every_picture_has_a_text_and_every_header_cell_a_scope():
    page = read(page_html(full_page()))
    assert [image["alt"] for image in page.of("img")] == ["an empty png", "an empty png", "an empty svg"]
    assert [image["src"][:15] for image in page.of("img")] == ["data:image/png;"] * 2 + ["data:image/svg+"]
    assert {cell["scope"] for cell in page.of("th")} == {"col", "row"}
    assert [element["lang"] for element in page.of("html")] == ["en"]


def test_a_script_runs_once_however_often_it_is_needed():
    assert page_html(full_page()).count("let a = 1 < 2;") == 1


@given(text=st.text(alphabet=st.sampled_from("<>&\"'/aä–")))
def test_whatever_a_text_holds_it_stays_a_text(text):
    table = Table(caption=text, head=(text,), rows=[(text,)], note=text)
    picture = Picture(image=b"<svg/>", alt=text, caption=text)
    parts = [Text(text), Sentences([text]), table, picture]
    plain = Page(title="t", summary="s", sections=[Section("x", [])])
    page = Page(title=text, summary=text, sections=[Section("x", parts)], versions={text: text})
    known = {tag for tag, _ in read(page_html(full_page())).elements}
    found = read(page_html(page))
    assert {tag for tag, _ in found.elements} <= known
    assert found.of("img")[0]["alt"] == text
    assert len(found.of("section")) == len(read(page_html(plain)).of("section")) + 1


def test_a_row_has_a_cell_for_every_column():
    with pytest.raises(ValueError, match="numbers"):
        Table(caption="numbers", head=("joint", "force"), rows=[["A"]])
