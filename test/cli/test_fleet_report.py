"""``fleet report``: the page of a fleet and those of its legs, from what the last update wrote."""

import time

import pytest
from made_up_fleet import made_up_leg, written_fleet


@pytest.fixture
def fleet(tmp_path):
    """Two updated legs, one with its summary; the description has one more."""
    return written_fleet(tmp_path, "abc", made_up_leg("a"), made_up_leg("b"), lot="L") / "out"


COMMAND = ("fleet", "report", "fleet.yaml", "--out", "out")


def test_it_writes_the_pages_that_have_changed(run, fleet):
    done = run(*COMMAND)
    assert done.exit_code == 0
    assert done.stdout.splitlines() == ["pages of legs that have changed: 1", "written: out/report.html"]
    assert "Joint wear of" in (fleet / "legs" / "a" / "report.html").read_text()
    page = (fleet / "report.html").read_text()
    assert "3 legs, as of 20" in page
    assert "legs/a/report.html" in page and "legs/b/report.html" not in page
    assert "no recording of it was counted" in page  # the leg c
    assert "changed: 0" in run(*COMMAND).stdout
    summary = fleet / "legs" / "a" / "summary.json"
    time.sleep(0.02)
    summary.write_bytes(summary.read_bytes())
    assert "changed: 1" in run(*COMMAND).stdout


def test_a_fleet_without_a_recording_has_nothing_in_its_ledgers(run, tmp_path):
    (tmp_path / "fleet.yaml").write_text("legs:\n  - {id: a, recordings: none*.mcap}\n")
    done = run("fleet", "update", "fleet.yaml", "--out", "out")
    assert done.stdout.splitlines()[0] == "nothing to count, and nothing is counted yet"
    assert "none*.mcap matches no recording" in done.stderr


@pytest.mark.parametrize("text", ["{", "{}", '{"schema_version": 99}'])
def test_a_summary_that_makes_no_page_costs_its_page_only(run, fleet, text):
    (fleet / "legs" / "a" / "summary.json").write_text(text)
    done = run(*COMMAND)
    assert done.exit_code == 1
    assert "summary.json" in done.stderr and len(done.stderr.splitlines()) == 1
    assert "legs/a/report.html" not in (fleet / "report.html").read_text()


def test_without_an_update_there_is_no_page(run, fleet):
    (fleet / "fleet.json").unlink()
    done = run(*COMMAND)
    assert done.exit_code == 2
    assert "run fleet update" in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (fleet / "report.html").exists()


def test_how_old_a_recording_may_be(run, fleet):
    assert "last 7 days" in (run(*COMMAND), (fleet / "report.html").read_text())[1]
    run(*COMMAND, "--fresh-days", "30")
    assert "last 30 days" in (fleet / "report.html").read_text()
    assert run(*COMMAND, "--fresh-days", "0").exit_code == 2


def test_what_does_not_fit_into_the_memory_limit_is_tried_again_with_another_one(run, tmp_path):
    zstandard = pytest.importorskip("zstandard")
    (tmp_path / "large.mcap.zstd").write_bytes(zstandard.compress(bytes(20_000_000)))
    (tmp_path / "fleet.yaml").write_text("legs: [{id: a, recordings: '*.zstd'}]\n")
    update = ("fleet", "update", "fleet.yaml", "--workers", "1")
    assert "temporary files than --memory-mb 16 allows" in run(*update, "--memory-mb", "16").stderr
    assert "--memory-mb" not in run(*update).stderr
