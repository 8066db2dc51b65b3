"""What bodies change of the ideal leg's torque, held against the torque of changed legs."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.body_torques import body_torques, torque_coefficients
from leg_wear_monitor.mechanism.position import build_linkage, ideal_motion, one_cycle
from leg_wear_monitor.twin.reference import LegParameters

POINTS = 240


@pytest.mark.parametrize("speed", [2.0 * np.pi, -5.0])
@pytest.mark.parametrize(("kind", "step", "off"), [("mass", 0.5, 1e-9), ("length", 2.0e-3, 1e-6)])
def test_they_are_differences_of_the_torques_of_other_legs(leg, speed, kind, step, off) -> None:
    """The torque is linear in the masses, and that of lengths is a difference with the same step."""
    none, k = LegParameters.none(leg), list(leg.bodies).index("shank")
    more = attrs.evolve(none, **{kind: np.ones(len(leg.bodies)) + step * np.eye(len(leg.bodies))[k]})
    torques = [
        one_cycle(build_linkage(bodies.applied(leg)), POINTS, speed).drive_torque for bodies in (none, more)
    ]
    expected = (torques[1] - torques[0]) / step
    found = body_torques(leg).at(speed)[kind == "length"][k]
    np.testing.assert_allclose(found, expected, atol=off * np.abs(expected).max())


@pytest.mark.parametrize(("speed", "acceleration"), [(2.0 * np.pi, 0.0), (-5.0, 3.0)])
def test_their_sum_is_the_torque_of_the_leg(leg, speed, acceleration) -> None:
    expected = one_cycle(build_linkage(leg), POINTS, speed, acceleration).drive_torque
    found = np.array([1.0, speed, speed**2, acceleration]) @ body_torques(leg).own
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.usefixtures("solve_of_any_numpy")
def test_they_are_solved_alike_by_the_oldest_numpy(leg) -> None:
    """Seen before: with the numpy of Ubuntu 24.04 (1.26), each start of a monitor ended in a traceback."""
    linkage = build_linkage(leg)
    own, _ = torque_coefficients(linkage, ideal_motion(linkage, np.linspace(0.0, 6.0, 7), 1.0).q)
    assert np.isfinite(own).all()
