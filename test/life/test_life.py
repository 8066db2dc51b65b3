"""A life by cycle jumps: what it keeps, what it repeats, and when it ends."""

import math
from itertools import pairwise

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw

SHORT = lw.LifeSettings(legs=2, cycles=3, settle_cycles=1)


def test_a_jump_repeats_the_mean_wear_of_a_cycle_at_its_ends(lived):
    for here, there in pairwise(lived[0].points):
        rate = 0.5 * (here.rate.depth + there.rate.depth)
        grown = there.depth - here.depth
        np.testing.assert_allclose(grown, (there.cycles - here.cycles) * rate, rtol=1e-9, atol=1e-15)


def test_clearances_only_grow_and_the_life_ends_at_the_first_limit(lived):
    _, life = lived
    assert (np.diff(life.clearance_m, axis=0) >= 0.0).all()
    assert (np.diff(life.cycles) > 0.0).all()
    assert (life.clearance_m[:-1] < 3.6e-4).all()
    assert life.clearance_m[-1].max() >= 3.6e-4
    assert (life.clearance_max_m >= life.clearance_m).all()


def test_cycles_to_a_clearance_are_read_off_the_life_and_beyond_it_at_its_last_rate(lived):
    _, life = lived
    k = int(life.clearance_m[-1].argmax())
    assert life.cycles_to(k, life.clearance_m[0, k]) == 0.0
    assert life.cycles_to(k, life.clearance_m[-1, k]) == pytest.approx(life.cycles[-1])
    beyond = life.cycles_to(k, life.clearance_m[-1, k] + 1e-6) - life.cycles[-1]
    assert beyond == pytest.approx(1e-6 / life.growth_m_per_cycle[-1, k])


@pytest.mark.chaotic
def test_all_coefficients_larger_by_a_factor_make_the_same_life_faster(leg):
    """Wear enters by coefficient times cycles; what is left is the scatter of the cycles simulated.

    Off by -0.004, sigma 0.012 (30 starts moved by 1e-12, 2026-11-23).
    """
    lives = []
    for factor in (1.0, 4.0):
        run = lw.LifeRun(leg, SHORT, clearances=("B",), wear_factor=factor)
        lives.append([run.jump() for _ in range(2)][-1])
    slow, fast = lives
    assert 4.0 * fast.cycles / slow.cycles == pytest.approx(fast.opened_m[0] / slow.opened_m[0], rel=0.1)


def test_a_life_goes_on_from_where_another_stopped(leg, lived):
    run, _ = lived
    later = lw.LifeRun(leg, SHORT, clearances=("A", "B"), depth=run.points[-1].depth)
    np.testing.assert_array_equal(later.points[0].opened_m, run.points[-1].opened_m)
    assert (later.jump().opened_m > run.points[-1].opened_m).all()


@pytest.mark.parametrize(
    ("limit_m", "meant"),
    [
        (3.0e-4, None),
        (2.0e-4, None),
        (0.0, None),
        (-6.0e-4, None),
        (math.nan, None),
        (math.inf, None),
        (1.0e-2, None),
        (0.6, "did you mean 0.0006 m (0.6 mm)?"),
        (600.0, "did you mean 0.0006 m (0.6 mm)?"),
        (6.0e-7, "did you mean 0.0006 m (0.6 mm)?"),
    ],
)
def test_a_limit_lies_between_the_new_clearance_and_the_bushing(lived, limit_m, meant):
    """Nothing else ends a life: below, the limit is behind from the start; above, no clearance gets there."""
    with pytest.raises(
        lw.ConfigError, match=r"^limit-m: .* is not between 0.0003 m, the new clearance"
    ) as info:
        lw.simulate_life(lived[0], limit_m=limit_m, horizon_cycles=1e9)
    assert "0.01 m, the radius of its bushing" in str(info.value)
    assert str(info.value).endswith(meant or "bushing")


def test_every_joint_has_a_limit_of_its_own(lived):
    with pytest.raises(lw.ConfigError, match=r"0.0002 m is not between .* joint B"):
        lw.simulate_life(lived[0], limit_m=[3.6e-4, 2.0e-4], horizon_cycles=1e9)


def test_jumps_too_short_to_reach_the_limit_are_refused(leg):
    run = lw.LifeRun(leg, attrs.evolve(SHORT, max_wear_per_jump_m=1e-12), clearances=("A",))
    with pytest.raises(lw.ConfigError, match=r"^max-wear-per-jump-m: 1e-12 m per jump takes 3e\+08 jumps"):
        lw.simulate_life(run, limit_m=6e-4, horizon_cycles=1e9)


def test_a_leg_without_loose_joints_has_no_life(leg):
    with pytest.raises(lw.ConfigError, match="no joint has clearance"):
        lw.LifeRun(leg, clearances=())
