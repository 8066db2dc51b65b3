"""A leg that is simulated under the force of the ground, of which each step is otherwise."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.person import nominal_stance
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters, LegSimulation
from leg_wear_monitor.wear import SECTORS


def test_what_was_simulated_before_changes_nothing():
    """Threads simulate legs in any order, and a reference has the same bytes."""
    leg = load_mechanism("bionic_leg")
    force = 300.0 * nominal_stance(build_linkage(leg)).force()
    loaded = attrs.evolve(LegParameters.none(leg), load=force, compliance=1.0e-3)
    new, unworn = np.full(5, 3.0e-4), np.zeros((5, 2, SECTORS))
    simulation, profile = LegSimulation(leg), CrankProfile.steady(TURN)
    first, longer, again = (simulation.simulate(profile, loaded, new, unworn, 0, n) for n in (3, 4, 3))
    assert first is not None and longer is not None
    np.testing.assert_array_equal(again.torque, first.torque)
    np.testing.assert_array_equal(longer.torque[:3], first.torque)
