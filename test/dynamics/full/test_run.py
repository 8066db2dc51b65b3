"""The full-coordinate run as a program: what it promises beside the physics."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import SimulationError


def test_a_run_in_pieces_is_the_run_in_one_go_until_chaos(leg):
    """Pieces end steps elsewhere, so before the impacts decorrelate they agree to the tolerance."""
    runs = [FullRun(prepare(leg, clearances=("G",)), tolerance_m=1.0e-12) for _ in range(2)]
    statistics = new_run_statistics(len(leg.joints))
    runs[0].advance(0.02, statistics)
    for t in np.linspace(0.0, 0.02, 8)[1:]:
        runs[1].advance(t, statistics)
    np.testing.assert_allclose(runs[1].q, runs[0].q, atol=1.0e-8)


def test_the_same_run_again_is_the_same(leg):
    """Bit for bit."""
    runs = [FullRun(prepare(leg)) for _ in range(2)]
    for run in runs:
        run.advance(0.2, new_run_statistics(len(leg.joints)))
    np.testing.assert_array_equal(runs[0].state.y, runs[1].state.y)


def test_it_starts_at_the_ideal_motion_with_centred_journals(leg, linkage_of):
    run = FullRun(prepare(leg))
    assert run.time == 0.0
    assert run.sample().crank_angle == pytest.approx(0.0, abs=1.0e-12)
    assert not run.state.approach.any()
    assert all(run.sample().force[list(leg.joints).index(name)] == 0.0 for name in leg.clearance_joints)


def test_a_journal_pushed_through_stops_with_joint_and_time(leg):
    soft = attrs.evolve(leg.clearances["G"], stiffness=1.0e3)
    weak = attrs.evolve(leg, clearances={**leg.clearances, "G": soft})
    run = FullRun(prepare(weak, clearances=("A", "G")))
    with pytest.raises(SimulationError, match=r"bionic_leg\.yaml: joint G at t = 0\.\d+ s: .*try") as caught:
        run.advance(1.0, new_run_statistics(len(leg.joints)))
    assert f"{run.time:.6g}" in str(caught.value)
    assert np.isfinite(run.state.y).all()
