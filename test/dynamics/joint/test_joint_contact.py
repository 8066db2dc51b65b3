"""One clearance joint with worn surfaces: its normal force has a potential, bodies' turning included."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from leg_wear_monitor.contact.arrays import ContactArrays, clearance_settings, compile_contacts
from leg_wear_monitor.contact.normal import LAWS
from leg_wear_monitor.dynamics.joint import contact_energy, joint_force, penetration
from leg_wear_monitor.wear import SECTORS, Surfaces, local_surfaces

TURN = 2.0 * math.pi
angles = st.floats(-3.0, 3.0)


# one law of each form, and a stiffness given where that can be
CASES = {law.number: (name, 0.0) for name, law in LAWS.items()}
CASES[-1] = ("hertz", 1.0e10)


@pytest.fixture(scope="module", params=CASES.values(), ids=str)
def elastic(leg, request) -> ContactArrays:
    """Joint G without loss or friction: what is left has a potential."""
    law, stiffness = request.param
    contacts = compile_contacts(leg, ["G"], clearance_settings(leg, ["G"], normal_law=law))
    return contacts._replace(
        friction=np.zeros((1, 3)), hysteresis=np.zeros(1), stiffness=np.array([stiffness])
    )


def _grooved(seed: int) -> Surfaces:
    """A groove in the bushing and one in the journal, up to 0.3 mm deep and some 20 degrees wide."""
    rng = np.random.default_rng(seed)
    centres = (np.arange(SECTORS) + 0.5) * TURN / SECTORS
    depth = [
        rng.uniform(0.0, 3.0e-4) * np.exp(4.0 * (np.cos(centres - rng.uniform(0, TURN)) - 1.0)) for _ in "bj"
    ]
    return Surfaces(np.array([depth]), 1)


@given(
    direction=angles, angle_b=angles, angle_j=angles, delta=st.floats(1.0e-6, 1.0e-5), seed=st.integers(0, 9)
)
def test_the_normal_force_is_the_gradient_of_the_contact_energy(
    elastic, direction, angle_b, angle_j, delta, seed
):
    """By the eccentricity, and by the angles of both bodies: a worn bushing that turns lifts like a cam."""
    sector = (direction - np.array([angle_b, angle_j])) * SECTORS / TURN
    assume(np.abs(sector - np.round(sector)).min() > 1.0e-3)  # at an edge the second derivative jumps
    surfaces = _grooved(seed)
    bushing, journal, *_ = local_surfaces(elastic, surfaces, 0, direction, angle_b, angle_j)
    e = bushing - journal + delta
    at = np.array([e * math.cos(direction), e * math.sin(direction), angle_b, angle_j])
    f_n, _, _, _, _, nx, ny, _, moment = joint_force(
        elastic, surfaces, 0, at[0], at[1], 0.0, 0.0, angle_b, angle_j, 0.0, 0.0, 1.0
    )
    slopes = np.array([_slope(elastic, surfaces, at, i) for i in range(4)])
    # the force acts at P_b + R_b n: on the journal by the arm R_b n - e, on the bushing by none along n
    on_journal = f_n * (at[0] * ny - at[1] * nx) + moment
    assert -f_n * nx == pytest.approx(-slopes[0], abs=1.0e-6 * f_n)
    assert -f_n * ny == pytest.approx(-slopes[1], abs=1.0e-6 * f_n)
    assert -moment == pytest.approx(-slopes[2], abs=1.0e-6 * f_n * e)
    assert on_journal == pytest.approx(-slopes[3], abs=1.0e-6 * f_n * e)


def _slope(contacts: ContactArrays, surfaces: Surfaces, at: np.ndarray, i: int) -> float:
    """Derivative of the contact's energy by one of (e_x, e_y, angle_b, angle_j), by central difference."""
    step = np.zeros(4)
    step[i] = 1.0e-9 if i < 2 else 1.0e-7

    def energy(where: np.ndarray) -> float:
        return contact_energy(contacts, surfaces, 0, *where)

    return (energy(at + step) - energy(at - step)) / (2.0 * step[i])


@given(direction=angles, delta=st.floats(1.0e-7, 5.0e-5), seed=st.integers(0, 9))
def test_notches_that_no_journal_enters_leave_the_normal_a_normal(elastic, direction, delta, seed):
    """Sectors of their own depth, up to 50 um: the force keeps its order, and turning it all is no work."""
    depth = np.random.default_rng(seed).uniform(0.0, 5.0e-5, (1, 2, SECTORS))
    surfaces = Surfaces(depth, 1)
    bushing, journal, *_ = local_surfaces(elastic, surfaces, 0, direction, 0.3, -0.7)
    e = bushing - journal + delta
    ex, ey = e * math.cos(direction), e * math.sin(direction)
    _, nx, ny, *_, cam_b, cam_j = penetration(elastic, surfaces, 0, ex, ey, direction, 0.3, -0.7)
    assert math.hypot(nx, ny) < 2.5
    assert ex * ny - ey * nx + cam_b + cam_j == pytest.approx(0.0, abs=1.0e-9 * e)
