"""Every page in a browser, as on a desk and as on a phone: nothing is missing, too wide, broken or dead.

Headless Chromium lays out all pages in frames of two widths, a script tries them and leaves what it found.
"""

import json
from pathlib import Path

import pytest
from browser import NEEDS_CHROMIUM, WIDTHS, browse, printed
from matplotlib.figure import Figure
from mechanism_of import document_of, write_mechanism

import leg_wear_monitor as lw

pytestmark = NEEDS_CHROMIUM

SMALL = {
    "ensemble": {"runs": 2, "cycles": 2, "skip_cycles": 1, "traced_cycles": 1},
    "exponent": {"runs": 2, "cycles": 10, "renewals": 16},
    "section": {"cycles": 4, "skip_cycles": 1},
    "portrait": {"cycles": 6, "skip_cycles": 1, "portrait_cycles": 2},
}
TINY = {
    "size": [{"clearance_m": [1.0e-4, 2.0e-4, 3.0e-4, 4.0e-4]}],
    "speed": [{"speed_rpm": [45, 60]}],
    "location": [{"clearances": [["A", "B"], ["G"]]}],
    "multi": [
        {"clearances": [["A", "B"], ["G"], ["I", "J"], ["A", "B", "I", "J"], ["A", "B", "G", "I", "J"]]}
    ],
    "laws": [{"normal_law": ["hertz", "flores"]}, {"friction": ["none"]}, {"friction_coefficient": [0.1]}],
    "load": [{"ground_n": [0, 300], "keep": ["response", "exponent"]}],
    "wear": [{"clearances": [["I", "J"]]}],
    "chaos": [
        {"keep": ["response", "portrait"]},
        {"clearances": [["A", "B"], ["G"]], "keep": ["exponent"]},
        {"clearance_m": [2.0e-4, 3.0e-4], "keep": ["section"]},
        {"speed_rpm": [20, 60], "keep": ["section"]},
    ],
}

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


def page_of(directory: Path) -> str:
    return (directory / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module", params=[("location",), pytest.param(TINY, marks=pytest.mark.slow)], ids=len)
def seen(request, run, tmp_path_factory):
    """By name of the study and width."""
    home, pages = tmp_path_factory.mktemp("studies"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", paint_blank)
        for name in request.param:
            document = {"title": name, "question": f"{name}?", "clearances": ["G"], "sweeps": TINY[name]}
            (home / f"{name}.yaml").write_text(json.dumps(document | SMALL))
            done = run("study", home / f"{name}.yaml", "--out", home / name, "--workers", 1)
            assert done.code == 0, done.err
            pages.append(page_of(home / name))
    found, console = browse(pages, home, TRY)
    assert console == []
    return dict(zip([(name, width) for name in request.param for width in WIDTHS], found, strict=True))


@pytest.fixture(scope="module")
def replay_page(run, tmp_path_factory) -> str:
    """Page of a leg whose knee breaks out."""
    bag, out = lw.share_directory() / "bags" / "knocking", tmp_path_factory.mktemp("replay") / "out"
    done = run("replay", f"{bag}.mcap", "--config", f"{bag}.yaml", "--out", out)
    assert done.code == 0, done.err
    return page_of(out)


def test_figures_and_tables_are_there_and_fit(seen):
    for at, found in seen.items():
        assert found["images"] >= 5, at
        assert found["tables"] >= 1, at
        assert (found["broken"], found["unnamed"], found["tiny"], found["small"]) == (0, 0, 0, 0), at
        assert found["overflow"] <= 0, at


def test_the_page_of_a_mechanism_moves_and_fits(run, tmp_path):
    """One that turns, one that rocks, one that is open, one that does not move."""
    turning, rocking, open_, free = (document_of("four_bar") for _ in range(4))
    rocking["bodies"]["coupler"]["points"]["C"] = [0.13, 0.0]
    rocking["bodies"]["rocker"]["points"]["C"] = [0.1, 0.0]
    open_["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    del free["joints"]["C"], free["clearances"]
    codes, pages = [], []
    for number, document in enumerate((turning, rocking, open_, free)):
        file, page = tmp_path / f"{number}.yaml", tmp_path / f"{number}.html"
        write_mechanism(document, file)
        codes.append(run("draw", file, "--out", page).code)
        pages.append(page.read_text(encoding="utf-8"))
    assert codes == [0, 1, 1, 1]
    found, console = browse(pages, tmp_path, TRY)
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


def test_codes_of_a_guide_are_whole(replay_page, tmp_path):
    found, _ = browse([replay_page], tmp_path, CUT)
    assert all(page["words"] >= 4 for page in found)
    assert [page["cut"] for page in found] == [0, 0]


def test_what_is_wrong_would_be_seen(tmp_path):
    """A page that is too wide, lacks its picture and its script."""
    page = '<div style="width:2000px">wide</div><img src="data:image/png;base64,AAAA">'
    (found, narrow), console = browse([page + "<script>nothing()</script>"], tmp_path, TRY)
    assert found["overflow"] > 500 < narrow["overflow"]
    assert (found["broken"], found["unnamed"], found["images"]) == (1, 1, 1)
    assert any("nothing is not defined" in said for said in console)


def test_the_page_of_a_leg_is_printed_on_two_sheets(replay_page, tmp_path):
    """With five joints; what is folded would need seven more."""
    assert printed(replay_page, tmp_path) == 2
