"""The film of lubricant: Butenschön's tables, Reynolds' equation, and what no film may do."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from reynolds import film_numbers

from leg_wear_monitor.contact.film import (
    attitude_angle,
    film_damping,
    film_force,
    film_stiffness,
    rotation_number,
    squeeze_number,
)
from leg_wear_monitor.mechanism.spec import FILM_WIDTHS

pytestmark = pytest.mark.plain

TABLES = json.loads((Path(__file__).parents[1] / "data" / "butenschoen.json").read_text())
WIDTHS = TABLES["width_to_diameter"]
MISPRINTS = {(m["table"], m["width_to_diameter"], m["epsilon"]) for m in TABLES["suspected_misprints"]}

C, R_B, WIDTH, ETA, ROUGH = 3.0e-4, 0.01, 0.01, 0.4, 1.5e-6
R_J = R_B - C
PSI, X = C / R_J, WIDTH / (2.0 * R_B)
UNIT = WIDTH * 2.0 * R_J * ETA / PSI**2  # N s: force by Sommerfeld number and speed


def film(ex, ey, vx, vy, speed_b, speed_j, eta=ETA):
    return np.array(film_force(ex, ey, vx, vy, speed_b, speed_j, C, R_B, WIDTH, eta, ROUGH))


def turned(angle, x, y):
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


places = st.floats(0.0, 1.05).map(lambda epsilon: epsilon * C)
angles = st.floats(-math.pi, math.pi)
speeds = st.floats(-0.5, 0.5)
spins = st.floats(-20.0, 20.0)
states = st.tuples(places, angles, speeds, speeds, spins, spins).map(
    lambda s: (*turned(s[1], s[0], 0.0), *s[2:])
)


def cells(table, every=1):
    """Cells of a table, without its misprints: width over diameter, epsilon, row, column."""
    rows = list(enumerate(TABLES[table]["epsilon"]))[::every]
    found = [(x, e, i, j) for i, e in rows for j, x in enumerate(WIDTHS)]
    return [cell for cell in found if (table, cell[0], cell[1]) not in MISPRINTS]


def at_table(table, column, row, j):
    return TABLES[table][column][row][j]


# --- the formulas ---


def test_rotation_is_that_of_the_tables():
    assert (min(WIDTHS), max(WIDTHS)) == FILM_WIDTHS
    for x, e, i, j in cells("rotation"):
        assert e * rotation_number(x, e) == pytest.approx(at_table("rotation", "sommerfeld", i, j), rel=0.07)
        beta = math.degrees(attitude_angle(x, e))
        assert beta == pytest.approx(at_table("rotation", "attitude_deg", i, j), abs=2.4)


def test_squeeze_is_that_of_the_tables():
    for x, e, i, j in cells("squeeze"):
        assert squeeze_number(x, e) == pytest.approx(at_table("squeeze", "sommerfeld", i, j), rel=0.07)


def test_rotation_in_the_tables_solves_reynolds_equation():
    """With lubricant at no pressure along the widest gap."""
    for x, e, i, j in cells("rotation", every=4):
        along, across = film_numbers(x, e, 1.0, 0.0, fed=True)
        number = at_table("rotation", "sommerfeld", i, j)
        if number > 0.01:  # the others are printed in two digits
            assert math.hypot(along, across) == pytest.approx(number, rel=0.03)
        beta = math.degrees(math.atan2(across, -along))
        assert beta == pytest.approx(at_table("rotation", "attitude_deg", i, j), abs=0.2)


def test_squeeze_in_the_tables_solves_reynolds_equation():
    for x, e, i, j in cells("squeeze", every=5):
        along, across = film_numbers(x, abs(e), 0.0, math.copysign(1.0, e))
        assert abs(along) == pytest.approx(at_table("squeeze", "sommerfeld", i, j), rel=0.03)
        assert across == pytest.approx(0.0, abs=1.0e-9 * abs(along))


@pytest.mark.parametrize("table, x, epsilon", sorted(MISPRINTS))
def test_what_is_marked_as_a_misprint_is_one(table, x, epsilon):
    """Neither the formula nor Reynolds' equation has the printed value, and they have the same one."""
    i, j = TABLES[table]["epsilon"].index(epsilon), WIDTHS.index(x)
    solved = abs(film_numbers(x, abs(epsilon), 0.0, math.copysign(1.0, epsilon))[0])
    assert abs(solved / at_table(table, "sommerfeld", i, j) - 1.0) > 0.04
    assert squeeze_number(x, epsilon) == pytest.approx(solved, rel=0.07)


@pytest.mark.parametrize("x", [0.125, 0.5, 1.0])
@pytest.mark.parametrize("epsilon", [0.01, 0.03, 0.05])
def test_below_the_table_the_formulas_are_still_a_film(x, epsilon):
    """The attitude angle is bounded at 90°, the limit of a film that no groove along the bearing feeds."""
    along, across = film_numbers(x, epsilon, 1.0, 0.0)
    assert epsilon * rotation_number(x, epsilon) == pytest.approx(math.hypot(along, across), rel=0.07)
    assert attitude_angle(x, epsilon) == pytest.approx(math.atan2(across, -along), abs=math.radians(5.0))


# --- the force ---


def test_pure_rotation_and_pure_squeeze_in_newtons():
    epsilon = 0.8
    fx, fy, *_ = film(epsilon * C, 0.0, 0.0, 0.0, 1.0, 5.0)
    force = UNIT * epsilon * rotation_number(X, epsilon) * 6.0
    beta = attitude_angle(X, epsilon)
    assert (fx, fy) == pytest.approx((-force * math.cos(beta), force * math.sin(beta)), rel=1.0e-12)
    for rate, side in ((3.0, epsilon), (-3.0, -epsilon)):
        fx, fy, *_ = film(0.0, epsilon * C, 0.0, rate * C, 0.0, 0.0)
        assert fy == pytest.approx(-UNIT * squeeze_number(X, side) * rate, rel=1.0e-12)
        assert fx == pytest.approx(0.0, abs=1.0e-12 * abs(fy))


@given(state=states)
def test_the_film_never_gives_energy(state):
    _, _, vx, vy, speed_b, speed_j = state
    fx, fy, moment_b, moment_j = film(*state)
    powers = [fx * vx, fy * vy, moment_b * speed_b, moment_j * speed_j]
    assert sum(powers) <= 1.0e-9 * sum(map(abs, powers))


@given(state=states)
def test_action_equals_reaction_in_moments(state):
    fx, fy, moment_b, moment_j = film(*state)
    arm = state[0] * fy, -state[1] * fx
    scale = abs(arm[0]) + abs(arm[1]) + abs(moment_b) + abs(moment_j)
    assert moment_b + moment_j == pytest.approx(-sum(arm), abs=1.0e-12 * scale)


@given(state=states, angle=angles)
def test_the_frame_does_not_matter(state, angle):
    ex, ey, vx, vy, speed_b, speed_j = state
    fx, fy, moment_b, moment_j = film(*state)
    seen = film(*turned(angle, ex, ey), *turned(angle, vx, vy), speed_b, speed_j)
    scale = 1.0e-7 * math.hypot(fx, fy)
    assert tuple(seen[:2]) == pytest.approx(turned(angle, fx, fy), abs=scale)
    assert tuple(seen[2:]) == pytest.approx((moment_b, moment_j), rel=1.0e-7, abs=C * scale)


@given(state=states, spin=spins)
def test_a_rotation_of_all_together_does_nothing(state, spin):
    ex, ey, vx, vy, speed_b, speed_j = state
    still = film(*state)
    turning = film(ex, ey, vx - spin * ey, vy + spin * ex, speed_b + spin, speed_j + spin)
    e = math.hypot(ex, ey)
    if e > 1.0e-9 * C:  # else the direction of e itself is lost in rounding
        rates = abs(spin) + math.hypot(vx, vy) / C + abs(speed_b) + abs(speed_j)
        scale = 1.0e-9 * UNIT * squeeze_number(X, min(e, C - ROUGH) / C) * rates
        assert turning == pytest.approx(still, rel=1.0e-9, abs=scale)


@given(state=states)
def test_a_mirrored_leg_has_a_mirrored_film(state):
    ex, ey, vx, vy, speed_b, speed_j = state
    mirrored = film(ex, -ey, vx, -vy, -speed_b, -speed_j)
    assert mirrored == pytest.approx(film(*state) * [1.0, -1.0, -1.0, -1.0], rel=1.0e-12, abs=1.0e-15)


@given(state=states, share=st.floats(0.0, 1.0))
def test_the_force_is_in_proportion_to_the_viscosity(state, share):
    assert film(*state, eta=share * ETA) == pytest.approx(share * film(*state), rel=1.0e-9, abs=1.0e-300)
    assert not film(*state, eta=0.0).any()


def test_a_centred_journal_has_petroff_s_torque():
    fx, fy, moment_b, moment_j = film(0.0, 0.0, 0.0, 0.0, 1.0, 4.0)
    torque = math.pi * WIDTH * (2.0 * R_J) ** 2 * ETA * 3.0 / (2.0 * PSI)
    assert (fx, fy) == (0.0, 0.0)
    assert (moment_b, moment_j) == pytest.approx((torque, -torque), rel=1.0e-12)


@given(angle=angles, speed=st.floats(1.0e-3, 0.5))
def test_a_centred_journal_is_held_back_in_any_direction(angle, speed):
    vx, vy = turned(angle, speed, 0.0)
    fx, fy, *_ = film(0.0, 0.0, vx, vy, 3.0, -1.0)
    force = UNIT * squeeze_number(X, 0.0) * speed / C
    assert (fx, fy) == pytest.approx(turned(angle, -force, 0.0), abs=1.0e-9 * force)


# --- near the wall, and where the gap opens ---


@given(over=st.floats(0.0, 0.1), rate=speeds)
def test_from_the_roughness_on_the_squeeze_keeps_its_value(over, rate):
    last = film(C - ROUGH, 0.0, rate, 0.0, 0.0, 0.0)
    assert film(C * (1.0 + over), 0.0, rate, 0.0, 0.0, 0.0) == pytest.approx(last, rel=1.0e-9)
    assert np.isfinite(last).all()


@given(state=states)
def test_the_force_is_continuous_in_the_eccentricity(state):
    ex, ey, *rest = state
    if math.hypot(ex, ey) > 1.0e-6 * C:
        before, after = film(ex * (1.0 - 1.0e-9), ey * (1.0 - 1.0e-9), *rest), film(ex, ey, *rest)
        # at the wall the gap of 1.5 um changes by 2e-7 of itself, and numbers go with the gap to -2.5
        assert before == pytest.approx(after, abs=1.0e-5 * np.abs(after).max() + 1.0e-9)


@given(spin=spins, epsilon=st.floats(0.0, 1.0))
def test_the_force_is_continuous_where_the_gap_begins_to_open(spin, epsilon):
    opens, closes = (film(epsilon * C, 0.0, rate, 0.0, 0.0, spin) for rate in (-1.0e-13, 1.0e-13))
    assert opens == pytest.approx(closes, rel=1.0e-3, abs=1.0e-3)


@pytest.mark.parametrize("x", [0.25, 1.0])
@pytest.mark.parametrize("epsilon", [0.7, 0.95])
def test_an_opening_gap_loses_the_rotation_s_push_as_reynolds_equation_does(x, epsilon):
    """Within 30 % of the rotation's force; the plain sum is 70 % off and more, and would give energy."""
    width = x * 2.0 * R_B
    unit = width * 2.0 * R_J * ETA / PSI**2
    spin = np.array(film_numbers(x, epsilon, 1.0, 0.0))
    sums = []
    for rate in (-0.05, -0.1, -0.3, -1.0, -3.0):
        solved = np.array(film_numbers(x, epsilon, 1.0, rate))
        force = film_force(epsilon * C, 0.0, rate * C, 0.0, 0.0, 1.0, C, R_B, width, ETA, ROUGH)
        assert math.dist(np.array(force[:2]) / unit, solved) < 0.3 * math.hypot(*spin)
        added = spin + np.array(film_numbers(x, epsilon, 0.0, rate))
        sums.append(math.dist(added, solved) / math.hypot(*spin))
    assert max(sums) > 0.7


# --- its derivatives, for the implicit step ---

inner = st.tuples(st.floats(0.01, 0.99), angles, speeds, speeds, spins, spins).map(
    lambda s: (*turned(s[1], s[0] * C, 0.0), *s[2:])
)


def rates(state):
    """Rate of epsilon, and epsilon omega_res, of a state [1/s]."""
    ex, ey, vx, vy, speed_b, speed_j = state
    e = math.hypot(ex, ey)
    across = (ex * vy - ey * vx) / e
    return (ex * vx + ey * vy) / e / C, (e * (speed_b + speed_j) - 2.0 * across) / C


@given(state=inner)
def test_damping_is_the_derivative_by_the_rates(state):
    """Exact but where the force has a kink: where the gap begins to open, where rotation turns about."""
    ex, ey, vx, vy, *spin = state
    rate, whirl = rates(state)
    beta = attitude_angle(X, math.hypot(ex, ey) / C)
    assume(min(abs(rate), abs(whirl)) > 1.0)
    assume(rate > 0.0 or abs(abs(whirl) * math.sin(beta) + 2.0 * rate * math.cos(beta)) > 1.0)
    damping = np.reshape(film_damping(*state, C, R_B, WIDTH, ETA, ROUGH), (2, 2))
    step = 1.0e-6
    for i, (dx, dy) in enumerate([(step, 0.0), (0.0, step)]):
        ahead, behind = (film(ex, ey, vx + s * dx, vy + s * dy, *spin)[:2] for s in (1.0, -1.0))
        assert damping[:, i] == pytest.approx(
            (behind - ahead) / (2.0 * step), rel=1.0e-5, abs=1.0e-6 * np.abs(damping).max()
        )


@given(state=inner)
def test_stiffness_is_the_derivative_along_the_line_of_centres(state):
    ex, ey, *rest = state
    stiffness = np.array(film_stiffness(*state, C, R_B, WIDTH, ETA, ROUGH))
    if rates(state)[0] <= 0.0:
        assert not stiffness.any()
        return
    e = math.hypot(ex, ey)
    assume(abs(rates(state)[1]) > 1.0 and attitude_angle(X, e / C) < 0.499 * math.pi)
    part = 1.0e-6 * (C - e) / e
    ahead, behind = (film(ex * (1.0 + s * part), ey * (1.0 + s * part), *rest)[:2] for s in (1.0, -1.0))
    exact = (behind - ahead) / (2.0 * part * e)
    assert stiffness == pytest.approx(exact, abs=2.0e-3 * np.abs(exact).max())


@pytest.mark.parametrize("e", [0.0, C - ROUGH, C, 1.05 * C])
def test_derivatives_are_finite_at_the_centre_and_in_contact(e):
    for v in (0.0, 0.1, -0.1):
        damping = film_damping(e, 0.0, v, 0.0, 0.0, 5.0, C, R_B, WIDTH, ETA, ROUGH)
        assert np.isfinite(damping).all() and damping[0] > 0.0
        assert film_stiffness(e, 0.0, v, 0.0, 0.0, 5.0, C, R_B, WIDTH, ETA, ROUGH) == (0.0, 0.0)
