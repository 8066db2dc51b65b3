"""Many legs in one call: each as if it were alone, whatever the others and however many threads."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor import AssemblyError, ConfigError, SimulationError, load_mechanism, simulate
from leg_wear_monitor.dynamics.batch import Leg, advance_batch, prepare_legs, simulate_batch
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import build_basis, build_tables
from leg_wear_monitor.dynamics.run import DONE, INVALID_DRIVE, new_run_statistics, steady_drive
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN

SHORT = {"cycles": 0.2, "skip_cycles": 0.1}


def with_joint(leg, name, **changes):
    """The leg with other settings of one joint's clearance."""
    return attrs.evolve(
        leg, clearances={**leg.clearances, name: attrs.evolve(leg.clearances[name], **changes)}
    )


@pytest.fixture(scope="module")
def various(leg):
    """Legs that differ in what a study varies."""
    return [
        Leg(mechanism=leg),
        Leg(mechanism=leg, speed_rpm=-90.0, wear=True),
        Leg(mechanism=leg, clearances=("G",), clearance_m=2.0e-4),
        Leg(mechanism=with_joint(leg, "A", restitution=0.75, wear_coefficient=(1.0e-14, 0.0))),
        Leg(mechanism=leg, crank_angle_rad=2.0, perturb_m=1.0e-4, seed=5),
        Leg(mechanism=leg, clearances=()),
        Leg(mechanism=load_mechanism("jansen_leg"), normal_law="flores"),
    ]


def figures(results):
    """All that results say, to be compared."""
    return [
        (result.to_dict(), None if result.surfaces is None else result.surfaces.depth.tolist())
        for result in results
    ]


@pytest.fixture(scope="module")
def by_one_worker(various):
    return figures(simulate_batch(various, workers=1, **SHORT))


@pytest.mark.parametrize("workers", [pytest.param(2, marks=pytest.mark.slow), 5])
def test_results_do_not_depend_on_the_number_of_workers(various, by_one_worker, workers):
    """Bit for bit."""
    assert figures(simulate_batch(various, workers=workers, **SHORT)) == by_one_worker


def test_results_do_not_depend_on_the_others(various, by_one_worker):
    """Nor on the order, with as many workers as there are processors."""
    backwards = figures(simulate_batch(various[::-1], **SHORT))
    assert backwards[::-1] == by_one_worker
    assert figures(simulate_batch(various[3:4], **SHORT)) == by_one_worker[3:4]


def test_a_leg_of_a_batch_is_the_leg_of_simulate(leg):
    """But for what a batch does not keep."""
    alone = simulate(leg, speed_rpm=80.0, cycles=1.5, skip_cycles=0.5, wear=True).to_dict()
    (result,) = simulate_batch([Leg(mechanism=leg, speed_rpm=80.0, wear=True)], cycles=1.5, skip_cycles=0.5)
    for key in ("drive_torque_nm", "toe", "joints", "mechanism", "model"):
        assert result.to_dict()[key] == alone[key]
    for key in ("cycles", "simulated_s", "speed_rpm"):
        assert result.to_dict()[key] == pytest.approx(alone[key])


def test_the_error_of_a_leg_stands_in_its_place(leg, document, various, by_one_worker):
    """One whose journal is pushed through, and one that cannot turn; the others as without them."""
    weak = with_joint(leg, "G", stiffness=1.0e3)
    four_bar = load_mechanism("four_bar")
    crank = attrs.evolve(
        four_bar.bodies["crank"], points={**four_bar.bodies["crank"].points, "B": (0.3, 0.0)}
    )
    stuck = attrs.evolve(four_bar, bodies={**four_bar.bodies, "crank": crank})
    legs = [Leg(mechanism=weak, clearances=("A", "G")), various[0], Leg(mechanism=stuck), various[1]]
    pushed, first, jammed, second = simulate_batch(legs, cycles=0.2, skip_cycles=0.1)
    assert isinstance(pushed, SimulationError)
    assert str(pushed).startswith("bionic_leg.yaml: joint G at t = 0.")
    assert isinstance(jammed, AssemblyError)
    assert figures([first, second]) == by_one_worker[:2]


@pytest.mark.parametrize(
    ("options", "how", "fault"),
    [
        ({"perturb_m": 4.0e-4}, {}, "perturb_m: 0.0004 m is not from 0 to the smallest clearance, 0.0003 m"),
        ({"perturb_m": float("nan")}, {}, "perturb_m: nan m"),
        ({"clearances": ("X",)}, {}, "'X'"),
        ({}, {"cycles": 0.0}, "cycles: 0 is not above 0"),
        ({}, {"skip_cycles": -1.0}, "skip-cycles: -1 is below 0"),
    ],
)
def test_what_cannot_be_stops_the_batch_before_it_starts(leg, options, how, fault):
    with pytest.raises(ConfigError, match=fault):
        simulate_batch([Leg(mechanism=leg, **options)], **how)


def test_a_leg_that_a_torque_drives_is_refused():
    with pytest.raises(ConfigError, match=r"andrews\.yaml: drive\.torque"):
        simulate_batch(
            [Leg(mechanism=load_mechanism("slider_crank")), Leg(mechanism=load_mechanism("andrews"))]
        )


@pytest.mark.parametrize("name, joints", [("bionic_leg", ("A", "G")), ("jansen_leg", None)])
def test_tables_of_a_shared_basis_are_those_of_the_leg_alone(name, joints):
    """Bit for bit: the radii change the friction's levers, which are not in the basis of other legs."""
    first, other = (
        prepare(load_mechanism(name), clearances=joints, clearance_m=clearance) for clearance in (None, 1e-4)
    )
    basis = build_basis(first.linkage, first.contacts)
    shared = build_tables(other.linkage, other.contacts, basis=basis)
    alone, former = (build_tables(setup.linkage, setup.contacts) for setup in (other, first))
    assert all(map(np.array_equal, shared, alone))
    assert all(
        map(np.array_equal, build_tables(other.linkage, other.contacts, basis=basis, like=former), alone)
    )
    assert not all(map(np.array_equal, shared, former))


def test_progress_is_the_share_of_the_legs_that_are_done(leg):
    fractions = []
    legs = [Leg(mechanism=leg, clearances=("G",), seed=i) for i in range(4)]
    simulate_batch(legs, cycles=0.01, skip_cycles=0.0, progress=fractions.append)
    assert fractions == [0.25, 0.5, 0.75, 1.0]


def test_an_interrupt_ends_the_whole_batch(leg):
    """A hundred thousand cycles would take a quarter of an hour: those that run stop at their next one."""

    def interrupt(fraction):
        raise KeyboardInterrupt

    short = Leg(mechanism=leg, clearances=())
    long = [Leg(mechanism=leg, clearances=("G",), seed=i) for i in range(3)]
    with pytest.raises(KeyboardInterrupt):
        simulate_batch([short, *long], cycles=1.0e5, progress=interrupt)


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


@pytest.mark.chaotic
def test_other_seeds_are_other_motions_of_the_same_leg(leg):
    legs = [Leg(mechanism=leg, perturb_m=1.0e-6, seed=i) for i in range(4)]
    forces = [result.joints["A"].mean_force_n for result in simulate_batch(legs, cycles=3)]
    assert len(set(forces)) == 4
    assert np.ptp(forces) < 0.03 * np.mean(forces)


@pytest.mark.chaotic
def test_the_starting_phase_is_forgotten(leg):
    """Means of five cycles from four crank angles; their sigmas are 0.15 % and less (32 runs, 2026-11-23)."""
    legs = [Leg(mechanism=leg, crank_angle_rad=angle, perturb_m=1.0e-4) for angle in (0.0, 1.5, 3.0, 4.5)]
    forces = np.array([
        [result.joints[name].mean_force_n for name in "ABG"] for result in simulate_batch(legs, cycles=5)
    ])  # fmt: skip
    np.testing.assert_allclose(forces, np.tile(forces.mean(axis=0), (4, 1)), rtol=0.03)


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
