"""One clearance joint: its normal force has a potential, and contacts within a step are seen."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from leg_wear_monitor.contact.arrays import ContactArrays, clearance_settings, compile_contacts
from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.contact.laws import LAWS
from leg_wear_monitor.dynamics.joint import (
    DELTA,
    DELTA_DOT,
    NEVER,
    SAMPLE,
    contact_energy,
    first_contact_event,
    joint_force,
    penetration,
)
from leg_wear_monitor.wear import SECTORS, Surfaces, local_surfaces

# Contacts inside a step: where a free journal meets its bushing.


CLEARANCE = 3.0e-4


def _sample(ex, ey, vx, vy):
    """One joint as the integrators hand it over."""
    sample = np.zeros((SAMPLE, 1))
    delta, nx, ny = journal_contact(ex, ey, CLEARANCE)
    sample[DELTA, 0], sample[DELTA_DOT, 0] = delta, nx * vx + ny * vy
    return sample


@given(
    fraction=st.floats(0.0, 0.9), angle=st.floats(-4.0, 4.0), heading=st.floats(-1.2, 1.2),
    speed=st.floats(0.01, 5.0), reach=st.floats(0.0, 0.3),
)  # fmt: skip
def test_a_free_flight_touches_where_the_circle_is_met(fraction, angle, heading, speed, reach):
    """|e + v t| = c, a quadratic; the cubic through a short step's ends finds it.

    From a fraction of the clearance outwards, in a step that moves it by about reach c.
    """
    ex, ey = fraction * CLEARANCE * math.cos(angle), fraction * CLEARANCE * math.sin(angle)
    vx, vy = speed * math.cos(angle + heading), speed * math.sin(angle + heading)
    h = (reach + 1.0e-3) * CLEARANCE / speed
    along, square = ex * vx + ey * vy, ex * ex + ey * ey - CLEARANCE**2
    time = (-along + math.sqrt(along**2 - speed**2 * square)) / speed**2
    assume(abs(time / h - 1.0) > 1.0e-6)
    start, end = _sample(ex, ey, vx, vy), _sample(ex + vx * h, ey + vy * h, vx, vy)
    got = first_contact_event(np.zeros(1), h, start, end)
    if time > h:
        assert got == NEVER
    else:
        assert got == pytest.approx(time / h, abs=0.02)


def test_the_first_of_several_counts():
    start = np.hstack([_sample(fraction * CLEARANCE, 0.0, 1.0, 0.0) for fraction in (0.5, 0.9, 0.7)])
    h = 0.6 * CLEARANCE
    end = np.hstack([_sample((fraction + 0.6) * CLEARANCE, 0.0, 1.0, 0.0) for fraction in (0.5, 0.9, 0.7)])
    assert first_contact_event(np.zeros(3), h, start, end) == pytest.approx(0.1 / 0.6, rel=1.0e-6)
    assert first_contact_event(np.array([0.0, 1.0, 0.0]), h, start, end) == pytest.approx(0.5, rel=1.0e-6)


def test_a_touch_and_parting_inside_one_step_is_seen():
    """Penetration -1, 0.5, -1 um over the step: both ends are open."""
    start, end = np.zeros((SAMPLE, 1)), np.zeros((SAMPLE, 1))
    start[DELTA, 0], start[DELTA_DOT, 0] = -1.0e-6, 6.0
    end[DELTA, 0], end[DELTA_DOT, 0] = -1.0e-6, -6.0
    fraction = first_contact_event(np.zeros(1), 1.0e-6, start, end)
    assert 6.0 * fraction * (1.0 - fraction) == pytest.approx(1.0, rel=1.0e-9)


# One clearance joint with worn surfaces: its normal force has a potential, bodies' turning included.


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
