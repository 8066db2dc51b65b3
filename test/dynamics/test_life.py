"""A life by cycle jumps: what it keeps, what it repeats, and that it meets the wear it jumps over."""

from itertools import pairwise

import numpy as np
import pytest

from leg_wear_monitor import ConfigError
from leg_wear_monitor.dynamics.batch_leg import Leg
from leg_wear_monitor.dynamics.clearance_run import ClearanceStepper
from leg_wear_monitor.dynamics.drive import steady_drive
from leg_wear_monitor.dynamics.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.dynamics.run import DONE
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.wear.cycle_jump import JumpControl
from leg_wear_monitor.wear.surfaces import Surfaces, worn_volume

SHORT = LifeSettings(legs=2, cycles=3, settle_cycles=1)


@pytest.fixture(scope="module")
def lived(leg):
    """Two joints' life to where the first has opened by a fifth."""
    run = LifeRun(leg, SHORT, clearances=("A", "B"))
    return run, simulate_life(run, limit_m=3.6e-4, horizon_cycles=1e9)


def test_volume_worn_is_coefficient_times_archard_integral(leg, lived):
    run, _ = lived
    setup, last = prepare(leg, clearances=("A", "B"), wear=True), run.points[-1]
    volume = worn_volume(setup.contacts, Surfaces(last.depth, 1))
    expected = setup.contacts.wear_coefficient * last.archard_j[:, None]
    # what is pending when a cycle is counted is worn off in the next one
    np.testing.assert_allclose(volume, expected, rtol=2e-3)


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


def test_all_coefficients_larger_by_a_factor_make_the_same_life_faster(leg):
    """Wear enters by coefficient times cycles; what is left is the scatter of the cycles simulated."""
    lives = []
    for factor in (1.0, 4.0):
        run = LifeRun(leg, SHORT, clearances=("B",), wear_factor=factor)
        lives.append([run.jump() for _ in range(2)][-1])
    slow, fast = lives
    assert 4.0 * fast.cycles / slow.cycles == pytest.approx(fast.opened_m[0] / slow.opened_m[0], rel=0.1)


def test_a_life_goes_on_from_where_another_stopped(leg, lived):
    run, _ = lived
    later = LifeRun(leg, SHORT, clearances=("A", "B"), depth=run.points[-1].depth)
    np.testing.assert_array_equal(later.points[0].opened_m, run.points[-1].opened_m)
    assert (later.jump().opened_m > run.points[-1].opened_m).all()


def test_jumps_meet_every_single_cycle(leg):
    """Within the scatter of a few hundred cycles; benchmarks/life.py has the long comparison."""
    cycles, factor = 150, 3000.0
    setup = prepare(leg, clearances=("A", "B"), wear=True)
    setup.contacts.wear_coefficient[:] *= factor
    stepper = ClearanceStepper(setup)
    start = Leg(mechanism=leg, clearances=("A", "B"), crank_angle_rad=1.0)
    start.start(stepper)
    for cycle in range(1, cycles + 1):
        status = stepper.advance(steady_drive(1.0, setup.speed), float(cycle), new_tally(len(leg.joints)))
        assert status[0] == DONE
    every = setup.surfaces.depth.mean(axis=2).sum(axis=1)
    settings = LifeSettings(legs=2, cycles=5, jump=JumpControl(opens_m=2e-5))
    run = LifeRun(leg, settings, clearances=("A", "B"), wear_factor=factor)
    simulate_life(run, limit_m=1.0, horizon_cycles=float(cycles))
    assert run.points[-1].cycles == pytest.approx(cycles)
    np.testing.assert_allclose(run.points[-1].opened_m, every, rtol=0.12)


def test_a_leg_without_loose_joints_has_no_life(leg):
    with pytest.raises(ConfigError, match="no joint is loose"):
        LifeRun(leg, clearances=())
