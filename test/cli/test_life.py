"""What `life` prints and writes."""

import json
import re
from pathlib import Path

import pytest

ONE = ("life", "--mechanism", "four_bar", "--legs", "1", "--cycles", "2", "--max-wear-per-jump-m", "5e-5")


def test_life_tells_when_each_joint_reaches_its_limit(run, tmp_path):
    result = run(*ONE, "--limit-m", "5.2e-4", "--out", "out")
    assert result.code == 0
    life = json.loads((tmp_path / "out" / "life.json").read_text())
    assert (tmp_path / "out" / "life.png").read_bytes().startswith(b"\x89PNG")
    assert set(life["joints"]) == {"B", "C"}
    for joint, figures in life["joints"].items():
        assert figures["clearance_m"] == sorted(figures["clearance_m"])
        assert f"{joint} reaches 520 µm after" in result.out
        assert re.search(rf"{joint} reaches 520 µm after \S+ gait cycles, \S+ h", result.out)
    # the table has the first and the last point, and at most ten between them
    words = [line.split()[0] for line in result.out.splitlines()]
    rows = words[words.index("cycles") + 1 : words.index("jumps:")]
    assert len(life["cycles"]) > 12 == len(set(rows)) == len(rows)
    assert [rows[0], rows[-1]] == [f"{life['cycles'][i]:.3g}" for i in (0, -1)]


def test_life_tells_regime_and_limits(run, refused, shipped, tmp_path):
    """A pair with limits only is refused; a coefficient beside it counts."""
    text = shipped("four_bar")
    limited = text.replace("wear_coefficient: 1.0e-15", "material: du-on-steel-dry")
    (tmp_path / "limited.yaml").write_text(limited)
    assert "wear_coefficient: is missing: du-on-steel-dry" in refused("life", "--mechanism", "limited.yaml")
    (tmp_path / "beside.yaml").write_text(
        text.replace("wear_coefficient: 1.0e-15", "material: du-on-steel-dry\n    wear_coefficient: 1.0e-15")
    )
    result = run("life", "--mechanism", "beside.yaml", *ONE[3:], "--limit-m", "5.2e-4")
    assert result.code == 0
    assert "nan" not in result.out
    assert "B holds for a value beside du-on-steel-dry (dry)\n" in result.out


def test_life_under_a_duty_tells_hours_and_days(run):
    few = ("--clearances", "A,G", "--legs", "1", "--cycles", "2", "--limit-m", "3.1e-4")
    result = run("life", *few, "--duty", "0:2,600:6", "--json", "life.json")
    assert result.code == 0
    found = json.loads(Path("life.json").read_text())["duty"]
    assert (found["peak_n"], found["hours_per_day"], found["limit_m"]) == ([0.0, 600.0], [2.0, 6.0], 3.1e-4)
    for name, end in found["end"].items():
        assert f"{name} reaches 310 µm after {end['cycles']:.3g} gait cycles" in result.out
        assert f"{end['hours']:.3g} h, {end['days']:.3g} days of 8 h" in result.out
        assert (end["hours"], end["days"]) == pytest.approx((end["cycles"] / 3600.0, end["cycles"] / 28800.0))
    assert found["end"]["leg"] == min((found["end"][joint] for joint in "AG"), key=lambda end: end["cycles"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--limit-m 0.0002", "--limit-m: 0.0002 m is not between 0.0002 m, the new clearance of joint B,"),
        ("--limit-m 0.6", "0.008 m, the radius of its bushing; did you mean 0.0006 m (0.6 mm)?"),
        (
            "--max-wear-per-jump-m 1e-15",
            "--max-wear-per-jump-m: 1e-15 m per jump takes 4e+11 jumps to the limit. Expected at most 10000",
        ),
        ("--duty 300", "--duty: '300' is not N:hours per day. Expected for example 0:2,300:5,600:1"),
    ],
)
def test_a_life_that_would_not_end_is_refused_before_it_begins(refused, options, said):
    line = refused("life", "--mechanism", "four_bar", *options.split())
    assert line.startswith("error: --")
    assert said in line
