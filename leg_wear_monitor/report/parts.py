"""Parts of a page: text, pictures, tables, listings, and markup that a template has made."""

import base64
from collections.abc import Sequence

import attrs

from leg_wear_monitor.report.chart import Chart


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
    is_text : bool
        Whether its cells are texts, which wrap, and not numbers.

    Raises
    ------
    ValueError
        If a row has another number of cells than `head`.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    is_text: bool = False
    kind: str = attrs.field(default="table", init=False)

    def __attrs_post_init__(self) -> None:
        if any(len(row) != len(self.head) for row in self.rows):
            raise ValueError(f"a row of the table {self.caption!r} has not {len(self.head)} cells")


@attrs.frozen
class Text:
    """A paragraph; greyed if it says that something is not valid."""

    text: str
    is_not_valid: bool = False
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


@attrs.frozen
class Fragment:
    """Markup of a template of this package: trusted HTML, inserted without escaping."""

    markup: str = attrs.field(repr=False)
    kind: str = attrs.field(default="fragment", init=False)


Part = Text | Sentences | Picture | Gallery | Table | Listing | Live | Fragment | Chart
