"""Lives that spread: in each the first joint goes all the way, and their ends fill the room of clearances."""

import json
from itertools import islice

import numpy as np
import pytest

from leg_wear_monitor.life.life import LEAST_FRACTION, LifeRun, LifeSettings, spread_factors


@pytest.fixture(scope="module")
def begun(leg):
    """Two joints' life by one jump."""
    run = LifeRun(leg, LifeSettings(legs=1, cycles=3), clearances=("A", "J"))
    run.jump()
    return run


def test_factors_make_up_for_what_joints_grow(begun):
    opened = begun.points[-1].opened_m
    factors = np.array(list(islice(spread_factors(begun.life), 200)))
    ends = factors * opened / opened.max()
    np.testing.assert_allclose(ends.max(axis=1), 1.0)
    assert ends.min() >= LEAST_FRACTION
    # each joint is the first as often as the other, and the other's shares are spread evenly
    assert 0.45 < (ends[:, 0] == 1.0).mean() < 0.55
    others = np.sort(ends.min(axis=1))
    assert np.abs(others - np.linspace(LEAST_FRACTION, 1.0, 200)).max() < 0.05


def test_a_life_as_a_table_is_its_json_row_by_row(begun):
    life = begun.life
    columns, record = life.columns(), life.to_dict()
    assert json.loads(life.to_json()) == record
    assert columns["joint"] == ["A", "A", "J", "J"]
    assert columns["cycles"] == record["cycles"] * 2
    assert record["joints"]["J"]["worst_sector_deg"][0] is None  # nothing is worn yet
    for name, values in record["joints"]["J"].items():
        np.testing.assert_array_equal(columns[name][2:], np.array(values, dtype=float))


def test_a_joint_that_is_held_wears_no_further_and_the_other_goes_on(begun):
    was = begun.points[-1].opened_m
    begun.hold(0)
    now = begun.jump().opened_m
    assert now[0] == was[0]
    assert now[1] > was[1]
    assert begun.life.growth_m_per_cycle[-1, 0] == 0.0
