"""What a dashboard shows: where its content comes from, and how old it is."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import attrs

from leg_wear_monitor.dashboard.regions import TITLES
from leg_wear_monitor.errors import printable
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Page, render, template_text
from leg_wear_monitor.report.replay.banner import LOOKS

SCRIPT = "dashboard/dashboard.js"


@attrs.frozen
class Words:
    """The page in a few words.

    Attributes
    ----------
    title : str
        Of the browser's tab.
    state : str
        Spoken when it changes.
    heading, summary : str
        At the head of the page.
    """

    title: str
    state: str
    heading: str
    summary: str


@attrs.frozen
class Freshness:
    """How old the data are.

    Attributes
    ----------
    age_s : float or None
        None before there are any.
    silence : str
        What it means that nothing new comes, and what to look at.
    old_after_s : float
        Age from which on the page says loudly that its data are old.
    """

    age_s: float | None
    silence: str
    old_after_s: float


def unreadable(fault: str, old_after_s: float) -> Freshness:
    """Freshness of what cannot be read any more, for a reason in words."""
    return Freshness(None, f"NOT READABLE: {printable(fault)}; what is shown is old", old_after_s)


Stamps = tuple[tuple[int, int], ...]
"""Time [ns] and size of files."""


def stamps_of(*paths: Path) -> Stamps:
    """What changes when one of the files is written; zeros for a file that is not there."""
    return tuple(map(_stamp, paths))


def _stamp(path: Path) -> tuple[int, int]:
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_mtime_ns, stat.st_size


@attrs.frozen(kw_only=True)
class Content:
    """What a page shows at one instant.

    Attributes
    ----------
    page : str
        Identity of the page around the regions: viewers load another one again.
    html : str
        The whole page.
    regions : mapping of str to str
        Markup by the name of its region.
    words : Words
    policy : str
        Content security policy of the page.
    """

    page: str
    html: str
    regions: Mapping[str, str]
    words: Words
    policy: str


class Source(Protocol):
    """Where the content comes from; its methods are called from one thread at a time."""

    def renew(self) -> bool:
        """Take in what is new, and return whether there is another content."""

    def content(self) -> Content:
        """The content as it was taken in last; LegWearError for one that cannot be shown."""

    def freshness(self) -> Freshness:
        """How old the data are now."""

    def leg_page(self, name: str) -> str | None:
        """The page of a leg of a fleet; None if there is none."""


@attrs.frozen(kw_only=True)
class LegPage:
    """The page of one leg, around its regions.

    Attributes
    ----------
    fresh : str
        Begin of the line that says how old the data are, such as ``Data ``.
    """

    fresh: str

    def content(self, regions: Mapping[str, str], words: Words, freshness: Freshness) -> Content:
        """The page with its regions."""
        page, identity = self._page(words, freshness)
        html = render("dashboard/page.html", page=page, regions=regions, titles=TITLES)
        return Content(page=identity, html=html, regions=regions, words=words, policy=page.policy)

    def _page(self, words: Words, freshness: Freshness) -> tuple[Page, str]:
        """The page without its regions, and its identity."""
        page = Page(
            title=words.heading,
            summary=words.summary,
            sections=(),
            styles=[
                template_text("uplot/uPlot.min.css"),
                template_text("replay/replay.css"),
                template_text("dashboard/dashboard.css"),
            ],
            libraries=[
                template_text("uplot/uPlot.iife.min.js"),
                template_text("replay/charts.js"),
                template_text(SCRIPT),
            ],
            has_dark=True,
        )
        identity = _identity(page)
        live = live_settings(identity, words, freshness, self.fresh)
        return attrs.evolve(page, live=live), identity


def live_settings(page: str, words: Words, freshness: Freshness, fresh: str) -> str:
    """Settings of the page's script, as JSON."""
    settings = {
        "page": page,
        "fresh": fresh,
        **attrs.asdict(freshness),
        "words": attrs.asdict(words),
    }
    return json.dumps(settings, allow_nan=False)


def words_of(view: ReplaySummary, name: str, heading: str, summary: str) -> Words:
    """The verdict in a few words, and what stands at the head of its page."""
    verdict = view.verdict
    joints = ", ".join(map(view.leg.joint_words, verdict.joints))
    state = f"{verdict.state.words} joint {joints}" if joints else verdict.state.words
    title = f"{LOOKS[verdict.state][0]} {state} – {name}"
    return Words(title=title, state=f"{name}: {state}", heading=heading, summary=summary)


def _identity(page: Page) -> str:
    """The same for pages with the same scripts and styles."""
    parts = (page.style, *page.scripts)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]
