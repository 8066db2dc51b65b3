"""The page in a browser, on a desk and on a phone: it is renewed, loud when it is old, and runs no markup."""

import attrs
import pytest
from browser import NEEDS_CHROMIUM, WIDTHS
from heard_leg import raised, state_of, walk

pytest.importorskip("tornado")
from live_browser import LivePage, wait_for

from leg_wear_monitor.dashboard.live_leg import OLD_AFTER_S
from leg_wear_monitor.state import State

pytestmark = NEEDS_CHROMIUM

IS_OLD = "document.documentElement.hasAttribute('data-old')"
IS_FRESH = f"document.querySelector('.freshness') && !{IS_OLD}"
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
FOREIGN = "document.querySelectorAll('[data-region] img, [data-region] script:not([type])').length"
NASTY = "<img src=x onerror=\"document.title='run'\"><script>document.title='run'</script>"


@pytest.fixture
def dashboard(served, leg):
    return served(leg)


@pytest.fixture
def page(request, dashboard, tmp_path):
    page = LivePage(f"http://127.0.0.1:{dashboard.port}/", tmp_path, request.param)
    page.wait(IS_FRESH, "data")
    yield page
    page.close()


@pytest.mark.parametrize("page", WIDTHS, indirect=True)
def test_it_is_renewed_says_when_it_is_old_or_alone_and_runs_no_markup(page, dashboard, leg, clock):
    assert page.text("[data-region=verdict] .verdict").split() == ["✓", "HEALTHY"]
    assert page.value("document.title").startswith("✓ healthy")
    assert page.value("document.querySelectorAll('[data-region=trends] canvas').length") >= 4
    assert page.value(TOO_WIDE) <= 0

    stop = {"state": State.STOP, "joints": ("G",), "why": NASTY, "do": NASTY, "fault_code": "X"}
    leg.take_state(attrs.evolve(state_of(11, **stop), alarms=raised("clearance G", state=NASTY)).to_json())
    page.wait("document.title.startsWith('■ stop joint G (knee)')", "the new verdict")
    assert "STOP" in page.text("[data-region=verdict]") and "<img" in page.text("[data-region=verdict]")
    assert "ERROR clearance G (knee)" in page.text("[data-region=alarms]")
    assert page.value(FOREIGN) == 0
    assert page.value(TOO_WIDE) <= 0

    clock.now_s += OLD_AFTER_S + 7.0
    page.wait(IS_OLD, "the page to turn grey")
    assert page.text(".freshness").startswith("NO DATA for 1")
    assert page.value("document.title").startswith("? no data")
    walk(leg, 30)
    page.wait(IS_FRESH, "the page to be fresh again")
    assert page.console == []

    dashboard.end()
    page.wait(IS_OLD, "the page to turn grey")
    assert page.text(".freshness").startswith("NO CONNECTION to the dashboard for ")


def test_what_is_wrong_would_be_seen(tmp_path):
    page = LivePage("data:text/html,<script>nothing()</script><p>shown", tmp_path)
    try:
        page.wait("document.body?.innerText === 'shown'", "the page")
        assert any("nothing is not defined" in line for line in page.console)
    finally:
        page.close()


RENEW = """(() => {
  const region = document.querySelector("[data-region=motion]");
  region.innerHTML = region.innerHTML.replace(/ data-ready="1"/, "");
  document.dispatchEvent(new Event("replaced"));
})()"""


@pytest.mark.parametrize("page", [390], indirect=True)
def test_the_leg_goes_on_moving_when_its_part_of_the_page_is_renewed(page, leg):
    """The picture before it is out of sight then, and is not the one that counts."""
    page.value("document.getElementById('leg-slider').scrollIntoView()")
    wait_for(lambda: leg.motion.viewers == 1, "a viewer")
    for _ in range(5):
        page.value(RENEW)
        # two frames later the browser has told which pictures are seen
        page.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")
        page.value("new Promise((done) => setTimeout(done, 50))")
        assert page.value("document.querySelector('#leg-slider .play').textContent") == "Pause"
        wait_for(lambda: leg.motion.viewers == 1, "the viewer again", 10.0)
    page.value("document.getElementById('leg-slider').style.display = 'none'")
    leg.take_motion("")  # who is gone is noticed when there is something for him
    wait_for(lambda: leg.motion.viewers == 0, "nobody to look")
