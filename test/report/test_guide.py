"""Documents as pages, and inside of pages: nothing in them leads astray, nothing is fetched."""

import re

import pytest
from html_reader import read

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarms import FOLDER
from leg_wear_monitor.report.guide import document_page, document_path, enclosed

pytestmark = pytest.mark.plain


def test_every_document_is_a_page_with_its_title_and_its_pictures():
    folder = share_directory() / "docs"
    paths = [document_path(str(path.relative_to(folder))) for path in folder.rglob("*.md")]
    assert len(paths) > 40
    for path in filter(None, paths):
        html, _ = document_page(path)
        page = read(html)
        assert "".join(page.inside(lambda tag, _: tag == "h1")).strip(), path
        assert all(image["src"].startswith("data:image/") and image["alt"] for image in page.of("img")), path


def test_links_of_a_document_lead_to_documents_and_to_other_sites():
    path = document_path("howto/verdict/joint_at_limit.md")
    html, _ = document_page(path)
    hrefs = [link["href"] for link in read(html).of("a")]
    assert "../measure_clearance.md" in hrefs and "index.md#enter-a-replaced-part" in hrefs
    for href in hrefs[1:]:  # the first one leads back
        target, _, anchor = href.partition("#")
        there, _ = document_page((path.parent / target).resolve() if target else path)
        assert not anchor or f'id="{anchor}"' in there, href


@pytest.mark.parametrize(
    "path", sorted((share_directory() / FOLDER).glob("*.md")), ids=lambda path: path.stem
)
def test_a_guide_inside_a_page_has_no_link_to_a_document(path):
    title, markup = enclosed(path)
    assert title
    assert re.findall(r'href="(?!https://)', markup) == []
    assert not re.search(r"<h[12]|<script|id=", markup)


@pytest.mark.parametrize(
    "name", ["../setup.py", "../README.md", "howto/../../README.md", "howto/dashboard.png", "nowhere.md", ""]
)
def test_nothing_but_documents_is_shown(name):
    assert document_path(name) is None


def test_markup_in_a_document_is_text(tmp_path):
    path = tmp_path / "evil.md"
    path.write_text("# T\n\n<script>alert(1)</script> [a](javascript:alert(1)) <b>b</b>\n", encoding="utf-8")
    markup = enclosed(path)[1]
    assert "<script" not in markup and "<b>" not in markup
    assert "javascript:" not in re.sub(r"<p>.*</p>", "", markup)
