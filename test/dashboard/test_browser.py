"""The page in a browser, on a desk and on a phone: it is renewed, loud when it is old, and runs no markup."""

import attrs
import pytest
from browser import NEEDS_CHROMIUM, WIDTHS
from heard_leg import raised, state_of, walk

pytest.importorskip("tornado")
from live_browser import LivePage

from leg_wear_monitor.dashboard.live_leg import OLD_AFTER_S
from leg_wear_monitor.state import State

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


@NEEDS_CHROMIUM
@pytest.mark.parametrize("page", WIDTHS, indirect=True)
def test_it_is_renewed_says_when_it_is_old_or_alone_and_runs_no_markup(page, dashboard, leg, clock):
    assert page.text("[data-region=verdict] .verdict").split() == ["✓", "HEALTHY"]
    assert page.value("document.title").startswith("✓ healthy")
    assert page.value("document.querySelectorAll('[data-region=trends] canvas').length") >= 1
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


@NEEDS_CHROMIUM
def test_what_is_wrong_would_be_seen(tmp_path):
    page = LivePage("data:text/html,<script>nothing()</script><p>shown", tmp_path)
    try:
        page.wait("document.body?.innerText === 'shown'", "the page")
        assert any("nothing is not defined" in line for line in page.console)
    finally:
        page.close()


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ({}, 200),
        ({"Host": "evil.example"}, 403),  # a page elsewhere whose name was made to lead here
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"method": "POST", "body": b"x"}, 405),
        ({"path": "/nowhere/<b>"}, 404),
    ],
)
def test_who_reads_it_uses_its_name_and_no_page_elsewhere_does(dashboard, request_, code):
    status, headers, text = dashboard.ask(**request_)
    assert status == code
    if code == 200:
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    else:
        assert text.startswith(f"{code} ") and "<" not in text
    with dashboard.events() as events:
        assert next(events)
