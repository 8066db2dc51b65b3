"""Films of oil or grease in clearance coordinates: tables, linear system, energy, both limits."""

import attrs
import numpy as np
import pytest
from counted_run import counted
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor import Mechanism
from leg_wear_monitor.compiled.vectors import padded
from leg_wear_monitor.dynamics.clearance.basis import COARSER
from leg_wear_monitor.dynamics.clearance.contact import (
    CAM,
    DAMPING,
    FILM_X,
    FILM_Y,
    MOMENT_B,
    MOMENT_J,
    NX,
    NY,
    SAMPLE_ROWS,
    STIFFNESS,
    VECTORS,
)
from leg_wear_monitor.dynamics.clearance.film_system import (
    GAMMA,
    contact_system,
    factorise_contacts,
    factorise_films,
    solve_contacts,
    solve_films,
)
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun, ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.joint import DELTA, EX, EY, F_N
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FRICTION,
    new_run_statistics,
    steady_drive,
)
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.statistics import energy_balance
from leg_wear_monitor.mechanism.position import TURN, one_cycle
from leg_wear_monitor.mechanism.spec import Film

FIVE = tuple("ABGIJ")
POINTS = 256


def greased(mechanism: Mechanism, viscosity: float, joints=FIVE) -> Mechanism:
    film = Film(viscosity_pa_s=viscosity, roughness_m=1.6e-6)
    own = {n: attrs.evolve(c, film=film) if n in joints else c for n, c in mechanism.clearances.items()}
    return attrs.evolve(mechanism, clearances=own)


def walked(mechanism, begin, end, wear=False):
    """A run from 0, its statistics and its energy balance from a time to another [s]."""
    run = ClearanceRun(prepare(mechanism, clearances=FIVE, wear=wear))
    return run, *counted(run, begin, end)


def rows_of(run):
    return run.stepper.model.contacts.joint


# --- tables ---


@pytest.mark.plain
def test_the_bodies_rates_are_those_of_the_linkage(leg):
    """By each eccentricity's rate, by differences of the whole closure; angles by the crank likewise."""
    setup = prepare(leg, clearances=FIVE)
    linkage, tables = setup.linkage, build_tables(setup.linkage, setup.contacts, POINTS)
    bodies = linkage.arrays.joint_body[setup.contacts.joint].ravel()
    slope = one_cycle(linkage, POINTS, 1.0).v[:, bodies, 2]
    for i in (0, 40, 100):
        spin, by_angle = tables.spin[i]
        before, after = tables.spin[i - 1, 0] if i else tables.spin[-2, 0], tables.spin[i + 1, 0]
        difference = (after - before) / (2.0 * COARSER * TURN / POINTS)
        np.testing.assert_allclose(by_angle, difference, atol=0.02 * np.abs(difference).max())
        # virtual work: the drive's torque by a moment on a body is minus the body's turning
        np.testing.assert_allclose(tables.spin_reaction[i, :, 0], -slope[COARSER * i], atol=1.0e-5)
        assert not spin[bodies == 0].any()
        assert np.abs(spin[bodies > 0]).max() > 1.0  # 1/m


# --- the linear system ---


@pytest.mark.plain
@given(seed=st.integers(0, 2**32 - 1), viscosity=st.floats(-3.0, 1.5).map(lambda p: 10.0**p))
def test_the_system_is_solved(seed, viscosity):
    """Two joints in contact, two with a film, one of them in both: against the dense system."""
    random, k, h, speed = np.random.default_rng(seed), 3, 1.0e-5, TURN
    d = 2 * k
    a = random.normal(size=(d, d))
    inverse_mass = a @ a.T + np.eye(d)
    sample = random.normal(size=(SAMPLE_ROWS, padded(k))) * 0.1
    for j in range(k):
        direction = random.uniform(0.0, TURN)
        n = np.array([np.cos(direction), np.sin(direction)])
        size = 3.0e-4 + 1.0e-6 * random.normal()
        sample[[EX, EY], j], sample[[NX, NY], j] = size * n, n
        sample[DELTA, j] = size - 3.0e-4
        sample[F_N, j] = 50.0 if j < 2 else 0.0
        sample[STIFFNESS, j], sample[DAMPING, j], sample[CAM, j] = 1.0e7, 1.0e3, 1.0e-6
    films = np.array([[0.01, 0.02, 0.0 if j == 0 else viscosity, 1.6e-6] for j in range(k)])
    block, stiff, push, matrix = np.zeros((d, 2)), np.zeros((d, 2)), np.zeros(d), np.zeros((d, d))
    factorise_films(h, films, 5.0e-5, inverse_mass, speed, sample, block, stiff, push, matrix)
    g, whole, spring = GAMMA * h, np.zeros((d, d)), np.zeros((d, d))
    for j in range(k):
        whole[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = block[2 * j : 2 * j + 2]
        spring[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = stiff[2 * j : 2 * j + 2]
    x = random.normal(size=(VECTORS, d))
    solve_films(h, 1.0, inverse_mass, stiff, push, matrix, x, 0, 1, 2, 3)
    pulled = x[1] - inverse_mass @ (spring @ x[0] + push)
    rates = np.linalg.solve(np.eye(d) + inverse_mass @ whole, pulled)
    np.testing.assert_allclose(x[3], rates, rtol=1.0e-7, atol=1.0e-9 * np.abs(pulled).max())
    np.testing.assert_allclose(x[2], x[0] + g * x[3], rtol=1.0e-12)


@pytest.mark.plain
def test_without_films_it_is_the_system_of_the_contacts():
    """Dry joints, two of three in contact, one of them on a wall that turns."""
    random, k, h = np.random.default_rng(3), 3, 1.0e-5
    d = 2 * k
    a = random.normal(size=(d, d))
    inverse_mass, sample = a @ a.T + np.eye(d), np.zeros((SAMPLE_ROWS, padded(k)))
    for j, angle in enumerate((0.3, 2.0, 4.0)):
        sample[[NX, NY], j] = np.cos(angle), np.sin(angle)
        sample[F_N, j], sample[STIFFNESS, j] = (20.0 if j != 1 else 0.0), 2.0e7
        sample[DAMPING, j], sample[CAM, j] = 500.0, 1.0e-4 * j
    x, system = np.zeros((VECTORS, 2 * padded(k))), contact_system(k)
    x[:, :d] = random.normal(size=(VECTORS, d))
    m = factorise_contacts(h, inverse_mass, TURN, sample, system)
    factorise_films(
        h, np.zeros((k, 4)), 5.0e-5, inverse_mass, TURN, sample,
        system.block, system.stiff, system.push, system.matrix,
    )  # fmt: skip
    for stage in (1.0, -1.0, 0.0):
        solve_contacts(h, system, m, stage, x, 0, 1, 2, 3)
        solve_films(h, stage, inverse_mass, system.stiff, system.push, system.matrix, x, 0, 1, 4, 5)
        np.testing.assert_allclose(x[5], x[3], rtol=1.0e-8, atol=1.0e-10)
        np.testing.assert_allclose(x[4], x[2], rtol=1.0e-8, atol=1.0e-10)


# --- energy ---


@pytest.mark.parametrize("viscosity", [0.001, 0.03, 1.0])
def test_energy_adds_up(leg, viscosity):
    _, _, energy = walked(greased(leg, viscosity), 1.0, 5.0)
    assert abs(energy.residual) < 5.0e-3 * (energy.contact_loss + energy.friction_loss)


def test_energy_adds_up_on_walls_that_wear(leg):
    """At 1e4 times the pace of real wear, with films of the clearance as it opens."""
    soft = {
        n: attrs.evolve(c, wear_coefficient=tuple(1.0e4 * k for k in c.wear_coefficient))
        for n, c in leg.clearances.items()
    }
    _, _, energy = walked(greased(attrs.evolve(leg, clearances=soft), 0.01), 1.0, 5.0, wear=True)
    assert energy.wear_loss > 0.0
    assert abs(energy.residual) < 5.0e-3 * (energy.contact_loss + energy.friction_loss)


@pytest.fixture(scope="module")
def run(leg):
    """A run whose stepper each example replaces: its tables serve for all."""
    return ClearanceRun(prepare(leg, clearances=FIVE))


@settings(max_examples=20)
@given(
    power=st.floats(-3.0, 1.0),
    seed=st.integers(0, 1000),
    angle=st.floats(0.0, TURN),
    rpm=st.sampled_from([-120.0, -20.0, 30.0, 60.0, 100.0]),
)
def test_films_take_energy_and_give_none(leg, run, power, seed, angle, rpm):
    """From any place of the journals: no joint gains, and what all lose is what the drive has put in."""
    setup = prepare(greased(leg, 10.0**power), clearances=FIVE, speed_rpm=rpm)
    stepper, joints = ClearanceStepper(setup, tables=run.stepper.model.tables), len(leg.joints)
    random = np.random.default_rng(seed)
    away, direction = 2.9e-4 * random.random(5), TURN * random.random(5)
    stepper.init(angle, setup.speed)
    stepper.set_eccentricities(np.stack([away * np.cos(direction), away * np.sin(direction)], axis=1))
    run.stepper, statistics = stepper, new_run_statistics(joints)
    before, polynomial = run.stored_energy, steady_drive(angle, setup.speed)
    for t in np.arange(1, 11) * 0.02:
        assert stepper.advance(polynomial, t, statistics) == (0, -1)
        assert (statistics.integral[:, DISSIPATION] >= 0.0).all()
    energy = energy_balance(statistics, before, run.stored_energy)
    assert abs(energy.residual) < 0.02 * statistics.integral[:, [DISSIPATION, FRICTION]].sum()


# --- limits, and full coordinates ---


def test_a_film_of_no_viscosity_is_the_dry_joint(leg):
    """Before impacts have made a difference of 1e-9 a large one."""
    (dry, seen, _), (thin, felt, _) = (walked(m, 0.0, 0.01) for m in (leg, greased(leg, 1.0e-9)))
    assert seen.integral[:, CONTACT].sum() > 0.0
    np.testing.assert_allclose(thin.stepper.eccentricity, dry.stepper.eccentricity, atol=1.0e-9)
    np.testing.assert_allclose(felt.integral[:, FORCE], seen.integral[:, FORCE], rtol=1.0e-3, atol=1.0e-6)


def test_a_stiff_film_is_an_ideal_joint_and_does_not_wear(leg):
    runs = [walked(greased(leg, viscosity), 1.0, 2.0) for viscosity in (40.0, 4000.0)]
    (run, soft, _), (_, stiff, energy) = runs
    assert not soft.integral[rows_of(run)][:, [CONTACT, ARCHARD]].any()
    motion = one_cycle(run._setup.linkage, 360, TURN)
    wanted = np.linalg.norm(motion.joint_force, axis=2).mean(axis=0)
    np.testing.assert_allclose(soft.integral[:, FORCE], wanted, rtol=0.01, atol=0.15)  # 0.15 N
    assert stiff.response[0] < 1.0e-4 < 0.1 * soft.response[0]  # m, of the toe
    petroff = 0.0
    contacts, bodies = run._setup.contacts, run._setup.linkage.arrays.joint_body
    for k, joint in enumerate(contacts.joint):
        turning = np.diff(motion.v[:, bodies[joint], 2], axis=1)
        diameter = 2.0 * (contacts.bushing_radius[k] - contacts.clearance[k])
        shear = 0.25 * np.pi * contacts.width[k] * diameter**3 * 4000.0 / contacts.clearance[k]
        petroff += shear * np.mean(turning**2)  # J in a cycle of 1 s
    assert energy.contact_loss == pytest.approx(petroff, rel=0.02)


def test_only_the_joints_with_a_film_have_one(leg):
    """A and B greased, the ankle dry."""
    run, _, energy = walked(greased(leg, 0.1, "AB"), 0.5, 1.5)
    sample = run.stepper.work.start
    film = np.abs(sample[[FILM_X, FILM_Y, MOMENT_B, MOMENT_J]]).sum(axis=0)
    assert (film[:2] > 0.0).all() and not film[2:].any()
    assert abs(energy.residual) < 5.0e-3 * (energy.contact_loss + energy.friction_loss)


def test_the_force_that_is_observed_is_the_one_that_is_integrated(leg):
    """Contact and film together, over an interval in which it hardly changes."""
    run = ClearanceRun(prepare(greased(leg, 0.3), clearances=FIVE))
    rows, joints = rows_of(run), len(leg.joints)
    run.advance(1.0, new_run_statistics(joints))
    before, statistics = run.stepper.observe(), new_run_statistics(joints)
    run.advance(1.0 + 1.0 / 2048.0, statistics)
    ends = [np.linalg.norm(force, axis=1) for force in (before.force, run.stepper.observe().force)]
    mean = statistics.integral[rows, FORCE] / statistics.time[0]
    np.testing.assert_allclose(mean, 0.5 * (ends[0] + ends[1]), rtol=0.05)


@pytest.mark.chaotic
def test_full_coordinates_find_the_same_forces_wear_and_losses(leg):
    """A greased leg repeats itself: its cycles scatter by less than what is left out of this formulation."""
    grease = greased(leg, 0.01)
    full, joints = FullRun(prepare(grease, clearances=FIVE)), len(leg.joints)
    full.advance(1.0, new_run_statistics(joints))
    exact = new_run_statistics(joints)
    full.advance(2.0, exact)
    cycles = []
    run = ClearanceRun(prepare(grease, clearances=FIVE))
    run.advance(1.0, new_run_statistics(joints))
    for cycle in range(4):
        statistics = new_run_statistics(joints)
        run.advance(2.0 + cycle, statistics)
        cycles.append(statistics.integral[rows_of(run)])
    mean, scatter = np.mean(cycles, axis=0), np.std(cycles, axis=0)
    wanted = exact.integral[rows_of(run)]
    for what, bound in (
        (FORCE, 0.01),
        (CONTACT, 0.02),
        (FRICTION, 0.02),
        (ARCHARD, 0.02),
        (DISSIPATION, 0.02),
    ):
        allowed = 3.0 * scatter[:, what] + bound * wanted[:, what].max()
        assert (abs(mean[:, what] - wanted[:, what]) < allowed).all(), (what, mean[:, what], wanted[:, what])
