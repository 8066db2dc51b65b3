"""`draw`: what it writes and says of mechanisms that work and of those that do not."""

import json
import re
import signal
import subprocess
import sys
import time
from xml.etree import ElementTree

import pytest

import leg_wear_monitor as lw

EVIL = "<script>alert(1)</script>$x^{"


@pytest.fixture
def long_coupler(shipped, tmp_path):
    """A four-bar that does not close."""
    path = tmp_path / "long.yaml"
    path.write_text(shipped("four_bar").replace("C: [0.200, 0.0]", "C: [0.500, 0.0]"))
    return path


@pytest.fixture
def evil(shipped, tmp_path):
    """Names that are markup, and a formula that is none."""
    text = shipped("four_bar").replace("name: four_bar", f"name: '{EVIL}'")
    for before in ("  ", "journal: ", "body: "):
        text = re.sub(rf"{before}crank([:,])", lambda found: f"{found[0][:-6]}'{EVIL}'{found[1]}", text)
    (tmp_path / "evil.yaml").write_text(text)
    return "evil.yaml"


def test_a_page_of_a_shipped_mechanism(run, tmp_path):
    result = run("draw", "four_bar")
    assert result.exit_code == 0
    assert result.stdout == "written: four_bar.html: four_bar: closes, and the crank turns through\n"
    page = (tmp_path / "four_bar.html").read_text()
    assert "200.00" in page  # mm, of the coupler
    assert 'content="leg-wear-monitor draw"' in page
    assert "location.reload" not in page


def test_a_drawing_is_replaced_with_a_word_and_nothing_else_is(run, tmp_path, complaints):
    assert run("draw", "four_bar").exit_code == 0
    assert run("draw", "four_bar").stdout.startswith("replaced: four_bar.html: ")
    for name in ("mine.html", "mine.svg"):
        (tmp_path / name).write_text("mine")
        result = run("draw", "four_bar", "--out", name)
        assert (result.exit_code, (tmp_path / name).read_text()) == (2, "mine")
        fault = "exists and is no drawing of this command, expected another --out FILE"
        assert complaints(result) == [f"error: --out: {name}: {fault}"]


@pytest.mark.parametrize("suffix", ["html", "svg"])
def test_what_does_not_close_is_drawn_and_said_with_its_gap(run, long_coupler, complaints, suffix):
    out = long_coupler.with_suffix(f".{suffix}")
    result = run("draw", str(long_coupler), "--out", str(out))
    assert result.exit_code == 1
    assert re.search(r"does not close: joint [A-D] .* is open by 200 mm$", result.stdout.strip())
    (line,) = complaints(result)
    assert line.startswith(f"warning: {long_coupler}: assembly: joint ")
    assert "least gap is 100 mm, at 180.0 deg" in line
    if suffix == "html":
        assert '"gap_mm": [200.0, ' in out.read_text()
    else:
        assert "200 mm" in out.read_text()  # a comment beside the letters' shapes


def test_a_start_far_from_the_assembly_is_drawn_as_found(run, shipped, complaints, tmp_path):
    (tmp_path / "far.yaml").write_text(shipped("four_bar").replace("0.0, 1.6961]", "0.0, 2.3]"))
    result = run("draw", "far.yaml")
    assert (result.exit_code, len(complaints(result))) == (1, 1)
    assert "no assembly near the given start" in result.stderr


def test_names_are_text(run, evil, tmp_path):
    assert run("draw", evil).exit_code == 0
    page = (tmp_path / "evil.html").read_text()
    assert EVIL not in page and "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;$x^{" in page
    assert run("draw", evil, "--out", "evil.svg").exit_code == 0
    picture = ElementTree.parse(tmp_path / "evil.svg")
    assert not [each for each in picture.iter() if each.tag.endswith("script")]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["four_bar", "--out", "a.png"], "--out: a.png: expected a file that ends in .html or .svg"),
        (["four_bar", "--out", "none/a.svg"], "--out: none/a.svg: there is no directory none"),
        (["nope.yaml"], "nope.yaml: cannot be read: No such file or directory"),
        (["nope.yaml", "--watch"], "nope.yaml: there is no such file to watch"),
        (["four_bar", "--forces", "--out", "a.svg"], "--forces: a.svg is a still picture"),
        (["long.yaml", "--forces"], "--forces: there are no forces over a cycle: does not close"),
        (
            ["rocking.yaml", "--crank-angle", "150"],
            "--crank-angle: 150 deg cannot be drawn: the crank does not",
        ),
    ],
)
def test_bad_input_is_one_line_and_no_file(
    run, long_coupler, shipped, complaints, tmp_path, arguments, fault
):
    text = shipped("four_bar").replace("B: [0.050, 0.0]", "B: [0.1, 0.0]").replace("D: [0.200", "D: [0.3")
    text = text.replace("coupler: [0.050, 0.0, 0.8481]", "coupler: [0.1, 0.0, 0.81]")
    (tmp_path / "rocking.yaml").write_text(text.replace("[0.200, 0.0, 1.6961]", "[0.3, 0.0, 1.8]"))
    result = run("draw", *arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    (line,) = complaints(result)
    assert line.startswith(f"error: {fault}")
    assert {path.suffix for path in tmp_path.iterdir()} == {".yaml"}


def test_forces_are_those_of_the_ideal_simulation(run, tmp_path):
    assert run("draw", "four_bar", "--forces").exit_code == 0
    page = (tmp_path / "four_bar.html").read_text()
    data = json.loads(re.search(r'class="data">(.*?)</script>', page, re.DOTALL).group(1))
    pins = data["runs"][0]["pins"]
    largest = lw.simulate("four_bar", clearances=[], cycles=1).joints
    for joint, pin in pins.items():
        found = max((x * x + y * y) ** 0.5 for x, y in pin["f"])
        assert found == pytest.approx(largest[joint].max_force_n, rel=1e-2)


def test_watch_draws_on_save_survives_a_half_saved_file_and_ends_with_0(shipped, tmp_path):
    file, page = tmp_path / "leg.yaml", tmp_path / "leg.html"
    text = shipped("four_bar")
    file.write_text(text)
    log = tmp_path / "log"
    line = [sys.executable, "-u", "-m", "leg_wear_monitor", "draw", "leg.yaml", "--watch"]

    def save(content):
        """As editors do, so that no one sees a file cut short by chance."""
        (tmp_path / "saved").write_text(content)
        (tmp_path / "saved").replace(file)

    def wait_for(words):
        for _ in range(600):
            if words in log.read_text():
                return
            time.sleep(0.2)
        raise AssertionError(log.read_text())

    with log.open("w") as out, subprocess.Popen(line, cwd=tmp_path, stdout=out, stderr=out) as process:
        try:
            wait_for("written: leg.html: four_bar: closes")
            assert "location.reload" in page.read_text()
            save(text[: len(text) // 2])
            wait_for("error: leg.yaml")
            save(text.replace("name: four_bar", "name: renamed"))
            wait_for("replaced: leg.html: renamed: closes")
            assert "<h1>renamed</h1>" in page.read_text()
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
        finally:
            process.kill()
    assert log.read_text().count("error:") == 1
    assert "location.reload" not in page.read_text()


def test_a_robot_description_in_place_of_a_picture(run, refused, tmp_path):
    result = run("draw", "slider_crank", "--urdf")
    assert result.exit_code == 0
    text = (tmp_path / "slider_crank.urdf").read_text()
    assert ElementTree.fromstring(text).get("name") == "slider_crank"
    (comment,) = re.findall("<!--(.*?)-->", text)
    assert "--" not in comment  # which is no XML, though Python reads it
    assert run("draw", "slider_crank", "--out", "slider_crank.urdf").exit_code == 0  # ours: replaced
    assert "expected no other option than --out FILE.urdf" in refused(
        "draw", "slider_crank", "--urdf", "--forces"
    )
