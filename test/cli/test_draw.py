"""`draw`: what it writes and says of mechanisms that work and of those that do not."""

import re

import pytest

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
    assert result.code == 0
    assert result.out == "written: four_bar.html: four_bar: closes, and the crank turns through\n"
    page = (tmp_path / "four_bar.html").read_text()
    assert "200.00" in page  # mm, of the coupler
    assert 'content="leg-wear-monitor draw"' in page


def test_what_does_not_close_is_drawn_and_said_with_its_gap(run, long_coupler):
    out = long_coupler.with_suffix(".html")
    result = run("draw", str(long_coupler), "--out", str(out))
    assert result.code == 1
    assert re.search(r"does not close: joint [A-D] .* is open by 200 mm$", result.out.strip())
    (line,) = result.lines
    assert line.startswith(f"warning: {long_coupler}: assembly: joint ")
    assert '"gap_mm": [200.0]' in out.read_text()


def test_a_start_far_from_the_assembly_is_drawn_as_found(run, shipped, tmp_path):
    (tmp_path / "far.yaml").write_text(shipped("four_bar").replace("0.0, 1.6961]", "0.0, 2.3]"))
    result = run("draw", "far.yaml")
    assert (result.code, len(result.lines)) == (1, 1)
    assert "no assembly near the given start" in result.err


def test_names_are_text(run, evil, tmp_path):
    assert run("draw", evil).code == 0
    page = (tmp_path / "evil.html").read_text()
    assert EVIL not in page and "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;$x^{" in page


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["four_bar", "--out", "a.png"], "--out: a.png: expected a file that ends in .html"),
        (["four_bar", "--out", "none/a.html"], "--out: none/a.html: cannot be written: No such file"),
        (["nope.yaml"], "nope.yaml: cannot be read: No such file or directory"),
    ],
)
def test_bad_input_is_one_line_and_no_file(run, tmp_path, arguments, fault):
    result = run("draw", *arguments)
    assert (result.code, result.out) == (2, "")
    (line,) = result.lines
    assert line.startswith(f"error: {fault}")
    assert list(tmp_path.iterdir()) == []
