"""A self-contained HTML page: sections of text, pictures and tables, with the configuration and versions.

A page needs no network and no other file: it embeds pictures, scripts and style, and its content security
policy forbids everything else. It prints, fits a phone screen, and has an alternative text for every picture.
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
        Alternative text: describes the picture to readers who cannot see it.
    caption : str
        Caption below the picture; no caption if empty.
    wide : bool
        Whether it needs the width of the page: on a phone it then scrolls sideways instead of being shrunk.
    """

    image: bytes = attrs.field(repr=False)
    alt: str
    caption: str = ""
    wide: bool = False
    kind: str = attrs.field(default="picture", init=False)

    @property
    def address(self) -> str:
        """The picture as a ``data:`` URL."""
        media = "png" if self.image.startswith(b"\x89PNG") else "svg+xml"
        return f"data:image/{media};base64,{base64.b64encode(self.image).decode()}"


@attrs.frozen(kw_only=True)
class Gallery:
    """Pictures of one kind side by side, as many in a row as fit, with a common caption."""

    pictures: Sequence[Picture]
    caption: str = ""
    kind: str = attrs.field(default="gallery", init=False)


@attrs.frozen(kw_only=True)
class Table:
    """A table; the first column contains the row names.

    Attributes
    ----------
    caption : str
    head : sequence of str
        Column titles with units.
    rows : sequence of sequences of str
        Cells, as many per row as `head` has.
    note : str
        Note below the table; no note if empty.

    Raises
    ------
    ValueError
        If a row has another number of cells than `head`.
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
    """A list of sentences, for instance conclusions."""

    sentences: Sequence[str]
    kind: str = attrs.field(default="sentences", init=False)


@attrs.frozen(kw_only=True)
class Listing:
    """Preformatted text, for instance the contents of a file."""

    text: str
    kind: str = attrs.field(default="listing", init=False)


@attrs.frozen(kw_only=True)
class Live:
    """An interactive element: markup with its data, and a script.

    Attributes
    ----------
    markup : str
        Trusted HTML, inserted without escaping; the script finds it by its id.
    script : str
        JavaScript that uses neither modules nor the network.
    caption : str
        Caption below the element; no caption if empty.
    """

    markup: str = attrs.field(repr=False)
    script: str = attrs.field(repr=False)
    caption: str = ""
    kind: str = attrs.field(default="live", init=False)


Part = Text | Sentences | Picture | Gallery | Table | Listing | Live


@attrs.frozen
class Section:
    """A titled section of a page."""

    title: str
    parts: Sequence[Part]

    @property
    def anchor(self) -> str:
        """The HTML id, to which the table of contents links."""
        return _SPACES.sub("-", self.title.lower()).strip("-")


@attrs.frozen(kw_only=True)
class Banner:
    """One line at the head of a page; symbol and word say what its colour says.

    Attributes
    ----------
    symbol, word : str
    text : str
    severity : str
        Class of its colour: ``fine``, ``careful`` or ``bad``.
    """

    symbol: str
    word: str
    text: str
    severity: str


@attrs.frozen(kw_only=True)
class Page:
    """A complete page.

    Attributes
    ----------
    title, summary : str
        Title, and a summary of one or two sentences.
    sections : sequence of Section
    configuration : str
        The settings of the run as text; no section for them if empty.
    versions : mapping of str to str
        Versions of the software, seeds and the origin of the data, by name.
    banner : Banner or None
    """

    title: str
    summary: str
    sections: Sequence[Section]
    configuration: str = ""
    versions: Mapping[str, str] = attrs.field(factory=dict)
    banner: Banner | None = None

    @property
    def scripts(self) -> Iterator[str]:
        """The scripts of the interactive parts, each once, in the order of the parts."""
        parts = (part for section in self.sections for part in section.parts)
        return iter(dict.fromkeys(part.script for part in parts if isinstance(part, Live)))


def render(name: str, **values: Any) -> str:
    """Render a template of this package; values are escaped unless the template marks them as safe.

    Parameters
    ----------
    name : str
        File in ``report/templates``.
    **values
        Variables of the template.

    Returns
    -------
    str

    Raises
    ------
    jinja2.UndefinedError
        If the template uses a variable that is not given.
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
    """The page as HTML text; equal pages give equal text."""
    return render("page.html", page=page)


def template_text(name: str) -> str:
    """The text of a file in ``report/templates``, not rendered: a script."""
    loader = jinja2.PackageLoader("leg_wear_monitor.report")
    text: str = loader.get_source(jinja2.Environment(autoescape=True), name)[0]
    return text
