"""Guides of the package as HTML, inside the pages of a replay and of the dashboard."""

import base64
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

_MEDIA = {".svg": "svg+xml", ".png": "png"}
_OWN_HEADING = 2  # heading level of a page's sections; headings of a document inside it are one level below


@lru_cache(maxsize=100)
def enclosed(path: Path) -> tuple[str, str]:
    """Title and markup of a document for a page that may be stored anywhere.

    The document contains no links to other documents.
    """
    tokens = [
        token
        for token in _parser().parse(path.read_text(encoding="utf-8"))
        if not (token.type == "fence" and token.info.startswith("{"))  # a directive of the site
    ]
    for token in _every(tokens):
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{int(token.tag[1]) + _OWN_HEADING - 1}"
        if token.type == "image":
            picture = path.parent / str(token.attrs["src"])
            data = base64.b64encode(picture.read_bytes()).decode()
            token.attrs["src"] = f"data:image/{_MEDIA[picture.suffix]};base64,{data}"
        _keep_links_to_sites(token)
    markup = str(_parser().renderer.render(tokens[3:], _parser().options, {}))  # the section has the title
    for wide in ("pre", "table"):  # keys reach a part that scrolls sideways
        markup = markup.replace(f"<{wide}>", f'<{wide} tabindex="0">')
    return tokens[1].content, markup


@lru_cache(maxsize=1)
def _parser() -> MarkdownIt:
    return MarkdownIt("commonmark", {"html": False}).enable("table")


def _every(tokens: Sequence[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from token.children or ()


def _keep_links_to_sites(token: Token) -> None:
    """Turn links within the documents into text."""
    kept, is_open = [], False
    for child in token.children or ():
        if child.type == "link_open":
            is_open = str(child.attrs["href"]).startswith("https://")
        if child.type not in ("link_open", "link_close") or is_open:
            kept.append(child)
    if token.children is not None:
        token.children = kept
