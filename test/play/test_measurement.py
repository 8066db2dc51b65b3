"""Play of synthetic rocks: how often it is right, and what is refused."""

import json

import numpy as np
import pytest
from play.coverage import coverage
from play.rocks import rocks

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.play.fit import PlayMeasurement
from leg_wear_monitor.play.measurement import measure_play

pytestmark = pytest.mark.plain


@pytest.mark.parametrize("seeds", [100, pytest.param(300, marks=pytest.mark.slow)])
@pytest.mark.parametrize("with_load", [True, False], ids=["load", "no load"])
def test_the_error_is_below_one_count_or_the_stated_sigma(with_load: bool, seeds: int) -> None:
    found = coverage(range(seeds), with_load=with_load)
    print(found)
    assert found.within >= 0.95 * found.measured
    assert found.within_sigma >= 0.68 * found.measured
    assert found.within_two_sigma >= 0.95 * found.measured
    # without a load, small plays in large noise are refused
    assert found.refused <= (0.0 if with_load else 0.2) * seeds


def measured(one, **given):
    return measure_play(one.time_s, one.angle_rad, one.load, **given)


def test_the_count_is_found_in_the_values() -> None:
    one = rocks(3, noise=1.0)
    assert measured(one).count_rad == pytest.approx(one.count_rad, rel=1e-6)
    decimals = np.round(one.angle_rad, 6)
    found = measure_play(one.time_s, decimals, one.load)
    assert found.count_rad == pytest.approx(one.count_rad, rel=0.01)


def test_the_direction_of_the_load_has_no_effect() -> None:
    one = rocks(4)
    other = measure_play(one.time_s, one.angle_rad, -7.0 * one.load + 3.0, count_rad=one.count_rad)
    same = measured(one, count_rad=one.count_rad)
    assert other.play_rad == pytest.approx(same.play_rad, rel=1e-12)


def test_a_drift_is_removed_and_named() -> None:
    one = rocks(5, drift=30.0, counts=20.0, noise=0.5, stuck=0.0)
    found = measured(one)
    assert abs(found.play_rad - one.play_rad) < one.count_rad
    assert found.drift_rad > 10.0 * one.count_rad
    assert any("drift" in note for note in found.notes)


def test_stiction_that_spoils_the_play_is_named() -> None:
    one = rocks(6, stuck=0.6, counts=50.0, pushes=40, noise=0.0)
    assert any("stiction" in finding for finding in measured(one).findings)


def test_json_has_every_field() -> None:
    found = measured(rocks(7))
    plain = json.loads(PlayMeasurement(plays=(found,)).to_json())
    assert plain["schema_version"] == 1
    assert plain["is_sure"] is True
    assert plain["plays"][0]["play_rad"] == found.play_rad
    assert plain["plays"][0]["plateaus"] == list(found.plateaus)


def refusal(*arguments, **given) -> str:
    with pytest.raises(LegWearError) as caught:
        measure_play(*arguments, **given)
    (line,) = str(caught.value).splitlines()
    return line


def test_what_cannot_be_measured_is_refused_in_one_line() -> None:
    one = rocks(8, noise=0.5, stuck=0.0, counts=20.0)
    n = len(one.time_s)
    assert "load: does not reverse" in refusal(one.time_s, one.angle_rad, np.ones(n))
    assert "arrays of different lengths" in refusal(one.time_s, one.angle_rad, one.load[1:])
    few = slice(0, n // 6)
    assert "more often" in refusal(one.time_s[few], one.angle_rad[few], one.load[few])
    assert "angle: is constant" in refusal(one.time_s, np.zeros(n), one.load)
    assert "angle: has no value" in refusal(one.time_s, np.full(n, np.nan), one.load)
    assert "ascending" in refusal(one.time_s[::-1], one.angle_rad, one.load)
    two = np.where(one.load > 0.0, 0.01, 0.0)
    assert "give it" in refusal(one.time_s, two, one.load)


def test_an_encoder_that_is_too_coarse_says_so() -> None:
    one = rocks(9, bits=12, counts=0.3, noise=0.4, pushes=30, stuck=0.0, drift=0.0)
    line = refusal(one.time_s, one.angle_rad, one.load, count_rad=one.count_rad)
    assert "less than one count" in line
    assert "12 bits" in line


def test_overlapping_clusters_need_a_load_signal() -> None:
    one = rocks(10, counts=4.0, noise=1.0, pushes=30, stuck=0.0, drift=0.0)
    assert measured(one).play_rad == pytest.approx(one.play_rad, abs=one.count_rad)
    refusal(one.time_s, one.angle_rad, count_rad=one.count_rad)


def test_a_moving_leg_is_no_rock() -> None:
    time_s = np.arange(0.0, 60.0, 0.01)
    count = 2.0 * np.pi / 2**14
    swing = count * np.rint(0.5 * np.sin(2.0 * time_s) / count)
    assert "still moves" in refusal(time_s, swing)
