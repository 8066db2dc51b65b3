"""Pages: one file each, with their parts, charts, words and banners."""

import base64
import csv
import hashlib
import io
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any
from urllib.parse import quote

import attrs
import jinja2
import numpy as np
from markupsafe import Markup, escape

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms import duration, time_words
from leg_wear_monitor.monitor.verdict.verdict import HOW_SURE, decision_of, figures_of
from leg_wear_monitor.recordings.result import ReplaySummary
from leg_wear_monitor.state import Figure, Level, State, Verdict

# A chart as data: its series are a CSV file inside the page, which the page's script draws with uPlot.


@attrs.frozen(eq=False)
class Series:
    """A column of values.

    Attributes
    ----------
    name, unit : str
        Title of its column; no unit if empty.
    values : (n,) array
        NaN where it is not known.
    colour : str
        CSS variable of the page.
    style : str
        ``line``, ``dashed``, ``points``, or ``edge`` of a band, which has no line.
    width : float
        Width of a line [CSS pixels].
    """

    name: str
    unit: str
    values: Floats
    colour: str = "--series-0"
    style: str = "line"
    width: float = 1.5

    @property
    def head(self) -> str:
        """Title of the column with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@attrs.frozen(eq=False)
class Panel:
    """Axes with series over the chart's x axis.

    Attributes
    ----------
    title : str
    series : sequence of Series
    low, high : float or None
        Ends of the y axis; if None, the smallest and largest value.
    height : int
        [CSS pixels].
    bands : sequence of pair of int
        Pairs of series; the area between both has the colour of the first series.
    """

    title: str
    series: Sequence[Series]
    low: float | None = None
    high: float | None = None
    height: int = 170
    bands: Sequence[tuple[int, int]] = ()


@attrs.frozen(kw_only=True, eq=False)
class Chart:
    """Panels above each other, over one x axis.

    Attributes
    ----------
    name : str
        Stem of the name of its CSV file.
    alt, caption : str
    x : Series
    panels : sequence of Panel
    group : str
        Charts of one group share cursor and zoom.
    ends : tuple of float or None
        Ends of the x axis; the first and the last value if None.
    """

    name: str
    alt: str
    caption: str
    x: Series
    ends: tuple[float, float] | None = None
    panels: Sequence[Panel]
    group: str

    @property
    def columns(self) -> tuple[Series, ...]:
        """The x axis, and the series of all panels."""
        return (self.x, *(series for panel in self.panels for series in panel.series))

    @property
    def csv(self) -> str:
        """All columns as CSV, with units in the titles; unknown values are empty cells."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(series.head for series in self.columns)
        for row in zip(*(series.values.tolist() for series in self.columns), strict=True):
            writer.writerow("" if np.isnan(value) else f"{value:.9g}" for value in row)
        return text.getvalue()

    @property
    def address(self) -> str:
        """The CSV file as a ``data:`` URL."""
        return "data:text/csv;charset=utf-8," + quote(self.csv, safe=",.-+()/: ")

    @property
    def settings(self) -> dict[str, Any]:
        """Data that the script needs in addition to the values, as plain data."""
        panels = [attrs.asdict(panel, filter=_is_setting) for panel in self.panels]
        return {"group": self.group, "x": self.x.head, "ends": self.ends, "panels": panels}


def _is_setting(attribute: "attrs.Attribute[Any]", _value: Any) -> bool:
    return attribute.name != "values"


# Parts of a page: text, pictures, tables, listings, and markup that a template has made.


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
        True if it needs the width of the page: on a phone it then scrolls sideways instead of being shrunk.
    """

    image: bytes = attrs.field(repr=False)
    alt: str
    caption: str = ""
    wide: bool = False

    @property
    def address(self) -> str:
        """The picture as a ``data:`` URL."""
        media = "png" if self.image.startswith(b"\x89PNG") else "svg+xml"
        return f"data:image/{media};base64,{base64.b64encode(self.image).decode()}"


@attrs.frozen(kw_only=True)
class Gallery:
    """Pictures of one kind with a common caption, in rows as wide as the page."""

    pictures: Sequence[Picture]
    caption: str = ""


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
        True if its cells are texts, which wrap, and not numbers.

    Raises
    ------
    ValueError
        If a row and `head` have different numbers of cells.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    is_text: bool = False

    def __attrs_post_init__(self) -> None:
        if any(len(row) != len(self.head) for row in self.rows):
            raise ValueError(f"a row of the table {self.caption!r} has not {len(self.head)} cells")


@attrs.frozen
class Text:
    """A paragraph; greyed if it says that something is not valid."""

    text: str
    is_not_valid: bool = False


@attrs.frozen
class Sentences:
    """A list of sentences, for instance conclusions."""

    sentences: Sequence[str]


@attrs.frozen
class Fragment:
    """Markup of a template of this package, and the script that makes it interactive.

    Attributes
    ----------
    markup : str
        Trusted HTML, inserted without escaping; the script finds it by its id.
    script : str
        JavaScript that uses neither modules nor the network; nothing if empty.
    caption : str
        Caption below an interactive element; no caption if empty.
    """

    markup: str = attrs.field(repr=False)
    script: str = attrs.field(default="", repr=False)
    caption: str = ""


Part = Text | Sentences | Picture | Gallery | Table | Fragment | Chart


# A self-contained HTML page: sections of parts, with the configuration and versions.
#
# A page needs no network and no other file: it embeds pictures, scripts and style, and its content security
# policy forbids everything else. It prints, fits a phone screen, and has an alternative text for every
# picture.


_SPACES, _CODE = re.compile(r"[^a-z0-9]+"), re.compile(r"`([^`]+)`")


@attrs.frozen
class Section:
    """A titled section of a page; a folded section shows only its title until it is opened or printed."""

    title: str
    parts: Sequence[Part]
    is_folded: bool = False

    @property
    def anchor(self) -> str:
        """The HTML id that the table of contents links to."""
        return _SPACES.sub("-", self.title.lower()).strip("-")


@attrs.frozen(kw_only=True)
class Banner:
    """The head of a page; symbol and word repeat the meaning of its colour.

    Attributes
    ----------
    symbol, word : str
    subject : str
        Subject of the word; may be empty.
    text : str
    notes : sequence of pairs of str
        Lines below the text, each with its title.
    severity : str
        Class of its colour: ``fine``, ``careful`` or ``bad``.
    links : mapping of str to pair of str
        Text and address of a link after a note, by the title of the note.
    """

    symbol: str
    word: str
    subject: str = ""
    text: str
    notes: Sequence[tuple[str, str]] = ()
    severity: str
    links: Mapping[str, tuple[str, str]] = attrs.field(factory=dict)


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
    styles, libraries : sequence of str
        Further style sheets, and scripts that come before the interactive parts' scripts; by their names in
        ``report/templates``.
    has_dark : bool
        True if page and pictures have dark colours for readers who prefer them.
    live : str
        Settings, as JSON, of the script that renews a page from its server; empty for a page that is a file.
    generator : str
        Name of the program in the head of the page; no name if empty.
    """

    title: str
    summary: str
    sections: Sequence[Section]
    configuration: str = ""
    versions: Mapping[str, str] = attrs.field(factory=dict)
    banner: Banner | None = None
    styles: Sequence[str] = ()
    libraries: Sequence[str] = ()
    has_dark: bool = False
    live: str = ""
    generator: str = ""

    @property
    def scripts(self) -> tuple[str, ...]:
        """The scripts, without repetition: the libraries, then the scripts of the interactive parts."""
        parts = (part for section in self.sections for part in section.parts)
        scripts = (part.script for part in parts if isinstance(part, Fragment) and part.script)
        return tuple(dict.fromkeys((*map(template_text, self.libraries), *scripts)))

    @property
    def style(self) -> str:
        """Its style sheets as one."""
        return "\n".join(map(template_text, ("page.css", *self.styles)))

    @property
    def policy(self) -> str:
        """Content security policy: these scripts run, no others, and nothing is fetched.

        A live page reads only from its own server, and has only its own style.
        """
        scripts = f"; script-src {_allowed(self.scripts)}" if self.scripts else ""
        if not self.live:
            return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'{scripts}"
        only = "connect-src 'self'; base-uri 'none'; form-action 'none'"
        return f"default-src 'none'; img-src data:; style-src {_allowed([self.style])}{scripts}; {only}"


def _allowed(texts: Sequence[str]) -> str:
    """Scripts or styles by their checksums, as a content security policy names them."""
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


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
    text: str = _environment().get_template(name).render(**values)
    return text


@cache
def _environment() -> Any:
    """The templates of this package, each compiled once: a live page renders them again and again."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("leg_wear_monitor.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["marked"] = marked
    return environment


def marked(text: Any) -> Markup:
    """A text as markup; text between backticks becomes code."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(text))))


def page_html(page: Page) -> str:
    """The page as HTML text; equal pages give equal text."""
    return render("page.html", page=page)


def template_text(name: str) -> str:
    """The text of a file in ``report/templates``, not rendered: a script."""
    environment = _environment()
    text: str = environment.loader.get_source(environment, name)[0]
    return text


# Words that the parts of the page share: invalid values and the reason, joints, times, values.


NOT_VALID = "not valid"


def not_valid(verdict: Verdict, *figures: Figure) -> str:
    """Reason why one of some values is not valid, without a number; empty if all are valid."""
    if not set(figures) & set(verdict.not_valid):
        return ""
    return f"{NOT_VALID}: {reason(verdict)}"


def reason(verdict: Verdict) -> str:
    """Why the values of a verdict's list are not valid, in general words."""
    if Figure.CLEARANCES in verdict.not_valid:
        return "leg differs from its model"
    return "leg not monitored" if verdict.state is State.NOT_MONITORED else "see the verdict"


def since_words(summary: ReplaySummary, stamp_ns: int) -> str:
    """A stamp as a date, and as a time since the start of the recording."""
    begin, end = summary.recording.begin_ns, summary.recording.end_ns
    if not begin <= stamp_ns <= end:
        return time_words(stamp_ns)
    return f"{time_words(stamp_ns)}, {duration((stamp_ns - begin) / 1.0e9)} after the start of the recording"


def is_of_recording(summary: ReplaySummary) -> bool:
    """True if nothing was measured or entered after the end of the recording."""
    return summary.verdict.since_ns <= summary.recording.end_ns


def value(factor: float, number: float | None) -> str:
    """A number times a factor in four digits; a dash if it is not known."""
    return "-" if number is None else f"{float(f'{factor * number:.4g}'):g}"


# The verdict as the banner of a page.


STATE_LOOKS = {
    State.HEALTHY: ("✓", "fine"),
    State.WATCH: ("◆", "careful"),
    State.NOT_MONITORED: ("?", "careful"),
    State.INSPECT: ("▲", "bad"),
    State.STOP: ("■", "bad"),
}
LEVEL_LOOKS = {Level.OK: ("✓", "fine"), Level.WARN: ("▲", "careful"), Level.ERROR: ("■", "bad")}


def verdict_banner(summary: ReplaySummary, guide: str, certainty: str) -> Banner:
    """State as symbol and word, joints, reason, decision, code, start, and the values that are not valid.

    Parameters
    ----------
    summary : ReplaySummary
    guide : str
        Address of the verdict's guide.
    certainty : str
        Address of the cases on which its certainty was measured; no link if empty.
    """
    verdict = summary.verdict
    symbol, severity = STATE_LOOKS[verdict.state]
    joints = ", ".join(map(summary.leg.joint_words, verdict.joints))
    notes = [("Do", verdict.do), *decision_of(summary), ("Code", verdict.fault_code)]
    if verdict.since_ns:
        notes.append(("Since", since_words(summary, verdict.since_ns)))
    if verdict.not_valid:
        figures = ", ".join(figure.words for figure in verdict.not_valid)
        notes.append(("Not valid", f"{figures}: {reason(verdict)}"))
    links = {"Do": ("step by step", guide)}
    if certainty and figures_of(summary):
        links[HOW_SURE] = ("test cases", certainty)
    return Banner(
        symbol=symbol,
        word=verdict.state.words.upper(),
        subject=f"joint {joints}" if joints else "",
        text=verdict.why,
        notes=notes,
        severity=severity,
        links=links,
    )
