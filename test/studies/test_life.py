"""Wear over a life: clearances open as the wear of a cycle says, and are read off at equal openings."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.life.jumps import JumpControl
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.studies.life_tasks import STATES, between, wear_life
from leg_wear_monitor.wear import BUSHING

SETTINGS = {
    "clearance_joints": ["I", "J"], "clearance_m": 3.0e-4, "speed_rpm": 60.0, "perturb_fraction": 0.3,
    "seed": 1,
    "opens_m": 1.0e-5, "jump_m": 1.0e-5, "cycles": 2, "runs": 2,
}  # fmt: skip


@pytest.fixture(scope="module")
def lives():
    return wear_life(load_mechanism(), SETTINGS)


def test_the_fastest_joint_opens_by_equal_steps_to_the_end_that_was_asked_for(lives):
    opened = lives["clearance_mean_m"].max(axis=2) - 3.0e-4
    expected = np.broadcast_to(np.linspace(0.0, 1.0e-5, STATES), (2, STATES))
    assert opened == pytest.approx(expected, rel=1.0e-3, abs=1.0e-10)
    assert (lives["clearance_max_m"] >= lives["clearance_mean_m"]).all()
    assert (np.diff(lives["cycles"], axis=1) > 0.0).all()
    assert (lives["cycles"][:, 0] == 0.0).all()


def test_what_has_worn_is_the_wear_of_a_cycle_repeated(lives):
    """Of every joint and surface; rates hardly change over so short a life, but for their scatter."""
    rate, depth = (lives[name].mean(axis=4) for name in ("rate_m_per_cycle", "depth_m"))
    worn = rate.mean(axis=1) * lives["cycles"][:, -1, None, None]
    assert depth[:, 1] == pytest.approx(worn, rel=0.2)
    assert (depth[:, 1] > depth[:, 0]).all()
    assert (lives["depth_m"][:, 1] >= lives["depth_m"][:, 0]).all()
    assert lives["depth_m"][..., BUSHING, :].max() > 5.0e-6


def test_runs_are_lives_that_differ_in_where_they_start(lives):
    """The first is the one that anybody simulates with its settings."""
    control = JumpControl(opens_m=1.0e-5, tolerance_m=1.0e-6)
    settings = LifeSettings(legs=1, cycles=2, perturb_fraction=0.3, jump=control, seed=1)
    run = LifeRun(load_mechanism(), settings, clearances=("I", "J"), clearance_m=3.0e-4, speed_rpm=60.0)
    life = simulate_life(run, limit_m=3.1e-4, horizon_cycles=1.0e12)
    ends = [life.cycles_to(k, 3.1e-4) for k in range(2)]
    assert lives["cycles"][0, -1] == pytest.approx(min(ends))
    assert lives["cycles"][1, -1] != lives["cycles"][0, -1]
    assert lives["toe_position_m"][0, 0] == run.points[0].toe_position_m
    assert lives["peak_force_n"][0, 0].tolist() == run.points[0].peak_force_n.tolist()


def test_joints_that_do_not_wear_have_no_life():
    leg = load_mechanism()
    clearances = {
        name: attrs.evolve(own, wear_coefficient=(0.0, 0.0)) for name, own in leg.clearances.items()
    }
    with pytest.raises(SimulationError, match="none of I, J wears"):
        wear_life(attrs.evolve(leg, clearances=clearances), SETTINGS)


@pytest.mark.plain
@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=9))
def test_values_between_two_states_lie_on_a_line(at):
    cycles, at = np.array([0.0, 1.0, 2.5, 3.0]), np.array(at)
    values = np.stack([2.0 * cycles + 1.0, np.square(cycles)], axis=1)
    found = between(cycles, values, at)
    assert found[:, 0] == pytest.approx(2.0 * at + 1.0)
    assert found[:, 1] == pytest.approx(np.interp(at, cycles, values[:, 1]))
