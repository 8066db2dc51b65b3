"""A self-contained HTML page: sections of parts, with the configuration and versions.

A page needs no network and no other file: it embeds pictures, scripts and style, and its content security
policy forbids everything else. It prints, fits a phone screen, and has an alternative text for every picture.
"""

import base64
import hashlib
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import attrs
import jinja2

from leg_wear_monitor.report.parts import Live, Part

_SPACES = re.compile(r"[^a-z0-9]+")


@attrs.frozen
class Section:
    """A titled section of a page; a folded one shows its title alone until it is opened, or printed."""

    title: str
    parts: Sequence[Part]
    is_folded: bool = False

    @property
    def anchor(self) -> str:
        """The HTML id, to which the table of contents links."""
        return _SPACES.sub("-", self.title.lower()).strip("-")


@attrs.frozen(kw_only=True)
class Banner:
    """The head of a page; symbol and word say what its colour says.

    Attributes
    ----------
    symbol, word : str
    subject : str
        What the word concerns; may be empty.
    text : str
    notes : sequence of pairs of str
        Lines below the text, each with its title.
    severity : str
        Class of its colour: ``fine``, ``careful`` or ``bad``.
    guide : str
        Address of the page that says what to do; empty without one.
    """

    symbol: str
    word: str
    subject: str = ""
    text: str
    notes: Sequence[tuple[str, str]] = ()
    severity: str
    guide: str = ""


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
        Further style sheets, and scripts that come before those of the interactive parts.
    has_dark : bool
        Whether it follows a reader who prefers dark colours; its pictures must follow as well.
    live : str
        Settings, as JSON, of the script that renews a page from its server; empty for a page that is a file.
    generator : str
        What made it, in its head; nothing if empty.
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
        """The scripts, each once: the libraries, then those of the interactive parts."""
        parts = (part for section in self.sections for part in section.parts)
        live = (part.script for part in parts if isinstance(part, Live))
        return tuple(dict.fromkeys((*self.libraries, *live)))

    @property
    def style(self) -> str:
        """Its style sheets as one."""
        return "\n".join([template_text("page.css"), *self.styles])

    @property
    def policy(self) -> str:
        """Content security policy: these scripts run, no others, and nothing is fetched.

        A live page hears from its own server only, and has no other style than its own.
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
    return jinja2.Environment(
        loader=jinja2.PackageLoader("leg_wear_monitor.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def page_html(page: Page) -> str:
    """The page as HTML text; equal pages give equal text."""
    return render("page.html", page=page)


def template_text(name: str) -> str:
    """The text of a file in ``report/templates``, not rendered: a script."""
    loader = jinja2.PackageLoader("leg_wear_monitor.report")
    text: str = loader.get_source(jinja2.Environment(autoescape=True), name)[0]
    return text
