"""Links of the documents: each file and heading that one names is there."""

import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md")])


def targets(text):
    """What its links and pictures name."""
    for block in MarkdownIt().enable("table").parse(text):
        for token in block.children or ():
            if where := token.attrGet("href") or token.attrGet("src"):
                yield str(where)


def text_of(file):
    """Text of a page; that of another document where it includes one."""
    text = file.read_text()
    included = re.match(r"```{include} (\S+)", text)
    return (file.parent / included[1]).read_text() if included else text


@cache
def anchors(file):
    """Headings of a page as a forge links to them."""
    blocks = MarkdownIt().parse(text_of(file))
    heads = [after.content for one, after in pairwise(blocks) if one.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def dead(page):
    """Links of a page to what is not there; other sites are not asked."""
    found = []
    for target in targets(page.read_text()):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = unquote(target).partition("#")
        file = page.parent / path if path else page
        if not file.exists() or (anchor and anchor not in anchors(file.resolve())):
            found.append(target)
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page):
    assert dead(page) == []


def test_a_dead_link_would_be_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# One `x`, two\n[a](#one-x-two) [b](#three) [c](gone.md) ![d](gone.png) [e](https://x.example)\n"
    )
    assert dead(page) == ["#three", "gone.md", "gone.png"]
