"""The page of a thousand legs in a browser: it searches, filters, sorts, fits, and runs no text."""

import re

import attrs
import pytest
from browser import NEEDS_CHROMIUM, WIDTHS, browse
from made_up_fleet import NOW_NS, made_up_fleet, random_fleet

from leg_wear_monitor.report.fleet_page import counts, fleet_page
from leg_wear_monitor.report.fleet_standing import Day, Standing
from leg_wear_monitor.report.page import page_html

pytestmark = NEEDS_CHROMIUM

DAY = Day(now_ns=NOW_NS, fresh_days=7.0)
NASTY = '<img src=x onerror="parent.ran=true"><script>parent.ran = true</script>'

TRY = """
function look(frame) {
  const page = frame.contentDocument, root = page.documentElement, event = frame.contentWindow.Event;
  const rows = () => Array.from(page.querySelectorAll(".legs tbody tr"));
  const column = (k) => rows().map((row) => row.children[k].textContent);
  const put = (part, value, name) => { part.value = value; part.dispatchEvent(new event(name)); };
  const search = page.querySelector("input[type=search]"), choices = page.querySelectorAll("form select");
  const buttons = page.querySelectorAll(".legs thead button"), said = page.querySelector("output");
  const found = {
    overflow: root.scrollWidth - root.clientWidth, begin: rows().length, first: column(0).slice(0, 10),
    small: Array.from(page.querySelectorAll("button, select, input"))
      .filter((part) => part.offsetParent && part.getBoundingClientRect().height < 24).length
  };
  page.querySelector(".more button").click();
  found.more = rows().length;
  put(search, "LEG-0123", "input");
  found.searched = column(0);
  put(search, "no such leg", "input");
  found.nothing = [rows().length, said.textContent];
  put(search, "", "input");
  put(choices[0], "stop", "change");
  found.stop = [rows().length, said.textContent];
  put(choices[1], "2026-06", "change");
  found.lots = column(2);
  put(choices[0], "", "change");
  put(choices[1], "", "change");
  buttons[3].click();
  found.down = column(3);
  found.sorted = page.querySelectorAll(".legs th")[3].getAttribute("aria-sort");
  buttons[3].click();
  found.up = column(3);
  const map = page.querySelector("canvas"), box = map.getBoundingClientRect();
  const pixels = map.getContext("2d").getImageData(0, 0, map.width, map.height).data;
  found.tints = new Set(new Uint32Array(pixels.buffer)).size;
  const spot = { clientX: box.right - 1, clientY: box.top + 5, bubbles: true };
  const pointer = frame.contentWindow.PointerEvent;
  map.dispatchEvent(new pointer("pointermove", spot));
  found.pointed = page.querySelector(".map .note").textContent;
  map.dispatchEvent(new pointer("click", spot));
  found.clicked = column(0);
  put(search, "onerror", "input");
  found.nasty = [rows().length, rows()[0].textContent, Boolean(window.ran)];
  return found;
}
window.addEventListener("load", () => setTimeout(() => {
  const found = Array.from(document.querySelectorAll("iframe")).map(look);
  setTimeout(() => { document.getElementById("found").textContent = JSON.stringify(found); }, 200);
}, 500));
"""


@pytest.fixture(scope="module")
def fleet():
    first, *rest = random_fleet(1000).legs
    verdict = attrs.evolve(first.verdict, why=NASTY)
    return made_up_fleet([attrs.evolve(first, id=NASTY, lot=NASTY, verdict=verdict), *rest])


@pytest.fixture(scope="module")
def seen(fleet, tmp_path_factory):
    page = page_html(fleet_page(fleet, DAY, {leg.id for leg in fleet.legs}))
    found, console = browse([page], tmp_path_factory.mktemp("browser"), TRY)
    assert console == []
    return dict(zip(WIDTHS, found, strict=True))


def test_it_fits_and_shows_fifty_legs_at_first(seen):
    for width, found in seen.items():
        assert found["overflow"] <= 0, width
        assert (found["begin"], found["more"], found["small"]) == (50, 300, 0), width


def test_search_and_filters(seen, fleet):
    stopped = counts(fleet.legs, DAY)[Standing.STOP]
    for found in seen.values():
        assert found["searched"] == ["leg-0123"]
        assert found["nothing"] == [0, "0 of 1000 legs"]
        assert found["stop"] == [stopped, f"{stopped} of 1000 legs"]
        assert set(found["lots"]) <= {"2026-06"}


def test_a_title_sorts_and_what_is_not_known_comes_last(seen):
    for found in seen.values():
        for column, is_down in ((found["down"], True), (found["up"], False)):
            known = [int(each) for each in column if each not in ("–", "not valid")]
            assert len(known) == 50 and known == sorted(known, reverse=is_down)
        assert found["sorted"] == "ascending"


def test_the_map_is_drawn_and_finds_the_leg_one_points_at(seen):
    for found in seen.values():
        assert found["tints"] >= 4
        assert re.fullmatch(r"leg-\d+: A (–|not valid|\d+ %), .*", found["pointed"])
        assert found["clicked"] == [found["pointed"].split(":")[0]]


def test_no_text_is_run_as_a_script(seen):
    for found in seen.values():
        number, text, has_run = found["nasty"]
        assert number == 1 and NASTY in text and not has_run
