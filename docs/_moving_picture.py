"""The moving picture on top of README and site, and its still one: the knee breaks, and the dashboard tells.

    PYTHONPATH=test python docs/_moving_picture.py

The frames are the tool's own pages in headless Chromium, of ``bags/knocking.mcap``: the dashboard's, which is
told what a monitor says of the recording, and the page of its replay. Pages are slower than the recording on
a busy machine, so the recording waits for them. Of the dashboard, what stands between the verdict and the leg
is left out. Run by hand, some minutes; the pictures are committed.
"""

import asyncio
import base64
import io
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from live_browser import LivePage
from PIL import Image

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.dashboard.hub import Hub
from leg_wear_monitor.dashboard.live_leg import LiveLeg, received_status
from leg_wear_monitor.dashboard.server import listen, serve
from leg_wear_monitor.dashboard.source import leg_setup
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.messages.leg_motion import LegMotion
from leg_wear_monitor.messages.outputs import plain
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.wear_monitor import open_monitor
from leg_wear_monitor.playback.result import ReplayStatus

ROOT = Path(__file__).parents[1]
NAME = "knocking"
NODE = "/leg_wear_monitor"
SIZE = (720, 616)
BEGIN_S, END_S, FRAME_S = 4.7, 9.1, 0.125  # of the recording; the knee breaks after 5 s
SETTLED_S = 1.2  # the hub looks for news twice a second
STOP_S, PAGE_S, ROLL_S, LEG_S = 2.0, 3.0, 0.12, 2.4
LEFT_OUT = """
main > :not(#motion), #motion > h2, .note, .no-print { display: none !important; }
footer, figcaption, .banner dl { display: none !important; }
header .banner { min-height: 11.6rem; box-sizing: border-box; }
#leg-slider .stage { grid-template-columns: 2fr 3fr !important; }
#leg-slider .pins { grid-template-columns: repeat(3, 1fr) !important; }
"""

LEAVE_OUT = f"""
if (location.protocol !== "file:") {{
  const sheet = new CSSStyleSheet();
  sheet.replaceSync({LEFT_OUT!r});
  document.adoptedStyleSheets = [sheet];
}}
"""

Moments = Iterator[tuple[float, bool]]


class Recorded:
    """A dashboard's leg, which hears what a monitor says of a recording up to a time."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.leg = LiveLeg(NODE, [f"{NODE}/state"], lambda: self.now_s)

    def moments(self) -> Moments:
        """Time of each frame of the moving leg [s], and whether the page has more news than that."""
        config = load_config(ROOT / "bags" / f"{NAME}.yaml")
        mechanism = load_mechanism(config.mechanism)
        self.leg.take_setup(leg_setup(config, mechanism))
        with Recording([ROOT / "bags" / f"{NAME}.mcap"], config) as recording:
            monitor = open_monitor(mechanism, config)
            monitor.reports_states = True
            motion, begin_ns = LegMotion(monitor.clearance_joints), 0
            for block in recording.blocks():
                parts = np.flatnonzero(np.diff(block.log_time_ns // 50_000_000)) + 1
                for samples in np.split(block.samples, parts):
                    stamp_ns = int(samples["stamp_ns"][-1])
                    begin_ns = begin_ns or stamp_ns
                    self.now_s = (stamp_ns - begin_ns) / 1e9
                    reports = monitor.update(samples)
                    for state in reports.states:
                        self.leg.take_state(state.state.to_json())
                    for cycle in reports.cycles:
                        self.leg.take_peaks({each.joint: each.peak_force_n for each in cycle.joints})
                        self.leg.take_diagnostics(stamp_ns, [heard(each) for each in monitor.status()])
                    for frame in motion.of(reports.samples):
                        self.leg.take_motion(frame.to_json())
                    yield self.now_s, bool(reports.states or reports.cycles)
            monitor.abandon()


def heard(status: Status) -> ReplayStatus:
    """A line of the diagnostics as it arrives."""
    values = {key: plain(value) for key, value in status.values.items()}
    return received_status(f"{NODE[1:]}: {status.name}", status.level, status.message, values)


def served(leg: LiveLeg) -> str:
    """Address of a leg's dashboard, which ends with this process."""
    place, ready = listen("127.0.0.1", 0), threading.Event()
    threading.Thread(
        target=lambda: asyncio.run(serve(Hub(leg), place, lambda _: ready.set())), daemon=True
    ).start()
    ready.wait(30.0)
    return place.address


class Film:
    """Frames with how long each is shown."""

    def __init__(self, page: LivePage) -> None:
        self._page = page
        self.frames: list[Image.Image] = []
        self.times_ms: list[int] = []

    def take(self, shown_s: float) -> None:
        """A frame of what the page shows now; an equal one prolongs the last."""
        shot = base64.b64decode(self._page.command("Page.captureScreenshot", format="png")["data"])
        frame = Image.open(io.BytesIO(shot)).convert("RGB")
        shown_ms = round(1e3 * shown_s)
        if self.frames and self.frames[-1].tobytes() == frame.tobytes():
            self.times_ms[-1] += shown_ms
            return
        self.frames.append(frame)
        self.times_ms.append(shown_ms)


def dashboard_frames(
    film: Film, page: LivePage, recorded: Recorded, moments: Iterator[tuple[float, bool]]
) -> None:
    """The leg as it walks into the verdict, then the last moment of the recording."""
    due_s, angle = BEGIN_S, "document.querySelector('#leg-slider .angle')?.textContent"
    for now_s, has_news in moments:
        if has_news:
            time.sleep(SETTLED_S)
        if now_s >= due_s and now_s < END_S:
            due_s += FRAME_S
            time.sleep(0.15)
            film.take(FRAME_S)
            if not recorded.leg.motion.viewers:
                raise RuntimeError("the page does not move; start again")
            print(f"{now_s:5.2f} s  {page.value(angle)}  {page.value('document.title')}", flush=True)
    film.take(STOP_S)


def page_frames(film: Film, page: LivePage, directory: Path) -> None:
    """The page of the replay, from its verdict to its leg."""
    bag = ROOT / "bags" / NAME
    done = CliRunner().invoke(
        cli, ["replay", f"{bag}.mcap", "--config", f"{bag}.yaml", "--out", str(directory)]
    )
    print(done.output)
    page.command("Page.navigate", url=(directory / "report.html").as_uri())
    page.wait("document.readyState === 'complete' && document.getElementById('joints')", "the page")
    film.take(PAGE_S)
    end = page.value("document.getElementById('joints').getBoundingClientRect().top - 8")
    for part in np.linspace(0.0, 1.0, 4)[1:]:
        page.value(f"window.scrollTo(0, {end * part * part * (3.0 - 2.0 * part)})")
        film.take(ROLL_S)
    film.take(LEG_S)


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        directory = Path(temporary)
        recorded = Recorded()
        moments = recorded.moments()
        next(moments)
        page = LivePage("about:blank", directory, *SIZE)
        page.command("Page.addScriptToEvaluateOnNewDocument", source=LEAVE_OUT)
        address = served(recorded.leg)
        while not recorded.leg.motion.viewers:
            page.command("Page.navigate", url=address)
            time.sleep(5.0)  # the page asks for the moving leg once it is laid out
        film = Film(page)
        try:
            dashboard_frames(film, page, recorded, moments)
            stop = film.frames[-1]
            page_frames(film, page, directory)
        finally:
            page.close()
    first, *others = film.frames
    settings = {"duration": film.times_ms, "loop": 0, "quality": 18, "method": 6}
    moving, still = ROOT / "docs" / "knee_breaks.webp", ROOT / "docs" / "knee_breaks.png"
    first.save(moving, save_all=True, append_images=others, **settings)
    stop.quantize(64, dither=Image.Dither.NONE).save(still, optimize=True)
    for path in (moving, still):
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
    print(f"{len(film.frames)} frames, {sum(film.times_ms) / 1e3:.1f} s")


if __name__ == "__main__":
    main()
