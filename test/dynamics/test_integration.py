"""Parts of a run: solver, method, step control, sums, and one clearance joint."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.contact.arrays import ContactArrays, clearance_settings, compile_contacts
from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.contact.laws import LAWS
from leg_wear_monitor.dynamics.clearance.advance import inverse_cube_root
from leg_wear_monitor.dynamics.full_run import NO_TOE, factorise, ideal_toe, interpolate, substitute
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
from leg_wear_monitor.dynamics.run import (
    DEGREE,
    DRIVE_RATES,
    FORCE,
    JOINT_RATES,
    STAGES,
    TORQUE,
    add_step,
    begin_impact,
    bin_of,
    drive_at,
    end_impact,
    error_norm,
    hermite,
    new_run_statistics,
    next_step,
    parabola_peak,
    percentile,
    raise_peak,
    signed_percentile,
    stage_state,
)
from leg_wear_monitor.mechanism.position import TURN, ideal_motion, point_motion
from leg_wear_monitor.wear import SECTORS, Surfaces, local_surfaces

# Parts of the integration: solver, method, crank motion, control of the step, the ideal toe.


# Cholesky inside an envelope gives what dense algebra gives.


@st.composite
def systems(draw):
    """First columns of an envelope, and a positive definite matrix that fills it."""
    m = draw(st.integers(1, 12))
    first = np.array([draw(st.integers(0, i)) for i in range(m)])
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    factor = np.tril(rng.uniform(-1.0, 1.0, (m, m)))
    factor[np.arange(m)[None, :] < first[:, None]] = 0.0
    np.fill_diagonal(factor, rng.uniform(0.5, 2.0, m))
    return first, factor @ factor.T, rng.uniform(-1.0, 1.0, m)


@given(systems())
def test_solution_is_numpys_and_nothing_outside_the_envelope_is_read(system):
    first, matrix, b = system
    lower, x = np.tril(matrix), b.copy()
    lower[np.arange(len(b))[None, :] < first[:, None]] = np.nan
    lower[np.triu_indices(len(b), 1)] = np.nan
    assert factorise(first, lower)
    substitute(first, lower, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1.0e-6, atol=1.0e-8)


@given(systems(), st.data())
def test_a_matrix_that_is_not_positive_definite_is_told(system, data):
    first, matrix, b = system
    lower = np.tril(matrix)
    i = data.draw(st.integers(0, len(b) - 1))
    lower[i, i] = -1.0e-9
    assert not factorise(first, lower)


# The integrator's own promises.


coefficients = arrays(float, 4, elements=st.floats(-10.0, 10.0))


def _oscillator(steps):
    """Error of the unit circle's point at t = 2 after equal steps."""
    y, h, k = np.array([1.0, 0.0]), 2.0 / steps, np.zeros((STAGES, 2))
    for _ in range(steps):
        stage = np.empty(2)
        for s in range(STAGES):
            stage_state(s, h, y, k, stage)
            k[s] = stage[1], -stage[0]
        y = stage.copy()  # first same as last: the last stage is the step's end
    return np.hypot(y[0] - np.cos(2.0), y[1] + np.sin(2.0))


def test_order_is_five():
    assert np.log2(_oscillator(8) / _oscillator(16)) == pytest.approx(5.0, abs=0.3)


def test_error_estimate_is_of_order_five():
    """The estimate is the fourth-order solution's local error: 32 times less at half the step."""
    norms = []
    for h in (0.2, 0.1):
        k, stage = np.zeros((STAGES, 2)), np.empty(2)
        for s in range(STAGES):
            stage_state(s, h, np.array([1.0, 0.3]), k, stage)
            k[s] = stage[1], -stage[0]
        norms.append(error_norm(h, k, np.ones(2)))
    assert np.log2(norms[0] / norms[1]) == pytest.approx(5.0, abs=0.3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_no_small_error(bad):
    k = np.zeros((STAGES, 3))
    k[2, 1] = bad
    assert error_norm(0.1, k, np.ones(3)) == np.inf
    assert next_step(0.1, np.inf, 5.0) < 0.1


@given(error=st.floats(0.0, 1.0e20), h=st.floats(1.0e-12, 1.0))
def test_step_shrinks_after_a_failure_and_grows_within_bounds(error, h):
    new = next_step(h, error, 5.0)
    assert 0.1 * h <= new <= 5.0 * h
    assert new < h or error <= 1.0


@given(c=coefficients, h=st.floats(1.0e-3, 10.0), u=st.floats(0.0, 1.0))
def test_hermite_reproduces_cubics(c, h, u):
    curve = np.polynomial.Polynomial(c)
    slope = curve.deriv()
    value, rate = hermite(u, h, curve(0.0), slope(0.0), curve(h), slope(h))
    size = 1.0 + np.abs(c).sum() * max(1.0, h) ** 3
    assert value == pytest.approx(curve(u * h), abs=1.0e-12 * size)
    assert rate == pytest.approx(slope(u * h), abs=1.0e-11 * size / h)


# The crank's polynomial and its derivatives.


@given(
    c=arrays(float, DEGREE + 1, elements=st.floats(-10.0, 10.0)),
    since=st.floats(-5.0, 5.0),
    t=st.floats(-5.0, 5.0),
)
def test_speed_and_acceleration_are_derivatives_of_the_angle(c, since, t):
    drive = np.empty(3)
    drive_at(np.array([since, *c]), t, drive)
    angle = np.polynomial.Polynomial(c)
    wanted = [curve(t - since) for curve in (angle, angle.deriv(), angle.deriv(2))]
    np.testing.assert_allclose(
        drive, wanted, rtol=1.0e-9, atol=1.0e-9 * (1.0 + np.abs(c).sum()) * 10.0**DEGREE
    )


# Control of the step.


@given(st.floats(-300.0, 300.0).map(lambda power: 10.0**power))
def test_the_inverse_cube_root(x):
    assert inverse_cube_root(x) ** 3 * x == pytest.approx(1.0, abs=4.0e-5)


# The ideal toe's table.


@pytest.fixture(scope="module")
def toe(linkage_of):
    return ideal_toe(linkage_of("bionic_leg"), TURN)


def test_between_its_points_the_table_is_the_ideal_motion(linkage_of, toe):
    linkage = linkage_of("bionic_leg")
    angles = np.linspace(0.3, 6.0, 17)
    motion = ideal_motion(linkage, angles, TURN)
    wanted = np.column_stack([*point_motion(motion, linkage, *linkage.mechanism.toe), motion.drive_torque])
    for column in range(7):
        got = [interpolate(toe.ideal, column, angle) for angle in angles]
        np.testing.assert_allclose(got, wanted[:, column], atol=1.0e-8 * np.ptp(toe.ideal[:, column]))


@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_the_table_is_periodic_and_exact_at_its_points(toe, turns):
    n = len(toe.ideal)
    for i in (0, 1, n // 2, n - 1):
        got = interpolate(toe.ideal, 0, TURN * (turns + i / n))
        assert math.isclose(got, toe.ideal[i, 0], rel_tol=1.0e-10)


def test_nothing_to_compare_without_a_toe(linkage_of):
    assert ideal_toe(linkage_of("slider_crank"), 1.0) is NO_TOE


# Sums of a run against numpy's on the same samples.


BIN = 1.0085  # ratio of two bins' magnitudes

magnitudes = arrays(float, st.integers(1, 200), elements=st.floats(1.0e-3, 1.0e5))
signed = st.tuples(st.sampled_from([-1.0, 1.0]), st.floats(1.0e-3, 1.0e5)).map(np.prod)
fractions = st.floats(0.0, 1.0, exclude_min=True)


def _histogram(samples):
    """Equal time at each sample."""
    seconds = np.zeros(new_run_statistics(1).force_time.shape[1])
    for sample in samples:
        seconds[bin_of(sample)] += 0.001
    return seconds


@given(samples=magnitudes, fraction=fractions)
def test_percentile_divides_the_time_to_the_width_of_a_bin(samples, fraction):
    got = percentile(_histogram(samples), fraction)
    assert np.mean(samples <= got * BIN) >= fraction - 1.0e-9
    assert np.mean(samples < got / BIN) <= fraction + 1.0e-9


@given(samples=st.lists(signed, min_size=2, max_size=60).map(np.array), fraction=fractions)
def test_signed_percentile_divides_the_time_too(samples, fraction):
    below, above = -samples[samples < 0.0], samples[samples > 0.0]
    got = signed_percentile(np.array([_histogram(below), _histogram(above)]), fraction)
    slack = (BIN - 1.0) * abs(got)
    assert np.mean(samples <= got + slack) >= fraction - 1.0e-9
    assert np.mean(samples < got - slack) <= fraction + 1.0e-9


def test_percentile_of_nothing_is_nothing():
    assert percentile(_histogram([]), 0.99) == 0.0
    assert signed_percentile(np.zeros((2, 16)), 0.99) == 0.0


@given(rates=arrays(float, (4, 2, JOINT_RATES), elements=st.floats(0.0, 1.0e3)), h=st.floats(1.0e-9, 1.0e-3))
def test_a_step_adds_its_quadrature_and_its_end(rates, h):
    statistics, weights = new_run_statistics(2), np.array([0.5, 0.0, 0.3, 0.2])
    drive = -rates[:, 0, :DRIVE_RATES]
    for _ in range(2):
        add_step(statistics, h, weights, rates, drive)
    assert statistics.time[0] == pytest.approx(2.0 * h)
    mean = np.tensordot(weights, rates, axes=1)
    np.testing.assert_allclose(statistics.integral, 2.0 * h * mean, atol=1.0e-15)
    np.testing.assert_allclose(statistics.drive_integral, 2.0 * h * (weights @ drive), atol=1.0e-15)
    np.testing.assert_array_equal(statistics.peak, rates[-1, :, FORCE])
    np.testing.assert_array_equal(statistics.drive_range, drive[-1, TORQUE])
    assert statistics.force_time.sum(axis=1) == pytest.approx(2.0 * h)
    assert statistics.torque_time.sum() == pytest.approx(2.0 * h)


@given(
    apex=st.floats(-1.0, 1.0), top=st.floats(-1.0e4, 1.0e4), sharp=st.floats(0.1, 1.0e4),
    before=st.floats(0.11, 1.0), gap=st.floats(0.11, 1.0), fraction=st.floats(0.0, 1.0),
)  # fmt: skip
def test_peak_of_a_parabola_is_exact(apex, top, sharp, before, gap, fraction):
    """Three samples of which the middle one is largest, wherever the apex lies among them."""
    middle = apex + (fraction - 0.5) * min(before, gap)
    t = np.array([middle - before, middle, middle + gap])
    f = top - sharp * (t - apex) ** 2
    got = parabola_peak(t[0], f[0], t[1], f[1], t[2], f[2])
    assert got == pytest.approx(top, abs=1.0e-9 * (abs(top) + np.abs(f).max() + sharp / min(before, gap)))


@given(
    start=st.floats(0.0, 5.0e3), jump=st.floats(0.0, 50.0), end=st.floats(0.0, 5.0e3),
    long=st.floats(1.0e-7, 1.0e-3), ratio=st.floats(1.0e-9, 1.0), earlier=st.booleans(),
)  # fmt: skip
def test_a_jump_over_a_short_step_is_no_peak(start, jump, end, long, ratio, earlier):
    """Deposited wear lowers the force at once; the peak stays at the samples' size for any two steps."""
    middle, short = max(start, end) + jump, long * ratio
    first, second = (long, short) if earlier else (short, long)
    peak = parabola_peak(0.0, start, first, middle, first + second, end)
    assert middle <= peak <= middle + 3.0 * (middle - min(start, end))


def test_three_samples_in_a_line_have_no_other_peak():
    assert parabola_peak(0.0, 2.0, 1.0, 2.0, 2.0, 2.0) == 2.0


def test_an_impact_is_noted_from_begin_to_end():
    statistics = new_run_statistics(2)
    impact, impacts = statistics.impact, statistics.impacts
    begin_impact(impact, impacts, 1, 0.1, 0.5)
    raise_peak(statistics.peak, impact, impacts, 1, 30.0)
    raise_peak(statistics.peak, impact, impacts, 1, 20.0)
    assert np.isnan(impact[1, 0, 2])
    end_impact(impact, impacts, 1, 0.2)
    raise_peak(statistics.peak, impact, impacts, 1, 99.0)  # no contact any more: the impact keeps its peak
    end_impact(impact, impacts, 1, 0.3)
    np.testing.assert_array_equal(impact[1, 0], [0.1, 0.5, 0.2, 30.0])
    assert list(impacts) == [0, 1]


def test_impacts_beyond_the_room_are_counted():
    statistics = new_run_statistics(1)
    room = statistics.impact.shape[1]
    for i in range(room + 5):
        begin_impact(statistics.impact, statistics.impacts, 0, float(i), 1.0)
        end_impact(statistics.impact, statistics.impacts, 0, i + 0.5)
    assert statistics.impacts[0] == room + 5
    assert statistics.impact[0, -1, 0] == room - 1.0


# One clearance joint: its normal force has a potential, and contacts within a step are seen.


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


WHOLE_TURN = 2.0 * math.pi
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
    centres = (np.arange(SECTORS) + 0.5) * WHOLE_TURN / SECTORS
    depth = [
        rng.uniform(0.0, 3.0e-4) * np.exp(4.0 * (np.cos(centres - rng.uniform(0, WHOLE_TURN)) - 1.0))
        for _ in "bj"
    ]
    return Surfaces(np.array([depth]), 1)


@given(
    direction=angles, angle_b=angles, angle_j=angles, delta=st.floats(1.0e-6, 1.0e-5), seed=st.integers(0, 9)
)
def test_the_normal_force_is_the_gradient_of_the_contact_energy(
    elastic, direction, angle_b, angle_j, delta, seed
):
    """By the eccentricity, and by the angles of both bodies: a worn bushing that turns lifts like a cam."""
    sector = (direction - np.array([angle_b, angle_j])) * SECTORS / WHOLE_TURN
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
