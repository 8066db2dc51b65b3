"""A fleet as its last update left it: the page of the fleet, and those of its legs."""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path

import attrs

from leg_wear_monitor.dashboard.source import (
    SCRIPT,
    Content,
    Freshness,
    Words,
    live_settings,
    unreadable,
)
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.files import Stamp, stamp_of
from leg_wear_monitor.fleet.description import fleet_directory, load_fleet
from leg_wear_monitor.fleet.overview import FILE, FleetOverview, described, load_overview
from leg_wear_monitor.playback.result import summary_of
from leg_wear_monitor.report.fleet_page import fleet_page
from leg_wear_monitor.report.fleet_standing import Day
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.report.replay.page import replay_page

FRESH_DAYS = 7.0
OLD_AFTER_S = FRESH_DAYS * 86_400.0

_SUMMARY = "summary.json"
_AGAIN_S = 3600.0  # the page says which legs are outdated, and that changes by itself


class FleetSource:
    """A source that reads the overview of a fleet again when it has changed.

    Parameters
    ----------
    description : pathlib.Path
    clock : callable
        Seconds since 1970.
    versions : mapping of str to str
        Versions of the software, by name.

    Raises
    ------
    ConfigError
        If the description or the overview is unusable.
    """

    motion = None

    def __init__(self, description: Path, clock: Callable[[], float], versions: Mapping[str, str]) -> None:
        self._description, self._clock, self._versions = description, clock, versions
        self._home = fleet_directory(description)
        self._fault = ""
        self._overview = self._read()
        self._stamps, self._made_s = self._stamps_now(), -_AGAIN_S

    def _read(self) -> FleetOverview:
        return described(load_overview(self._home), load_fleet(self._description))

    def _stamps_now(self) -> tuple[Stamp, Stamp]:
        return stamp_of(self._description), stamp_of(self._home / FILE)

    def renew(self) -> bool:
        """Read description and overview again if one of them has changed."""
        stamps = self._stamps_now()
        if stamps != self._stamps:
            self._stamps = stamps
            try:
                self._overview, self._fault = self._read(), ""
            except LegWearError as error:  # the page of before stays, and says so
                self._fault = str(error)
                return False
            return True
        return self._clock() - self._made_s >= _AGAIN_S

    def content(self) -> Content:
        """The page of the fleet."""
        self._made_s = self._clock()
        day = Day(now_ns=round(1.0e9 * self._made_s), fresh_days=FRESH_DAYS)
        pages = {leg.id for leg in self._overview.legs if self._summary_of(leg.id).is_file()}
        page = fleet_page(self._overview, day, pages, self._versions)
        page = attrs.evolve(
            page,
            libraries=(*page.libraries, SCRIPT),
            styles=(*page.styles, "dashboard/dashboard.css"),
        )
        state = page.banner.word.lower() if page.banner else ""
        words = Words(title=f"{state} – fleet", state=state, heading=page.title, summary=page.summary)
        identity = hashlib.sha256(page_html(page).encode()).hexdigest()[:16]
        live = live_settings(identity, words, self.freshness(), "Updated ")
        page = attrs.evolve(page, live=live)
        return Content(page=identity, html=page_html(page), regions={}, words=words, policy=page.policy)

    def freshness(self) -> Freshness:
        """Since when the fleet was not updated."""
        if self._fault:
            return unreadable(self._fault, OLD_AFTER_S)
        _, (written_ns, *_) = self._stamps
        age_s = max(0.0, self._clock() - 1.0e-9 * written_ns)
        return Freshness(age_s, "the fleet was not updated; run leg-wear-monitor fleet update", OLD_AFTER_S)

    def leg_page(self, name: str) -> str | None:
        """The page of a leg of the description, by its exact id; no other name leads to a file."""
        if name not in {leg.id for leg in self._overview.legs}:
            return None
        source = self._summary_of(name)
        try:
            record = json.loads(source.read_bytes())
            return page_html(replay_page(summary_of(record, str(source))))
        except (OSError, ValueError, ConfigError):  # of an earlier version, or damaged: as if there was none
            return None

    def _summary_of(self, leg: str) -> Path:
        return self._home / "legs" / leg / _SUMMARY
