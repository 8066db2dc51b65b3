"""Many legs in one call: each as if it were alone, whatever the others and however many threads."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.run import DONE, INVALID_DRIVE, new_run_statistics, steady_drive
from leg_wear_monitor.dynamics.simulation import Leg, advance_batch, prepare, prepare_legs
from leg_wear_monitor.mechanism.position import TURN

SHORT = {"cycles": 0.2, "skip_cycles": 0.1}


def with_joint(leg, name, **changes):
    """The leg with other settings of one joint's clearance."""
    return attrs.evolve(
        leg, clearances={**leg.clearances, name: attrs.evolve(leg.clearances[name], **changes)}
    )


@pytest.fixture(scope="module")
def new_stepper(leg):
    setup = prepare(leg, clearances=("A", "G"))
    tables = build_tables(setup.linkage, setup.contacts)
    return lambda: ClearanceStepper(prepare(leg, clearances=("A", "G")), tables=tables)


@settings(max_examples=25)
@given(perturb_m=st.floats(0.0, 3.0e-4), seed=st.integers(0, 2**32), angle=st.floats(-10.0, 10.0))
def test_a_start_is_inside_the_clearance_and_repeats_itself(leg, new_stepper, perturb_m, seed, angle):
    stepper = new_stepper()
    one = Leg(mechanism=leg, perturb_m=perturb_m, seed=seed, crank_angle_rad=angle)
    one.start(stepper)
    e = stepper.state.e.reshape(-1, 2).copy()
    assert (np.linalg.norm(e, axis=1) <= perturb_m * (1.0 + 1.0e-12) + 1.0e-14).all()  # m: moved starts
    np.testing.assert_array_equal(stepper.state.drive, [angle, TURN, 0.0])
    assert not stepper.state.v.any()
    one.start(stepper)
    np.testing.assert_array_equal(stepper.state.e.reshape(-1, 2), e)


def test_starts_fill_the_disc_evenly(leg, new_stepper):
    """Half of them inside 1 / sqrt 2 of its radius, a quarter in each quadrant."""
    stepper, starts = new_stepper(), []
    for seed in range(1000):
        Leg(mechanism=leg, perturb_m=2.0e-4, seed=seed).start(stepper)
        starts.append(stepper.state.e.reshape(-1, 2).copy())
    e = np.concatenate(starts)
    assert (np.linalg.norm(e, axis=1) < 2.0e-4 / np.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.06)
    assert ((e[:, 0] > 0.0) & (e[:, 1] > 0.0)).mean() == pytest.approx(0.25, abs=0.05)


def test_legs_that_differ_in_their_material_alone_keep_it(leg):
    """The text of a mechanism, by which legs are prepared once, leaves it out."""
    pairs = ("ds-on-steel-greased", "graphite-bronze-oil-on-steel")
    setups = prepare_legs([Leg(mechanism=with_joint(leg, "A", material=pair)) for pair in pairs])
    assert [setup.linkage.mechanism.clearances["A"].material for setup in setups] == list(pairs)


def test_advancing_a_batch_is_advancing_each(new_stepper):
    """Each to its own time; a drive that makes no sense stops its own leg only."""
    alone, together = ([new_stepper() for _ in range(3)] for _ in range(2))
    polynomials = [steady_drive(0.0, TURN), steady_drive(0.0, np.nan), steady_drive(1.0, -TURN)]
    times = [0.1, 0.2, 0.3]
    for steppers in (alone, together):
        steppers[2].init(1.0, -TURN)
    statistics_of_all, statistics_alone = ([new_run_statistics(10) for _ in range(3)] for _ in range(2))
    statuses = [
        stepper.advance(*job)
        for stepper, *job in zip(alone, polynomials, times, statistics_alone, strict=True)
    ]
    assert advance_batch(together, polynomials, times, statistics_of_all, workers=3) == statuses
    assert [status for status, _ in statuses] == [DONE, INVALID_DRIVE, DONE]
    for one, other, statistics, wanted in zip(
        alone, together, statistics_of_all, statistics_alone, strict=True
    ):
        np.testing.assert_array_equal(one.state.motion, other.state.motion)
        np.testing.assert_array_equal(one.state.depth, other.state.depth)
        np.testing.assert_array_equal(statistics.integral, wanted.integral)


@pytest.mark.parametrize("shared", ["tally", "stepper", "setup", "length"])
def test_what_two_threads_would_write_is_refused(leg, new_stepper, shared):
    steppers, statistics_of_all = (
        [new_stepper(), new_stepper()],
        [new_run_statistics(10), new_run_statistics(10)],
    )
    if shared == "tally":
        statistics_of_all[1] = statistics_of_all[0]
    elif shared == "stepper":
        steppers[1] = steppers[0]
    elif shared == "setup":
        setup = prepare(leg, clearances=("G",))
        steppers = [ClearanceStepper(setup), ClearanceStepper(setup)]
    else:
        statistics_of_all.append(new_run_statistics(10))
    with pytest.raises(ValueError, match=r"share|zip|shorter|longer"):
        advance_batch(steppers, [steady_drive(0.0, TURN)] * 2, 0.1, statistics_of_all)
