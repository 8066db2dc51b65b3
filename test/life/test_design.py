"""Bushings by design: laws of the table, and its lives compared with whole lives."""

import math

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw

DUTY = lw.Duty({0.0: 8.0})
FRESH_M = 3.0e-4
LIMIT_M = 4.0e-4


@pytest.fixture(scope="module")
def leg():
    return lw.load_mechanism("four_bar")


@pytest.fixture(scope="module")
def table(leg):
    """Pairs of three kinds in two sizes: with a coefficient, with a maker's formula, with limits only."""
    names = ("pai-on-steel-dry", "skf-ptfe-composite-on-steel", "brass-on-steel-dry", "iglidur-j-on-steel")
    return lw.design(
        leg, DUTY, limit_m=LIMIT_M, pairs=names, diameters_m=(0.01, 0.02), widths_m=(1.0e-4, 0.01, 0.02),
        clearances_m=(FRESH_M, 2.0e-4), hours=10.0,
    )  # fmt: skip


def rows(table, **wanted):
    return [row for row in table if all(getattr(row, name) == value for name, value in wanted.items())]


def test_a_life_is_the_volume_to_wear_off_over_the_wear_per_hour(leg, table):
    """The width doubles a life; a diameter changes pressures only; a smaller clearance lasts longer."""
    of = {"joint": "B", "material": "pai-on-steel-dry"}
    (one,) = rows(table, **of, diameter_m=0.02, width_m=0.01, clearance_m=FRESH_M)
    (wide,) = rows(table, **of, diameter_m=0.02, width_m=0.02, clearance_m=FRESH_M)
    (thin,) = rows(table, **of, diameter_m=0.01, width_m=0.01, clearance_m=FRESH_M)
    (tight,) = rows(table, **of, diameter_m=0.02, width_m=0.01, clearance_m=2.0e-4)
    assert wide.wear_h == pytest.approx(np.multiply(2.0, one.wear_h))
    assert thin.wear_h == pytest.approx(one.wear_h)
    assert thin.load.p99_pressure_pa == pytest.approx(2.0 * one.load.p99_pressure_pa)
    assert thin.load.mean_pressure_speed_pa_mps == pytest.approx(one.load.mean_pressure_speed_pa_mps)
    assert tight.wear_h[1] > one.wear_h[1]
    p10, p50, p90 = one.wear_h
    assert p10 < p50 and p10 * p90 == pytest.approx(p50**2)
    # by hand, from the power that rubs: p v times the projected area
    pair = lw.load_material("pai-on-steel-dry")
    rubbing_w = one.load.mean_pressure_speed_pa_mps * 0.02 * 0.01
    volume = math.pi * 0.02 * 0.01 * (LIMIT_M - FRESH_M)
    hours = volume / (sum(pair.wear_coefficients) * rubbing_w) / 3600.0
    assert p50 == pytest.approx(hours, rel=0.2)  # the power grows with the clearance


def test_each_row_says_what_limits_its_life(table):
    kinds = {
        "pai-on-steel-dry": {"wear"},
        "skf-ptfe-composite-on-steel": {"rating life"},
        "brass-on-steel-dry": {"unknown"},
    }
    for material, expected in kinds.items():
        found = [row for row in rows(table, material=material) if row.width_m > 1.0e-3]
        assert {row.limited_by for row in found} == expected
    (narrow,) = rows(
        table, joint="B", material="iglidur-j-on-steel", diameter_m=0.01, width_m=1.0e-4, clearance_m=FRESH_M
    )
    excess = narrow.load.excesses
    assert excess and narrow.limited_by in [each.name for each in excess]
    assert not any(row.lasts for row in table if row.limited_by not in ("wear", "rating life", "nothing"))


def test_the_present_bushing_comes_first_then_the_smallest_that_lasts(leg, table):
    for joint in leg.clearance_joints:
        now, *others = rows(table, joint=joint)
        assert now.is_present and not any(row.is_present for row in others)
        assert now.diameter_m == 2.0 * leg.clearances[joint].bushing_radius
        lasting = [row.lasts for row in others]
        assert lasting == sorted(lasting, reverse=True)
        sizes = [row.diameter_m * row.width_m for row in others if row.lasts]
        assert sizes == sorted(sizes)


def test_a_tried_pair_does_not_inherit_a_wear_coefficient(leg):
    """A coefficient beside the present pair belongs to this pair."""
    beside = {
        name: attrs.evolve(own, wear_coefficient=(1e-12, 1e-12)) for name, own in leg.clearances.items()
    }
    changed = attrs.evolve(leg, clearances=beside)
    tried = {"pairs": ("pai-on-steel-dry",), "diameters_m": (0.01,), "widths_m": (0.01,)}
    before, after = (
        lw.design(each, DUTY, limit_m=LIMIT_M, clearances_m=(FRESH_M,), **tried) for each in (leg, changed)
    )
    assert [row.wear_h for row in rows(after, is_present=False)] == [
        row.wear_h for row in rows(before, is_present=False)
    ]


@pytest.mark.chaotic
@pytest.mark.parametrize("starts, joints", [(1, "B"), pytest.param(4, "BC", marks=pytest.mark.slow)])
def test_lives_are_those_of_a_whole_life(leg, starts, joints):
    """The table supposes that all joints open alike and wear evenly; a whole life does not."""
    found = lw.design(leg, DUTY, limit_m=LIMIT_M, pairs=(), clearances_m=(FRESH_M,))
    settings = [lw.LifeSettings(cycles=8, seed=seed) for seed in range(starts)]
    runs = [lw.LifeRun(leg, one, duty=DUTY) for one in settings]
    lives = [lw.simulate_life(run, limit_m=LIMIT_M, horizon_cycles=1e12).end(LIMIT_M) for run in runs]
    for row in (each for each in found if each.joint in joints):
        whole = np.mean([life[row.joint]["hours"] for life in lives])
        assert row.wear_h[1] == pytest.approx(whole, rel=0.2)


@pytest.mark.plain
@pytest.mark.parametrize(
    ("limit_m", "fault"),
    [
        (2.0e-4, r"limit-m: 0\.0002 m is not between 0\.0002 m, the largest clearance when new, and 0\.004"),
        (5.0e-3, r"limit-m: 0\.005 m is not between .* and 0\.004 m, the smallest radius of a bushing"),
    ],
)
def test_a_limit_must_be_between_the_clearances_when_new_and_the_radii(leg, limit_m, fault):
    with pytest.raises(lw.ConfigError, match=fault):
        lw.design(leg, DUTY, limit_m=limit_m)
