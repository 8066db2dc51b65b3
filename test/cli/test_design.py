"""What `design` prints and writes."""

import json

import pytest

TRIED = ("--materials", "pai-on-steel-dry,pa66-on-steel-dry", "--widths-mm", "5,10", "--diameters-mm", "10")


def test_each_joint_is_shown_as_it_is_and_with_the_smallest_that_lasts(run, tmp_path):
    result = run("design", "four_bar", "--duty", "0:8", *TRIED, "--hours", "10", "--json", "design.json")
    assert result.code == 0
    lines = result.out.splitlines()
    for joint in ("B", "C"):
        (at,) = (i for i, line in enumerate(lines) if line.startswith(f"{joint} now "))
        assert lines[at + 1].split()[:4] == [joint, "pai-on-steel-dry", "10", "5"]
    found = json.loads((tmp_path / "design.json").read_text())["bushings"]
    assert len(found) == 2 + 2 * 2 * 2 * 3  # present ones; joints, pairs, widths, clearances
    assert {row["limited_by"] for row in found if not row["is_present"]} == {"wear"}


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (
            ("--duty", "300"),
            ("error: --duty: '300' is not N:hours per day. Expected for example 0:2,300:5,600:1"),
        ),
        (("--widths-mm", "8,x"), "is not a list of numbers above 0, such as 8,10,12"),
        (("--materials", "cheese"), "cheese"),
        (("--materials", "brass-on-steel-dry"), "brass-on-steel-dry gives no wear coefficient"),
        (("--limit-m", "5e-5"), "error: --limit-m: 5e-05 m is not between"),
    ],
)
def test_a_wrong_option_is_one_line(refused, arguments, fault):
    assert fault in refused("design", "four_bar", *arguments)
