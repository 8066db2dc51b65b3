"""Every fault code has a sentence and a guide."""

import re
from collections import Counter

import leg_wear_monitor as lw

DOCS = lw.share_directory() / "docs"
GUIDES = sorted((DOCS / "howto" / "verdict").glob("*.md"))
_SECTION = re.compile(r"^## ([A-Z_]+)\n\n((?:- .*\n)+)", re.MULTILINE)


def test_every_code_has_a_sentence_and_the_one_guide_that_names_it() -> None:
    sections = dict(_SECTION.findall((DOCS / "reference" / "codes.md").read_text(encoding="utf-8")))
    links = [
        (code.upper(), page.name)
        for page in GUIDES
        for code in re.findall(r"\]\(../../reference/codes\.md#(\w+)\)", page.read_text(encoding="utf-8"))
    ]
    assert Counter(code for code, _ in links) == Counter(sections.keys())
    for code, page in links:
        assert re.search(r"^- (Verdict|Alarm|Status)\b.*: \S.*\.$", sections[code], re.MULTILINE), code
        assert re.findall(r"^- Guide: \[.+\]\(../howto/verdict/(.+)\)\.$", sections[code], re.MULTILINE) == [
            page
        ]
    assert {page for _, page in links} == {page.name for page in GUIDES}
