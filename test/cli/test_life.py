"""What `life` prints and writes."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.cli.verbs.life import life_lines
from leg_wear_monitor.life import life as many_lives
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.monitor.forecast.growth import read_lives
from leg_wear_monitor.monitor.ledger.entry import fingerprint

ONE = ("life", "--mechanism", "four_bar", "--legs", "1", "--cycles", "2", "--max-wear-per-jump-m", "5e-5")


def test_life_tells_when_each_joint_reaches_its_limit(run, tmp_path):
    result = run(*ONE, "--limit-m", "5.2e-4", "--ensemble-size", "3", "--out", "out")
    assert result.exit_code == 0
    life = json.loads((tmp_path / "out" / "life.json").read_text())
    assert (tmp_path / "out" / "life.png").read_bytes().startswith(b"\x89PNG")
    assert set(life["joints"]) == {"B", "C"}
    for joint, figures in life["joints"].items():
        assert figures["clearance_m"] == sorted(figures["clearance_m"])
        assert f"{joint} reaches 520 µm after" in result.stdout
        assert re.search(rf"{joint} reaches 520 µm after \S+ gait cycles, \S+ h", result.stdout)
    leg = load_mechanism("four_bar")
    assert life["fingerprint"] == fingerprint(leg)
    nominal, *others = read_lives(str(tmp_path / "out" / "life.json"), leg)
    assert nominal.factor.tolist() == [1.0, 1.0]
    # the others open the joints in other proportions
    assert len(others) == 2
    fractions = [life.clearance_m[-1] - life.clearance_m[0] for life in (nominal, *others)]
    assert len({round(fraction[0] / fraction[1], 2) for fraction in fractions}) == 3


def test_life_tells_regime_limits_and_the_makers_own_life(run, refused, shipped, tmp_path):
    """A pair with limits only is refused; with a coefficient beside it, the maker's life is printed, too."""
    pair = "material: skf-ptfe-composite-on-steel"
    text = shipped("four_bar")
    limited = text.replace("wear_coefficient: 1.0e-15", "material: du-on-steel-dry")
    (tmp_path / "limited.yaml").write_text(limited)
    assert "wear_coefficient: is missing for a life: du-on-steel-dry" in refused(
        "life", "--mechanism", "limited.yaml"
    )
    (tmp_path / "rule.yaml").write_text(text.replace("wear_coefficient: 1.0e-15", pair))
    rule = run("life", "--mechanism", "rule.yaml", *ONE[3:])
    assert rule.exit_code == 0
    assert "B has no modelled wear, because its material pair has no wear coefficient" in rule.stdout
    assert "nan" not in rule.stdout
    (rating,) = [one for one in rule.stdout.splitlines() if one.startswith("B: the maker's rating life is ")]
    (tmp_path / "beside.yaml").write_text(
        text.replace("wear_coefficient: 1.0e-15", f"{pair}\n    wear_coefficient: 1.0e-15")
    )
    result = run("life", "--mechanism", "beside.yaml", *ONE[3:], "--limit-m", "5.2e-4")
    assert result.exit_code == 0
    assert "B holds for a value beside skf-ptfe-composite-on-steel (dry)\n" in result.stdout
    assert result.stdout.count("maker's rating life") == 2
    assert rating in result.stdout  # the formula knows nothing of a coefficient


def test_life_under_a_duty_tells_hours_and_days(run):
    few = ("--clearances", "A,G", "--legs", "1", "--cycles", "2", "--limit-m", "3.1e-4")
    result = run("life", *few, "--duty", "0:2,600:6", "--json", "life.json")
    assert result.exit_code == 0
    found = json.loads(Path("life.json").read_text())["duty"]
    assert (found["peak_n"], found["hours_per_day"], found["limit_m"]) == ([0.0, 600.0], [2.0, 6.0], 3.1e-4)
    for name, end in found["end"].items():
        assert f"{name} reaches 310 µm after {end['cycles']:.3g} gait cycles" in result.stdout
        assert f"{end['hours']:.3g} h, {end['days']:.3g} days of 8 h" in result.stdout
        assert (end["hours"], end["days"]) == pytest.approx((end["cycles"] / 3600.0, end["cycles"] / 28800.0))
    assert found["end"]["leg"] == min((found["end"][joint] for joint in "AG"), key=lambda end: end["cycles"])


@pytest.mark.parametrize("points", [1, 2, 3, 11, 12, 40])
def test_the_table_of_a_life_has_its_first_and_its_last_point(points):
    """With fewer than 12 points, its end was missing: the worn leg."""
    column, nothing = np.linspace(3e-4, 6e-4, points)[:, None], np.zeros((points, 1))
    life = Life(
        clearance_joints=("A",), cycles=np.arange(points) + 1.0, clearance_m=column, clearance_max_m=column,
        worst_sector_deg=nothing, peak_force_n=nothing, growth_m_per_cycle=nothing,
        growth_error_m_per_cycle=nothing, error_m=np.zeros(points), depth=np.zeros((points, 1, 2, 4)),
        rubbing_j_per_cycle=nothing, period_s=1.0, duty=None, part_growth_m_per_cycle=nothing[:, None],
    )  # fmt: skip
    rows = [int(line.split()[0]) for line in life_lines(life, 1.0, {})[1:-2]]
    assert (rows[0], rows[-1], len(set(rows))) == (1, points, min(points, 12))


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
def test_a_life_that_would_not_end_is_refused_before_it_begins(run, monkeypatch, options, said):
    def never(*_arguments, **_keywords):
        raise AssertionError("the life has begun")

    monkeypatch.setattr(many_lives, "simulate_lives", never)
    result = run("life", "--mechanism", "four_bar", *options.split())
    (line,) = result.stderr.splitlines()
    assert (result.exit_code, result.stdout) == (2, "")
    assert line.startswith("error: --")
    assert said in line
