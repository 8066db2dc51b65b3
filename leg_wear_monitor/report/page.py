"""One self-contained HTML page: sections of text, pictures, tables and sentences, and what made them.

A page needs no network and no other file: pictures and style are inside it, and its content security
policy forbids the rest. It prints, it fits a phone, and every picture has a text that stands for it.
"""

import base64
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import attrs
import jinja2

_SPACES = re.compile(r"[^a-z0-9]+")


@attrs.frozen(kw_only=True)
class Picture:
    """One picture.

    Attributes
    ----------
    image : bytes
        PNG or SVG.
    alt : str
        What is to be seen, for those who do not see it.
    caption : str
        Below the picture; none if empty.
    wide : bool
        Whether it needs the page's width: on a phone it is then moved sideways instead of made small.
    """

    image: bytes = attrs.field(repr=False)
    alt: str
    caption: str = ""
    wide: bool = False
    kind: str = attrs.field(default="picture", init=False)

    @property
    def address(self) -> str:
        """The picture as a data address."""
        media = "png" if self.image.startswith(b"\x89PNG") else "svg+xml"
        return f"data:image/{media};base64,{base64.b64encode(self.image).decode()}"


@attrs.frozen(kw_only=True)
class Gallery:
    """Pictures of one kind side by side, as many in a row as there is room for; one caption for all."""

    pictures: Sequence[Picture]
    caption: str = ""
    kind: str = attrs.field(default="gallery", init=False)


@attrs.frozen(kw_only=True)
class Table:
    """A table: the first column names its rows.

    Attributes
    ----------
    caption : str
    head : sequence of str
        One text a column, with the unit.
    rows : sequence of sequences of str
    note : str
        Below it; none if empty.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    kind: str = attrs.field(default="table", init=False)

    def __attrs_post_init__(self) -> None:
        if any(len(row) != len(self.head) for row in self.rows):
            raise ValueError(f"a row of the table {self.caption!r} has not {len(self.head)} cells")


@attrs.frozen
class Text:
    """A paragraph."""

    text: str
    kind: str = attrs.field(default="text", init=False)


@attrs.frozen
class Sentences:
    """What to conclude, or another list of sentences."""

    sentences: Sequence[str]
    kind: str = attrs.field(default="sentences", init=False)


@attrs.frozen(kw_only=True)
class Listing:
    """Text as it stands in a file."""

    text: str
    kind: str = attrs.field(default="listing", init=False)


@attrs.frozen(kw_only=True)
class Live:
    """Something that moves: markup of our own making, its data, and the script that brings it to life.

    Attributes
    ----------
    markup : str
        HTML, put in as it is; its script finds it by an id of its own.
    script : str
        JavaScript without a module or a network.
    caption : str
    """

    markup: str = attrs.field(repr=False)
    script: str = attrs.field(repr=False)
    caption: str = ""
    kind: str = attrs.field(default="live", init=False)


Part = Text | Sentences | Picture | Gallery | Table | Listing | Live


@attrs.frozen
class Section:
    """A part of a page under a title of its own."""

    title: str
    parts: Sequence[Part]

    @property
    def anchor(self) -> str:
        """Where the table of contents leads."""
        return _SPACES.sub("-", self.title.lower()).strip("-")


@attrs.frozen(kw_only=True)
class Page:
    """A whole page.

    Attributes
    ----------
    title, summary : str
        What it is, and what was asked, in a sentence or two.
    sections : sequence of Section
    configuration : str
        The settings that it was made with, as text; none if empty.
    versions : mapping of str to str
        Names and versions of what it was made with, seeds, and where its data came from.
    """

    title: str
    summary: str
    sections: Sequence[Section]
    configuration: str = ""
    versions: Mapping[str, str] = attrs.field(factory=dict)

    @property
    def scripts(self) -> Iterator[str]:
        """Each script once, in the order of the parts that need it."""
        parts = (part for section in self.sections for part in section.parts)
        return iter(dict.fromkeys(part.script for part in parts if isinstance(part, Live)))


def render(name: str, **values: Any) -> str:
    """Fill a template of this package; whatever is not declared safe there is escaped.

    Parameters
    ----------
    name : str
        File in ``report/templates``.
    **values
        What the template asks for; asking for anything else is an error.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("leg_wear_monitor.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text: str = environment.get_template(name).render(**values)
    return text


def page_html(page: Page) -> str:
    """The page as one HTML text; the same page gives the same text."""
    return render("page.html", page=page)


def template_text(name: str) -> str:
    """A file of ``report/templates`` as it is: a script."""
    loader = jinja2.PackageLoader("leg_wear_monitor.report")
    text: str = loader.get_source(jinja2.Environment(autoescape=True), name)[0]
    return text
