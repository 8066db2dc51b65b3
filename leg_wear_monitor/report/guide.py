"""Documents of the package as HTML: as pages of the dashboard, and inside the page of a replay."""

import base64
import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.report.page import Page, render

FOLDER = "docs"
"""Below the share directory; nothing outside of it is shown."""

_OF_THE_SITE = "```{include}"  # begin of a page that only takes in another file

_MEDIA = {".svg": "svg+xml", ".png": "png"}
_NOT_IN_ANCHOR = re.compile(r"[^\w\s-]")
_OWN_HEADING = 2  # level of a page's sections: headings of a document inside it are below


def document_path(name: str) -> Path | None:
    """A document by its name below `FOLDER`, such as ``howto/csv.md``; None for anything else."""
    folder = (share_directory() / FOLDER).resolve()
    path = (folder / name).resolve()
    if path.suffix != ".md" or not path.is_relative_to(folder) or not path.is_file():
        return None
    return None if path.read_text(encoding="utf-8").startswith(_OF_THE_SITE) else path


@lru_cache(maxsize=100)
def document_page(path: Path) -> tuple[str, str]:
    """A document as a page with links to other documents, relative to its own; and the page's policy."""
    tokens = _tokens(path)
    page = Page(
        title=_title(tokens),
        summary="",
        sections=(),
        styles=("replay/replay.css", "guide.css"),
        has_dark=True,
    )
    markup = _markup(_with_links(tokens, partial(_leads_on, path)))
    return render("guide.html", page=page, markup=markup), page.policy


@lru_cache(maxsize=100)
def enclosed(path: Path) -> tuple[str, str]:
    """Title and markup of a document for a page that is a file, and may be anywhere.

    No link leads to another document.
    """
    tokens = _tokens(path)
    for token in _every(tokens):
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{int(token.tag[1]) + _OWN_HEADING - 1}"
        if token.type == "heading_open":
            token.attrs.pop("id", None)  # a page may enclose several
    body = tokens[3:]  # without its title, which is that of the section
    return _title(tokens), _markup(_with_links(body, lambda href: href.startswith("https://")))


def _tokens(path: Path) -> list[Token]:
    """The document, its headings with anchors and its pictures in it; what is for the site is left out."""
    tokens = [
        token
        for token in _parser().parse(path.read_text(encoding="utf-8"))
        if not (token.type == "fence" and token.info.startswith("{"))
    ]
    for heading, inline in pairwise(tokens):
        if heading.type == "heading_open":
            anchor = _NOT_IN_ANCHOR.sub("", inline.content.lower()).strip().replace(" ", "-")
            heading.attrs["id"] = anchor
    for token in _every(tokens):
        if token.type == "image":
            picture = path.parent / str(token.attrs["src"])
            data = base64.b64encode(picture.read_bytes()).decode()
            token.attrs["src"] = f"data:image/{_MEDIA[picture.suffix]};base64,{data}"
    return tokens


@lru_cache(maxsize=1)
def _parser() -> MarkdownIt:
    return MarkdownIt("commonmark", {"html": False}).enable("table")


def _markup(tokens: Sequence[Token]) -> str:
    markup = str(_parser().renderer.render(list(tokens), _parser().options, {}))
    for wide in ("pre", "table"):  # what scrolls sideways is reached by keys, too
        markup = markup.replace(f"<{wide}>", f'<{wide} tabindex="0">')
    return markup


def _title(tokens: Sequence[Token]) -> str:
    return tokens[1].content if len(tokens) > 1 else ""


def _every(tokens: Sequence[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from token.children or ()


def _leads_on(path: Path, href: str) -> bool:
    """Whether a link of a document leads to another one that is there, or to another site."""
    if href.startswith(("https://", "#")):
        return True
    folder = (share_directory() / FOLDER).resolve()
    there = (path.parent / href.partition("#")[0]).resolve()
    return there.is_relative_to(folder) and document_path(str(there.relative_to(folder))) is not None


def _with_links(tokens: Sequence[Token], is_kept: Callable[[str], bool]) -> Sequence[Token]:
    """With the links that are kept; others become text."""
    for token in tokens:
        kept, is_open = [], False
        for child in token.children or ():
            if child.type == "link_open":
                is_open = is_kept(str(child.attrs["href"]))
            if child.type not in ("link_open", "link_close") or is_open:
                kept.append(child)
        if token.children is not None:
            token.children = kept
    return tokens
