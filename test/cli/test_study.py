"""The verbs study and report: data and a page from one command, and the page again from the data."""

import json
import shutil

import pytest

TINY = """\
joints: [G]
clearances_m: [0.0001, 0.0003]
ensemble: {runs: 2, cycles: 2, skip_cycles: 1, traced_cycles: 1}
"""


@pytest.fixture(scope="module")
def computed():
    """What the command printed, and a copy of what it wrote, once a test has run it."""
    return {}


@pytest.fixture
def done(run, unpainted, tmp_path, tmp_path_factory, computed):
    (tmp_path / "tiny.yaml").write_text(TINY)
    if computed:
        shutil.copytree(computed["out"], tmp_path / "out")
    else:
        computed["result"] = run("study", "size", "--config", "tiny.yaml", "--out", "out", "--workers", "1")
        computed["out"] = tmp_path_factory.mktemp("computed") / "out"
        shutil.copytree(tmp_path / "out", computed["out"])
    return computed["result"]


def test_a_study_leaves_data_and_a_page_and_goes_on_where_it_was(run, done, tmp_path, complaints):
    assert (done.exit_code, complaints(done)) == (0, [])
    assert done.stdout == "points: 2, 2 computed now\nwritten: out/report.html\n"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "mechanism.yaml", "points", "report.html", "study.json",
    ]  # fmt: skip
    again = run("study", "size", "--config", "tiny.yaml", "--out", "out")
    assert again.stdout == "points: 2, 0 computed now\nwritten: out/report.html\n"


def test_the_page_is_drawn_again_from_the_data_alone(run, done, tmp_path):
    page = tmp_path / "out" / "report.html"
    first = page.read_bytes()
    page.unlink()
    result = run("report", "out")
    assert (result.exit_code, result.stdout) == (0, "written: out/report.html\n")
    assert page.read_bytes() == first


def test_a_fault_of_the_page_is_not_blamed_on_the_data(run, done, monkeypatch):
    """Checksums have shown by then that nothing was altered."""
    monkeypatch.setattr("leg_wear_monitor.report.study.page.study_page", lambda _results: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run("report", "out")


def test_another_leg_is_an_option(run, tmp_path, unpainted):
    (tmp_path / "tiny.yaml").write_text(TINY.replace("0.0001, ", ""))
    result = run("study", "size", "--config", "tiny.yaml", "--mechanism", "jansen_leg", "--out", "out")
    assert result.exit_code == 0
    assert json.loads((tmp_path / "out" / "study.json").read_text())["settings"]["mechanism"] == "jansen_leg"


def test_a_pair_without_wear_coefficient_is_reported(run, shipped, tmp_path, unpainted, complaints):
    limits_only = shipped("four_bar").replace("wear_coefficient: 1.0e-15", "material: du-on-steel-dry")
    (tmp_path / "limits.yaml").write_text(limits_only)
    (tmp_path / "tiny.yaml").write_text(TINY.replace("[G]", "[B]").replace("0.0001, ", ""))
    result = run("study", "size", "--config", "tiny.yaml", "--mechanism", "limits.yaml", "--out", "out")
    (line,) = complaints(result)
    assert result.exit_code == 0
    assert line.startswith("warning: limits.yaml: clearances (A, B, C, D): material: du-on-steel-dry gives ")
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Wear of B is not counted: the pair gives no wear coefficient." in page


def test_points_that_are_missing_are_reported_and_the_rest_is_shown(run, done, tmp_path):
    first = json.loads((tmp_path / "out" / "study.json").read_text())["points"][0]["key"]
    (tmp_path / "out" / "points" / f"{first}.npz").unlink()
    result = run("report", "out")
    assert result.exit_code == 1
    assert result.stderr == "warning: point 0.1 mm: is not computed yet\n"
    assert "Not computed yet: 0.1 mm." in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.plain
@pytest.mark.parametrize(
    ("line", "fault"),
    [
        (["study", "sizes", "--out", "o"], "'sizes' is not one of 'chaos', 'laws'"),
        (["study", "size"], "Missing option '--out'"),
        (["study", "size", "--config", "no.yaml", "--out", "o"], "no.yaml: cannot be read: No such file"),
        (["study", "size", "--mechanism", "frog", "--out", "o"], "frog: no mechanism of this name"),
        (["report", "nowhere"], "nowhere: contains no study.json, expected the --out of a study"),
    ],
)
def test_what_cannot_be_is_one_line(run, line, fault):
    result = run(*line)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert fault in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_scheduler_that_does_not_answer_is_reported(run, tmp_path):
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    (tmp_path / "tiny.yaml").write_text(TINY)
    line = ("study", "size", "--config", "tiny.yaml", "--out", "o", "--scheduler", "frog://nowhere")
    result = run(*line)
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1] == "error: --scheduler: frog://nowhere: no scheduler answers there"
