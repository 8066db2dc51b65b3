"""Runs of simulated legs: which legs, and that a restored run continues bit for bit."""

import time
from threading import Event

import attrs
import numpy as np
import pytest

from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import torque_reference
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.torque_reference import (
    HEAVIER,
    LONGER,
    ROUGHER,
    TorqueReference,
    TorqueReferenceRun,
    design,
)
from leg_wear_monitor.wear import SECTORS

NEW, UNWORN = np.full(5, 3.0e-4), np.zeros((5, 2, SECTORS))
STEADY = CrankProfile.steady(TURN)
WIDER = (1.2, 2.0, 8.0)  # fewer than usual


def finished(run: TorqueReferenceRun) -> TorqueReference:
    found = run.finish()
    assert found is not None
    return found


def shorten(patch: pytest.MonkeyPatch) -> None:
    """Runs of a single gait cycle a leg, and two where there are twice as many; one in each period."""
    patch.setattr(torque_reference, "CYCLES", 1)
    patch.setattr(torque_reference, "PACE", 1)
    patch.setattr(torque_reference, "_SETTLING", 0)
    patch.setattr(torque_reference, "WIDER", WIDER)


@pytest.fixture
def short(monkeypatch):
    shorten(monkeypatch)


@pytest.fixture(scope="module")
def whole(leg) -> TorqueReference:
    """A short reference of wider joints."""
    run = TorqueReferenceRun(leg)
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        run.begin(NEW, UNWORN, STEADY)
        return finished(run)


@pytest.fixture(scope="module")
def small():
    """A mechanism with few bodies, of which as many are simulated."""
    return load_mechanism("four_bar")


@pytest.fixture(scope="module")
def identified(small):
    """A short reference of other bodies, and a snapshot of its run amidst a leg with another body."""
    run = TorqueReferenceRun(small)
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        run.begin_identification(NEW[:2], UNWORN[:2], STEADY, LegParameters.none(small))
        for _ in range(4):
            run.advance()
        snapshot, progress = run.snapshot(), run.progress
        return finished(run), snapshot, progress


def test_each_joint_is_wider_in_turn(leg, whole) -> None:
    found = whole
    assert len(found.torque_nm) == 1 + 5 * len(WIDER)
    assert [len(torque) for torque in found.torque_nm] == [2] + 5 * len(WIDER) * [1]
    np.testing.assert_allclose(found.clearance_m[1 : 1 + len(WIDER), 0], 3.0e-4 * np.array(WIDER))
    assert (found.clearance_m[1 : 1 + len(WIDER), 1:] == 3.0e-4).all()
    np.testing.assert_array_equal(found.parameters.mass, 1.0)


def test_a_worn_joint_is_also_new_and_the_others_narrower(leg, short) -> None:
    worn, run = NEW.copy(), TorqueReferenceRun(leg)
    worn[2] = 9.0e-4
    run.begin(worn, UNWORN, STEADY)
    found = finished(run)
    sizes = len(WIDER) + 1
    assert len(found.torque_nm) == 1 + 5 * sizes
    np.testing.assert_allclose(found.clearance_m[3 * sizes, 2], 3.0e-4)
    np.testing.assert_allclose(found.clearance_m[sizes, 0], 0.8 * 3.0e-4)


def test_a_part_of_a_reference_goes_on_where_it_ended(leg, whole, short) -> None:
    first, second = (TorqueReferenceRun(leg) for _ in range(2))
    first.begin(NEW, UNWORN, STEADY)
    assert first.part is None
    for _ in range(12):
        first.advance()
    part = first.part
    assert part is not None
    assert not part.is_whole and not part.is_of_parameters
    assert 5 < len(part.torque_nm) < 12
    second.go_on(part, UNWORN)
    assert second.progress == pytest.approx(first.progress, abs=0.03)
    other = finished(second)
    assert other.is_whole
    assert second.part is None
    for torque, same in zip(whole.torque_nm, other.torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)


def test_a_part_of_an_identification_goes_on_where_it_ended(small, identified, short) -> None:
    found, snapshot, progress = identified
    first, second = (TorqueReferenceRun(small) for _ in range(2))
    first.restore(snapshot)
    part = first.part
    assert part is not None and part.is_of_parameters and len(part.torque_nm) < len(found.torque_nm)
    second.go_on(part, UNWORN[:2])
    assert second.progress == pytest.approx(progress, abs=0.06)
    for torque, same in zip(found.torque_nm, finished(second).torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)


def test_masses_lengths_and_friction_are_changed_at_once(small, identified, short) -> None:
    none, found = LegParameters.none(small), identified[0]
    bodies = len(small.bodies)
    levels = design(2 * bodies + 1)
    assert len(found.torque_nm) == len(levels)
    assert [len(torque) for torque in found.torque_nm[:3]] == [2, 1, 1]
    assert (found.clearance_m == 3.0e-4).all()
    # one of them, simulated alone
    mass, length, friction = np.split(levels[3], [bodies, 2 * bodies])
    own = LegParameters(none.mass + HEAVIER * mass, none.length + LONGER * length, ROUGHER ** friction.item())
    other = TorqueReferenceRun(own.applied(small))
    other.begin(NEW[:2], UNWORN[:2], STEADY)
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


def test_a_restored_run_continues_bit_for_bit(small, identified, short) -> None:
    found, snapshot, progress = identified
    other = TorqueReferenceRun(small)
    other.restore(snapshot)
    assert other.progress == progress
    for one, same in zip(found.torque_nm, finished(other).torque_nm, strict=True):
        np.testing.assert_array_equal(one, same)


def test_a_leg_that_does_not_close_ends_a_run(leg, short) -> None:
    none, run, other = LegParameters.none(leg), TorqueReferenceRun(leg), TorqueReferenceRun(leg)
    crank = np.eye(len(leg.bodies))[list(leg.bodies).index("crank")]
    run.begin(NEW, UNWORN, STEADY, attrs.evolve(none, length=none.length + 50.0 * crank))
    assert run.advance() is None
    other.restore(run.snapshot())
    for each in (run, other):
        assert each.is_busy
        assert each.finish() is None
        assert not each.is_busy


def test_a_live_run_ends_as_soon_as_a_leg_cannot_be_simulated(leg, short) -> None:
    none, run, periods = LegParameters.none(leg), TorqueReferenceRun(leg), 0
    run.may_be_late = True
    crank = np.eye(len(leg.bodies))[list(leg.bodies).index("crank")]
    run.begin(NEW, UNWORN, STEADY, attrs.evolve(none, length=none.length + 50.0 * crank))
    run.advance()  # its first leg is due in the second period, all of it in the 17th
    while run.is_busy and periods < 15:
        while not run._ahead[0].done():
            time.sleep(0.01)
        assert run.advance() is None
        periods += 1
    assert periods == 1


def test_threads_that_are_behind_get_help(leg, short, whole) -> None:
    """Where a machine is busy, threads of low priority got nothing, and the node waited for them."""
    run, stuck, found = TorqueReferenceRun(leg), Event(), None
    for _ in range(run._threads):
        run._pool.submit(stuck.wait)
    try:
        run.begin(NEW, UNWORN, STEADY)
        while run.is_busy:
            found = run.advance()
    finally:
        stuck.set()
    assert found is not None
    for torque, same in zip(whole.torque_nm, found.torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)


def test_a_live_run_never_waits(leg, short, whole) -> None:
    """A node whose machine was busy waited 54 s for its threads, and its middleware lost what came."""
    run, stuck, found = TorqueReferenceRun(leg), Event(), None
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
    for torque, same in zip(whole.torque_nm, found.torque_nm, strict=True):
        np.testing.assert_array_equal(torque, same)


def test_what_advance_returns_does_not_depend_on_how_long_the_thread_takes(leg, short) -> None:
    quick, slow = TorqueReferenceRun(leg), TorqueReferenceRun(leg)
    for run in (quick, slow):
        run.begin(NEW, UNWORN, STEADY)
    for _ in range(8):
        quick.advance()
        slow.advance()
        time.sleep(0.01)  # its threads are further
        assert quick.progress == slow.progress
    for one, same in zip(quick.snapshot().done, slow.snapshot().done, strict=True):
        np.testing.assert_array_equal(one, same)
