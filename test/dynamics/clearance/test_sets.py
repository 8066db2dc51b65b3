"""The leg with clearances over twenty cycles: published ranges, energy, and the two formulations.

The motion is chaotic: only means compare, and only to within their scatter. Published means come with half a
unit of their last digit, and with three times the scatter of a single cycle's mean. All that looks at the
twenty cycles is in this file: two processes that test would compute them twice.
"""

from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor.dynamics.clearance.stepper import TOLERANCE_M, ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import ARCHARD, CONTACT, FORCE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.wear.surfaces import BUSHING

CYCLES = 20

# mean contact force [N] of each clearance joint, and its rounding
PUBLISHED = {
    "G": [(67.7, 67.7, 0.05)],
    "AB": [(168.0, 168.0, 0.5), (103.0, 103.0, 0.5)],
    "ABGIJ": [
        (166.0, 168.0, 0.5),
        (104.0, 104.0, 0.5),
        (73.0, 73.0, 0.5),
        (27.3, 27.3, 0.05),
        (6.2, 6.2, 0.05),
    ],
}


@pytest.mark.parametrize("clearance_joints", PUBLISHED)
def test_mean_contact_forces_are_in_the_published_range(leg_cycles, clearance_joints):
    force = leg_cycles(clearance_joints, CYCLES).force
    mean, scatter = force.mean(axis=0), force.std(axis=0, ddof=1)
    assert (scatter / np.sqrt(CYCLES) < 0.02 * mean).all()  # else the comparison would say nothing
    for k, (low, high, rounding) in enumerate(PUBLISHED[clearance_joints]):
        slack = rounding + 3.0 * scatter[k]
        assert low - slack <= mean[k] <= high + slack, clearance_joints[k]


@pytest.mark.parametrize("clearance_joints", ["G", "AB", "IJ", "ABGIJ"])
def test_every_loose_joint_rattles_and_rubs(leg_cycles, clearance_joints):
    """Most of the time in contact, never always."""
    cycles = leg_cycles(clearance_joints, CYCLES)
    contact = cycles.contact.mean(axis=0)
    assert ((contact > 0.5) & (contact < 1.0)).all()
    assert (cycles.archard > 0.0).all()


def test_wear_comes_in_the_papers_order(leg_cycles):
    """A by far the worst, then B, G, I, and J extremely mild; and not by a few odd cycles."""
    archard = leg_cycles("ABGIJ", CYCLES).archard
    a, b, g, i, j = archard.mean(axis=0)
    assert a > 3.0 * b > b > g > 3.0 * i > i > j
    assert j < 0.05 * a
    assert (archard[:, 0] > 2.0 * archard[:, 1]).all()
    assert (archard[:, 2] > 2.0 * archard[:, 3]).all()


def test_a_wears_deeper_with_all_five_loose_than_with_a_and_b(leg_cycles):
    """By the deepest sector of its bushing; the volumes differ too, but by less than such runs scatter."""
    five, two = (
        leg_cycles(clearance_joints, CYCLES).cycles[-1].depth[0, BUSHING]
        for clearance_joints in ("ABGIJ", "AB")
    )
    assert five > two


def test_means_hold_at_a_tenth_of_the_tolerance(leg_cycles):
    """Over five cycles: forces within 2 %, and all differences within what the cycles scatter."""
    usual, fine = leg_cycles("ABGIJ", CYCLES), leg_cycles("ABGIJ", 5, tolerance_m=1.0e-10)
    scatter = np.hypot(usual.force.std(axis=0), fine.force.std(axis=0))
    difference = np.abs(usual.force.mean(axis=0) - fine.force.mean(axis=0))
    assert (difference < 2.0 * scatter).all()
    assert (difference[:4] < 0.02 * fine.force.mean(axis=0)[:4]).all()


@pytest.mark.parametrize("clearance_joints", ["G", "AB", "IJ", "ABGIJ"])
def test_energy_with_clearances(leg_cycles, clearance_joints):
    """Every cycle, to a thousandth of what is lost in it: friction and contact together."""
    for cycle in leg_cycles(clearance_joints, CYCLES).cycles:
        energy = cycle.energy
        assert energy.friction_loss > 0.0
        assert energy.contact_loss > 0.0
        assert abs(energy.residual) < 1.0e-3 * (energy.friction_loss + energy.contact_loss)


def run_statistics_of(new: Callable[[], ClearanceStepper], runs: int, count: int) -> np.ndarray:
    """Means of independent runs at 60 rpm (runs, 3, k), the first second dropped: force, Archard, contact.

    The journals start elsewhere in each, since regimes of the motion last for more than a few cycles.
    """
    polynomial, figures = steady_drive(0.0, TURN), []
    for run in range(runs):
        stepper, statistics = new(), new_run_statistics(10)
        stepper.state.e[:] = np.random.default_rng(run).uniform(-1.0e-4, 1.0e-4, len(stepper.state.e))
        for end, counted in ((1.0, new_run_statistics(10)), (1.0 + count, statistics)):
            assert stepper.advance(polynomial, end, counted) == (DONE, -1)
        joints = stepper.model.contacts.joint
        figures.append(statistics.integral[joints][:, [FORCE, ARCHARD, CONTACT]].T / count)
    return np.array(figures)


def assert_means_agree(one: np.ndarray, other: np.ndarray) -> None:
    """Within three standard errors of samples (n, 3, k), or within 2 %; 5 % for wear, which varies most."""
    difference = np.abs(one.mean(axis=0) - other.mean(axis=0))
    error = np.hypot(*(samples.std(axis=0, ddof=1) / np.sqrt(len(samples)) for samples in (one, other)))
    fraction = np.array([[0.02], [0.05], [0.02]]) * one.mean(axis=0)
    assert (difference < np.maximum(3.0 * error, fraction)).all(), difference / one.mean(axis=0)


@pytest.mark.parametrize(
    "finer, runs",
    [
        pytest.param({"interval_s": 0.5 / 2048}, 8, id="interval"),
        pytest.param({"interval_s": 0.5 / 2048}, 24, id="interval-long", marks=pytest.mark.slow),
        pytest.param({"tolerance_m": 0.1 * TOLERANCE_M}, 24, id="tolerance", marks=pytest.mark.slow),
    ],
)
def test_means_hold_at_half_the_interval_and_a_tenth_of_the_tolerance(leg, finer, runs):
    """All five joints' figures, over runs of five cycles."""
    setup = prepare(leg)
    tables = build_tables(setup.linkage, setup.contacts)
    usual, fine = (
        run_statistics_of(
            lambda options=options: ClearanceStepper(prepare(leg), tables=tables, **options), runs, 5
        )
        for options in ({}, finer)
    )
    assert_means_agree(fine, usual)


@pytest.mark.parametrize(
    "clearance_joints",
    ["G", pytest.param("AB", marks=pytest.mark.slow), pytest.param("IJ", marks=pytest.mark.slow), "ABGIJ"],
)
def test_means_are_those_of_full_coordinates(leg, leg_cycles, clearance_joints):
    """Over twenty cycles; docs/appendix/validation.md has more of them, and more figures."""
    cycles, setup = leg_cycles(clearance_joints, CYCLES), prepare(leg, clearances=tuple(clearance_joints))
    known = build_tables(setup.linkage, setup.contacts)
    full = np.stack([cycles.force, cycles.archard, cycles.contact], axis=1)
    runs = run_statistics_of(
        lambda: ClearanceStepper(prepare(leg, clearances=tuple(clearance_joints)), tables=known),
        runs=8,
        count=5,
    )
    assert_means_agree(full, runs)
