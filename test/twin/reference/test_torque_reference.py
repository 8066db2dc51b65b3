"""Runs of simulated legs: which legs, and that a restored run continues bit for bit."""

import time
from concurrent.futures import wait
from threading import Event

import attrs
import numpy as np
import pytest

from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import torque_reference
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.torque_reference import (
    FRICTIONS,
    HEAVIER,
    LONGER,
    MASSES,
    ROUGHER,
    ReferenceSnapshot,
    TorqueReference,
    TorqueReferenceRun,
    design,
    levels_of,
)
from leg_wear_monitor.wear import SECTORS

FRESH_M = 2.0e-4  # of the two clearance joints of `small`
NEW, UNWORN = np.full(2, FRESH_M), np.zeros((2, 2, SECTORS))
STEADY = CrankProfile.steady(TURN)
WIDER = (1.2, 8.0)  # fewer than usual
CHANGED = 4  # legs of an identification beside the expected one


@attrs.frozen
class Simulated:
    """What a run found, and a snapshot of it when it was amidst its legs."""

    found: TorqueReference
    snapshot: ReferenceSnapshot
    progress: float


def finished(run: TorqueReferenceRun) -> TorqueReference:
    found = run.finish()
    assert found is not None
    return found


def assert_same(one: TorqueReference, other: TorqueReference) -> None:
    """Bit for bit."""
    for torque, same in zip(one.torque_nm, other.torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)


def shorten(patch: pytest.MonkeyPatch) -> None:
    """Runs of few legs: a single gait cycle each, two of the expected one; one in each period."""
    patch.setattr(torque_reference, "CYCLES", 1)
    patch.setattr(torque_reference, "PACE", 1)
    patch.setattr(torque_reference, "_SETTLING", 0)
    patch.setattr(torque_reference, "WIDER", WIDER)
    patch.setattr(torque_reference, "levels_of", lambda near: levels_of(near)[: 1 + CHANGED])


@pytest.fixture
def short(monkeypatch):
    shorten(monkeypatch)


@pytest.fixture(scope="module")
def small():
    """A mechanism with few bodies and two clearance joints."""
    return load_mechanism("four_bar")


@pytest.fixture(scope="module")
def simulated(small):
    """A short reference of wider joints, and one of other bodies."""

    def simulate(begin) -> Simulated:
        run = TorqueReferenceRun(small)
        begin(run)
        for _ in range(4):
            run.advance()
        snapshot, progress = run.snapshot(), run.progress
        return Simulated(finished(run), snapshot, progress)

    none = LegParameters.none(small)
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        return {
            "wider": simulate(lambda run: run.begin(NEW, UNWORN, STEADY)),
            "other bodies": simulate(lambda run: run.begin_identification(NEW, UNWORN, STEADY, none)),
        }


@pytest.fixture(scope="module")
def whole(simulated) -> TorqueReference:
    return simulated["wider"].found


def test_each_joint_is_wider_in_turn(whole) -> None:
    of_factors = len(MASSES) * len(whole.parameters.mass) + len(FRICTIONS)
    assert [len(torque) for torque in whole.torque_nm] == [2] + (2 * len(WIDER) + of_factors) * [1]
    np.testing.assert_allclose(whole.clearance_m[1 : 1 + len(WIDER), 0], FRESH_M * np.array(WIDER))
    assert (whole.clearance_m[1 : 1 + len(WIDER), 1:] == FRESH_M).all()
    np.testing.assert_array_equal(whole.parameters.mass, 1.0)


def test_the_last_legs_have_another_mass_of_a_body_in_turn_or_another_friction(small, whole, short) -> None:
    assert whole.of_joints.tolist() == [[1, 2], [3, 4]]
    assert whole.of_masses.tolist() == [[5, 6], [7, 8], [9, 10]]
    assert whole.of_frictions.tolist() == [[11, 12, 13, 14]]
    none = LegParameters.none(small)
    heavier = attrs.evolve(none, mass=none.mass * np.array([1.0, MASSES[1], 1.0]))
    for own, leg in ((heavier, 8), (attrs.evolve(none, friction=FRICTIONS[2]), 13)):
        other = TorqueReferenceRun(own.applied(small))
        other.begin(NEW, UNWORN, STEADY)
        np.testing.assert_array_equal(finished(other).torque_nm[0][:1], whole.torque_nm[leg])


def test_legs_of_bodies_follow_the_order_of_a_mechanism(small, whole) -> None:
    names = list(small.bodies)
    turned = attrs.evolve(small, bodies=dict(reversed(small.bodies.items())))
    found = whole.in_order_of(turned, names)
    for leg, same in enumerate([0, 1, 2, 3, 4, 9, 10, 7, 8, 5, 6, 11, 12, 13, 14]):
        np.testing.assert_array_equal(found.torque_nm[leg], whole.torque_nm[same])
    assert_same(found.in_order_of(small, names[::-1]), whole)
    part = attrs.evolve(whole, torque_nm=whole.torque_nm[:8])
    assert len(part.in_order_of(small, names).torque_nm) == 8
    assert len(part.in_order_of(turned, names).torque_nm) == 5


def test_a_worn_joint_is_also_new_and_the_others_narrower(small, short) -> None:
    run = TorqueReferenceRun(small)
    run.begin(FRESH_M * np.array([1.0, 3.0]), UNWORN, STEADY)
    found = finished(run)
    sizes = len(WIDER) + 1
    assert found.of_joints.shape == (2, sizes)
    np.testing.assert_allclose(found.clearance_m[2 * sizes, 1], FRESH_M)
    np.testing.assert_allclose(found.clearance_m[sizes, 0], 0.8 * FRESH_M)


@pytest.mark.parametrize("what", ["wider", "other bodies"])
def test_a_restored_run_and_a_part_go_on_bit_for_bit(small, simulated, short, what) -> None:
    known = simulated[what]
    restored, later = (TorqueReferenceRun(small) for _ in range(2))
    assert restored.part is None
    restored.restore(known.snapshot)
    assert restored.progress == known.progress
    part = restored.part
    assert part is not None
    assert not part.is_whole and part.is_of_parameters == (what == "other bodies")
    assert 1 < len(part.torque_nm) < len(known.found.torque_nm)
    later.go_on(part, UNWORN)
    assert later.progress == pytest.approx(known.progress, abs=0.01)
    for run in (restored, later):
        assert_same(finished(run), known.found)
        assert run.part is None


def test_masses_lengths_and_friction_are_changed_at_once(small, simulated, short) -> None:
    none, found = LegParameters.none(small), simulated["other bodies"].found
    assert [len(torque) for torque in found.torque_nm] == [2] + CHANGED * [1]
    assert (found.clearance_m == FRESH_M).all()
    # one of them, simulated alone
    bodies = len(small.bodies)
    mass, length, friction = np.split(levels_of(none)[3], [bodies, 2 * bodies])
    own = LegParameters(none.mass + HEAVIER * mass, none.length + LONGER * length, ROUGHER ** friction.item())
    other = TorqueReferenceRun(own.applied(small))
    other.begin(NEW, UNWORN, STEADY)
    while not other.snapshot().done:
        other.advance()
    np.testing.assert_array_equal(other.snapshot().done[0][:1], found.torque_nm[3])


@pytest.mark.parametrize("parameters", [1, 2, 11, 15, 16, 17])
def test_levels_are_orthogonal_and_each_leg_has_its_opposite(parameters: int) -> None:
    levels = design(parameters)
    assert not levels[0].any()
    assert set(np.abs(levels[1:]).ravel()) == {1.0}
    np.testing.assert_array_equal(levels.T @ levels, (len(levels) - 1) * np.eye(parameters))
    assert sorted(map(tuple, levels)) == sorted(map(tuple, -levels))
    # what two of them change together looks like none of them
    pairs = levels[:, :, None] * levels[:, None, :]
    assert not np.einsum("ni,njk->ijk", levels, pairs).any()


@pytest.fixture
def open_leg(small) -> LegParameters:
    """Parameters of a leg that does not close."""
    none, crank = LegParameters.none(small), list(small.bodies).index("crank")
    return attrs.evolve(none, length=none.length + 50.0 * np.eye(len(small.bodies))[crank])


def test_a_leg_that_does_not_close_ends_a_run(small, short, open_leg) -> None:
    run, other = TorqueReferenceRun(small), TorqueReferenceRun(small)
    run.begin(NEW, UNWORN, STEADY, open_leg)
    assert run.advance() is None
    other.restore(run.snapshot())
    for each in (run, other):
        assert each.is_busy
        assert each.finish() is None
        assert not each.is_busy


def test_a_live_run_ends_as_soon_as_a_leg_cannot_be_simulated(small, short, open_leg) -> None:
    run, periods = TorqueReferenceRun(small), 0
    run.may_be_late = True
    run.begin(NEW, UNWORN, STEADY, open_leg)
    run.advance()  # its first leg is due in the second period, all of it in the sixth
    while run.is_busy and periods < 4:
        while not run._ahead[0].done():
            time.sleep(0.01)
        assert run.advance() is None
        periods += 1
    assert periods == 1


def test_threads_that_are_behind_get_help(small, short, whole) -> None:
    """Where a machine is busy, threads of low priority got nothing, and the node waited for them."""
    run, stuck, found = TorqueReferenceRun(small), Event(), None
    for _ in range(run._threads):
        run._pool.submit(stuck.wait)
    try:
        run.begin(NEW, UNWORN, STEADY)
        while run.is_busy:
            found = run.advance()
    finally:
        stuck.set()
    assert found is not None
    assert_same(found, whole)


def test_a_run_that_is_left_has_its_threads_end_and_can_go_on(small, short, whole) -> None:
    run = TorqueReferenceRun(small, cycles=1000)  # minutes of a processor for each leg
    run.begin(NEW, UNWORN, STEADY)
    run.advance()
    ahead = run._ahead
    assert ahead
    run.leave()
    wait(ahead)
    assert all(one.cancelled() or one.result() is None for one in ahead)
    again = TorqueReferenceRun(small)
    again.begin(NEW, UNWORN, STEADY)
    again.advance()
    again.leave()
    assert_same(finished(again), whole)


def test_a_live_run_never_waits(small, short, whole) -> None:
    """A node whose machine was busy waited 54 s for its threads, and its middleware lost what came."""
    run, stuck, found = TorqueReferenceRun(small), Event(), None
    run.may_be_late = True
    for pool in (run._pool, run._urgent):
        for _ in range(run._threads):
            pool.submit(stuck.wait)
    try:
        run.begin(NEW, UNWORN, STEADY)
        while not run.is_late:
            assert run.advance() is None
        for _ in range(3):
            assert run.advance() is None
        assert run.part is None
        assert (run.progress, run.cycles_left) == (1.0, 0.0)
    finally:
        stuck.set()
    while run.is_busy:
        found = run.advance()
        time.sleep(0.001)
    assert not run.is_late
    assert found is not None  # a leg that is simulated while this looks is not one that cannot be
    assert_same(found, whole)


def test_what_advance_returns_does_not_depend_on_how_long_the_thread_takes(small, short) -> None:
    quick, slow = TorqueReferenceRun(small), TorqueReferenceRun(small)
    for run in (quick, slow):
        run.begin(NEW, UNWORN, STEADY)
    for _ in range(4):
        quick.advance()
        slow.advance()
        time.sleep(0.01)  # its threads are further
        assert quick.progress == slow.progress
    for one, same in zip(quick.snapshot().done, slow.snapshot().done, strict=True):
        np.testing.assert_array_equal(one, same)
