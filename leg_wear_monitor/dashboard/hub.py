"""Keeps the page of a leg, renews it while a viewer is connected, and sends each viewer the changes."""

import asyncio
import json
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import attrs

from leg_wear_monitor.dashboard.leg_page import Content
from leg_wear_monitor.dashboard.live_leg import LiveLeg

MOST_VIEWERS = 100

_TICK_S = 0.5  # no viewer sees more; each tick is one rendering for all viewers
_TICKS_A_WORD = 2  # a word every second, even without a change, so that a viewer knows that it is connected


@attrs.define(eq=False)
class Viewer:
    """A connected viewer: the version last sent of each region, and the event that wakes the viewer."""

    given: dict[str, int] = attrs.Factory(dict)
    bell: asyncio.Event = attrs.Factory(asyncio.Event)


class Hub:
    """One content for all viewers.

    Parameters
    ----------
    leg : LiveLeg
    """

    def __init__(self, leg: LiveLeg) -> None:
        self._leg = leg
        self._content: Content | None = None
        self._numbers: dict[str, int] = {}  # counter per region, increased when the region changes
        self._lock = asyncio.Lock()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="dashboard")
        self._viewers: set[Viewer] = set()
        self._sent: dict[tuple[tuple[str, int], ...], str] = {}  # messages of this tick, by sent versions
        self.is_closing = False

    def join(self) -> Viewer | None:
        """Add a viewer; None if there are too many."""
        if len(self._viewers) >= MOST_VIEWERS or self.is_closing:
            return None
        viewer = Viewer()
        viewer.bell.set()
        self._viewers.add(viewer)
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """A viewer less."""
        self._viewers.discard(viewer)

    async def run(self) -> None:
        """Renew the content while a viewer is connected, until `close`."""
        ticks = 0
        while not self.is_closing:
            await asyncio.sleep(_TICK_S)
            ticks += 1
            if not self._viewers:
                continue
            has_changed = await self._renew()
            if has_changed or ticks % _TICKS_A_WORD == 0:
                self._sent.clear()
                self._ring()

    def close(self) -> None:
        """Send the viewers away; `run` ends after its tick."""
        self.is_closing = True
        self._ring()

    def finish(self) -> None:
        """End the worker when no viewer is left."""
        self._worker.shutdown(wait=False)

    def _ring(self) -> None:
        for viewer in self._viewers:
            viewer.bell.set()

    async def content(self) -> Content:
        """The present content.

        Raises
        ------
        LegWearError
            If it cannot be shown.
        """
        await self._renew()
        if self._content is None:
            raise RuntimeError("a leg without content")
        return self._content

    async def message(self, viewer: Viewer) -> str:
        """Content that a viewer does not have yet, as one server-sent event."""
        if self._content is None:
            await self._renew()
        key = tuple(sorted(viewer.given.items()))
        if key not in self._sent:
            self._sent[key] = self._event(viewer.given)
        viewer.given = dict(self._numbers)
        return self._sent[key]

    def _event(self, given: Mapping[str, int]) -> str:
        content, freshness = self._content, self._leg.freshness()
        regions = content.regions if content else {}
        changed = {name: text for name, text in regions.items() if given.get(name) != self._numbers[name]}
        state = {
            **attrs.asdict(freshness),
            "words": attrs.asdict(content.words) if content else {},
            "regions": changed,
        }
        return f"event: state\ndata: {json.dumps(state, allow_nan=False)}\n\n"

    async def _renew(self) -> bool:
        """True if the content has changed."""
        async with self._lock:
            if not self._leg.has_news() and self._content is not None:
                return False
            before, self._content = self._content, await self._work(self._leg.content)
        regions = before.regions if before else {}
        for name, markup in self._content.regions.items():
            if regions.get(name) != markup:
                self._numbers[name] = self._numbers.get(name, 0) + 1
        self._sent.clear()
        return True

    async def _work(self, work: Any) -> Any:
        return await asyncio.get_running_loop().run_in_executor(self._worker, work)
