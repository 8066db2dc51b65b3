"""Every page in a browser, as on a desk and as on a phone: nothing is missing, too wide, broken or dead.

Headless Chromium lays out all pages in frames of two widths, a script tries them and leaves what it found.
"""

import attrs
import pytest
from browser import NEEDS_CHROMIUM, WIDTHS, browse, printed
from made_up_summary import made_up_summary
from matplotlib.figure import Figure

from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism
from leg_wear_monitor.mechanism.reach import findings, reach_of
from leg_wear_monitor.report.drawing import drawing_html
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.report.replay.page import replay_page
from leg_wear_monitor.report.study_page import study_page

pytestmark = NEEDS_CHROMIUM

STUDIES = ("size", "speed", "location", "multi", "laws", "load", "wear", "chaos")

TRY = """
function look(frame) {
  const page = frame.contentDocument, root = page.documentElement;
  const images = Array.from(page.images), slider = page.querySelector("#leg-slider input[type=range]");
  const found = {
    overflow: root.scrollWidth - root.clientWidth,
    broken: images.filter((image) => !image.complete || image.naturalWidth === 0).length,
    tiny: images.filter((image) => image.getBoundingClientRect().width < 200).length,
    images: images.length,
    unnamed: images.filter((image) => !image.alt).length,
    tables: page.querySelectorAll("table").length,
    small: Array.from(page.querySelectorAll("button, select"))
      .filter((part) => part.getBoundingClientRect().height < 24).length,
    slider: null
  };
  if (slider) {
    const leg = page.getElementById("leg-slider"), bodies = leg.querySelectorAll(".leg g[transform]");
    const state = () => Array.from(bodies).map((body) => body.getAttribute("transform")).join();
    const before = state();
    slider.value = 200;
    slider.dispatchEvent(new frame.contentWindow.Event("input"));
    found.slider = {
      moved: state() !== before, frame: leg.dataset.frame, angle: leg.querySelector(".angle").textContent,
      letters: Array.from(leg.querySelectorAll(".leg text")).map((text) => text.textContent).join("")
    };
    leg.querySelector(".play").click();
    found.slider.playing = leg.querySelector(".play").getAttribute("aria-pressed");
  }
  return found;
}
window.addEventListener("load", () => setTimeout(() => {
  const frames = Array.from(document.querySelectorAll("iframe")), found = frames.map(look);
  setTimeout(() => {
    frames.forEach((frame, i) => {
      const leg = frame.contentDocument.getElementById("leg-slider");
      if (found[i].slider) found[i].slider.played = leg.dataset.frame;
    });
    document.getElementById("found").textContent = JSON.stringify(found);
  }, 1500);
}, 500));
"""


def paint_blank(figure, *arguments, paint=Figure.savefig, **options):
    """Paint a figure without what is in it, which takes most of the time."""
    figure.clear()
    paint(figure, *arguments, **options)


@pytest.fixture(
    scope="module", params=[("location",), pytest.param(STUDIES, marks=pytest.mark.slow)], ids=len
)
def seen(request, study, tmp_path_factory):
    """By name of the study and width."""
    names = [(name, width) for name in request.param for width in WIDTHS]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", paint_blank)
        pages = [page_html(study_page(study(name))) for name in request.param]
    found, console = browse(pages, tmp_path_factory.mktemp("browser"), TRY)
    assert console == []
    return dict(zip(names, found, strict=True))


def test_figures_and_tables_are_there_and_fit(seen):
    for at, found in seen.items():
        assert found["images"] >= 5, at
        assert found["tables"] >= 1, at
        assert (found["broken"], found["unnamed"], found["tiny"], found["small"]) == (0, 0, 0, 0), at
        assert found["overflow"] <= 0, at


def test_the_page_of_a_mechanism_moves_and_fits(document, tmp_path):
    """One that turns, one that rocks, one that is open, one that does not move."""
    rocking, open_, free = document("four_bar"), document("four_bar"), document("four_bar")
    rocking["bodies"]["coupler"]["points"]["C"] = [0.13, 0.0]
    rocking["bodies"]["rocker"]["points"]["C"] = [0.1, 0.0]
    open_["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    del free["joints"]["C"], free["clearances"]
    mechanisms = [parse_mechanism(each, "edited.yaml") for each in (rocking, open_, free)]
    reaches = list(map(reach_of, (load_mechanism("four_bar"), *mechanisms)))
    assert [bool(findings(reach)) for reach in reaches] == [False, True, True, True]
    found, console = browse(list(map(drawing_html, reaches)), tmp_path, TRY)
    assert console == []
    for page in found:
        assert page["overflow"] <= 0
        assert (page["small"], page["tables"]) == (0, 2)
    for page in found[:4]:
        assert page["slider"]["playing"] == "true"
        assert page["slider"]["played"] != page["slider"]["frame"]
        assert page["slider"]["letters"] == "ABCD"
    assert [page["slider"]["moved"] for page in found[:4:2]] == [True, False]  # at its last one already
    assert [page["slider"] for page in found[4:]] == [None] * 4


CUT = """
window.addEventListener("load", () => setTimeout(() => {
  const found = Array.from(document.querySelectorAll("iframe")).map((frame) => {
    const page = frame.contentDocument;
    page.querySelectorAll("details").forEach((part) => { part.open = true; });
    const codes = Array.from(page.querySelectorAll(".guide td:first-child code"));
    const words = codes.filter((code) => !code.textContent.includes(" "));
    return {words: words.length, cut: words.filter((code) => code.getClientRects().length > 1).length};
  });
  document.getElementById("found").textContent = JSON.stringify(found);
}, 500));
"""


def test_codes_of_a_guide_are_whole(tmp_path):
    summary = made_up_summary()
    summary = attrs.evolve(summary, verdict=attrs.evolve(summary.verdict, fault_code="CLEARANCE_DETECTED_A"))
    found, _ = browse([page_html(replay_page(summary))], tmp_path, CUT)
    assert all(page["words"] >= 4 for page in found)
    assert [page["cut"] for page in found] == [0, 0]


def test_what_is_wrong_would_be_seen(tmp_path):
    """A page that is too wide, lacks its picture and its script."""
    page = '<div style="width:2000px">wide</div><img src="data:image/png;base64,AAAA">'
    (found, narrow), console = browse([page + "<script>nothing()</script>"], tmp_path, TRY)
    assert found["overflow"] > 500 < narrow["overflow"]
    assert (found["broken"], found["unnamed"], found["images"]) == (1, 1, 1)
    assert any("nothing is not defined" in said for said in console)


def test_the_page_of_a_leg_is_printed_on_two_sheets(tmp_path):
    """With five joints and a long verdict; what is folded would need seven more."""
    joints, summary = tuple("ABGIJ"), made_up_summary()
    summary = attrs.evolve(
        summary,
        monitor=attrs.evolve(summary.monitor, clearance_joints=joints),
        verdict=attrs.evolve(summary.verdict, why=40 * "why ", do=60 * "do "),
        joints=dict.fromkeys(joints, summary.joints["A"]),
        clearances=dict.fromkeys(joints, summary.clearances["A"]),
    )
    assert printed(page_html(replay_page(summary)), tmp_path) == 2
