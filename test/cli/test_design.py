"""What `design` prints and writes."""

import csv
import json

import pytest

TRIED = ("--materials", "pai-on-steel-dry,brass-on-steel-dry", "--widths-mm", "5,10", "--diameters-mm", "10")


@pytest.fixture
def result(run):
    return run("design", "four_bar", "--duty", "0:8", *TRIED, "--hours", "10", "--out", "out")


def test_each_joint_is_reported_as_it_is_and_with_the_smallest_that_lasts(result, tmp_path):
    assert result.exit_code == 0
    for joint in ("B", "C"):
        assert f"{joint} now: " in result.stdout
    smallest = "smallest that lasts: pai-on-steel-dry, pin 10 mm, width 5 mm, clearance "
    assert result.stdout.count(smallest) == 2
    assert "make " in result.stdout.splitlines()[-4]
    assert "life of B now: in the air, 10 % more cadence -" in result.stdout
    document = json.loads((tmp_path / "out" / "design.json").read_text())
    assert {one["joint"] for one in document["own"]} == {"B", "C"}
    with (tmp_path / "out" / "design.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * 2 * 3  # joints, pairs, widths, clearances
    assert {row["limited_by"] for row in rows} == {"wear", "unknown"}
    page = (tmp_path / "out" / "design.html").read_text()
    assert "Joint B" in page
    assert "<svg" in page or "data:image/svg+xml" in page


@pytest.mark.plain
@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("--duty", "300"), "error: --duty: '300' is not N:hours a day, expected such as 0:2,300:5,600:1"),
        (("--widths-mm", "8,x"), "is not a list of numbers above 0, such as 8,10,12"),
        (("--materials", "cheese"), "cheese"),
        (("--limit-m", "5e-5"), "error: --limit-m: 5e-05 m is not above the largest clearance when new"),
    ],
)
def test_a_wrong_option_is_one_line(refused, arguments, fault):
    assert fault in refused("design", "four_bar", *arguments)
