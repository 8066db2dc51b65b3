"""Signatures of clearances in the drive torque, and the fits behind them."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.estimate.drive import Channel
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton, jackknife, solved
from leg_wear_monitor.estimate.signature import (
    PhaseMeans,
    SimulatedSensor,
    TorqueSensor,
    averaged,
    quiet_phases,
    signature_of_torque,
    signatures,
    simulated_signatures,
    without_scatter,
)
from leg_wear_monitor.estimate.torque_model import body_torques, torque_coefficients
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, ideal_motion, one_cycle
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.references import TorqueReference

# Signatures of gait cycles: laws that hold for any torque.


SENSOR = TorqueSensor(period_s=0.005, cycle_s=1.0, size_nm=10.0)
ANGLE = 2.0 * np.pi * (np.arange(200) + 0.5) / 200


def signature(torque, sensor=SENSOR, angle=ANGLE):
    step = np.diff(torque, prepend=np.nan)
    return signatures(np.zeros(len(torque), np.int64), angle, torque, step, sensor)[0]


@given(constant=st.floats(-30.0, 30.0))
def test_a_constant_torque_shifts_the_means_alone(constant: float) -> None:
    torque = 8.0 * np.sin(3.0 * ANGLE)
    before, after = signature(torque), signature(torque + constant)
    np.testing.assert_allclose(after[:80] - before[:80], constant, atol=1e-9)
    np.testing.assert_allclose(after[80:], before[80:], atol=1e-6)


@given(scale=st.floats(0.2, 3.0))
def test_a_scale_scales_the_means_and_shifts_the_roughness(scale: float) -> None:
    torque = 8.0 * np.sin(7.0 * ANGLE + 1.0)
    before, after = signature(torque), signature(scale * torque)
    np.testing.assert_allclose(after[:80], scale * before[:80], atol=1e-9)
    np.testing.assert_allclose(after[80:] - before[80:], np.log(scale), atol=0.05)  # but for the floor


def test_phases_show_where_the_torque_is_rough() -> None:
    torque = np.zeros(200)
    torque[100:105] = [0.0, 5.0, -5.0, 5.0, 0.0]  # half a turn
    assert np.flatnonzero(signature(torque)[80:] > -2.0).tolist() == [40, 41, 42]


@given(shift=st.floats(-0.2, 0.2))
def test_a_shift_of_the_samples_changes_a_signature_by_little(shift: float) -> None:
    # samples of a leg whose drive has the sensor's clock come at the same angles in each cycle
    torque = np.zeros(200)
    torque[90] = 40.0
    before, after = signature(torque), signature(torque, angle=ANGLE + shift * (ANGLE[1] - ANGLE[0]))
    assert np.abs(after[:80] - before[:80]).max() < 1.2 * abs(shift) / 2.5 * 40.0 / 1.5 + 1e-9


def test_a_peak_counts_as_at_most_eight_times_the_size() -> None:
    torque = np.zeros(200)
    torque[48:58] = 1.0e6
    assert signature(torque).max() == pytest.approx(80.0)


def test_a_lost_sample_leaves_no_step_across_the_gap() -> None:
    torque = np.where(np.pi > ANGLE, 0.0, 50.0)
    step = np.diff(torque, prepend=np.nan)
    step[100] = np.nan
    rough = signatures(np.zeros(200, np.int64), ANGLE, torque, step, SENSOR)[0, 80:]
    assert rough.max() == rough.min()


def test_a_phase_without_samples_is_unknown() -> None:
    found = signature(np.zeros(150), angle=ANGLE[:150])
    assert np.flatnonzero(np.isnan(found[:80])).tolist() == list(range(61, 79))  # 60, 79: beside known ones


@pytest.mark.parametrize("phases", [10, 40, 80])
def test_phase_means_are_those_of_hat_functions(phases: int) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]
    found = PhaseMeans(np.zeros(4000, np.int64), angle, (1, phases)).of(np.cos(angle))[0]
    middles = (np.arange(phases) + 0.5) * 2.0 * np.pi / phases
    width = np.sinc(1.0 / phases) ** 2  # a hat is a box folded with itself
    np.testing.assert_allclose(found, width * np.cos(middles), atol=1e-5)


@pytest.mark.parametrize(
    ("rate_hz", "rpm", "together", "phases"),
    [
        *((1000, 60, 5, 80), (200, 60, 1, 80), (100, 60, 1, 40), (50, 60, 1, 20), (25, 60, 1, 10)),
        (20, 60, 1, 0),
        # beside 60 rpm, hardly fewer than there
        *((1000, 61, 5, 78), (200, 61, 1, 78), (1000, 45, 7, 76), (1000, 40, 8, 75), (100, 45, 1, 53)),
    ],
)
def test_sampling_determines_phases(rate_hz: float, rpm: float, together: int, phases: int) -> None:
    sensor = TorqueSensor(period_s=1.0 / rate_hz, cycle_s=60.0 / rpm, size_nm=10.0)
    assert (sensor.together, sensor.phases) == (together, phases)


@pytest.mark.parametrize("rpm", [60.0, -60.0, 45.0])
@pytest.mark.parametrize("rate_hz", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize("is_instant", [False, True])
@pytest.mark.parametrize("channel", [Channel(), Channel(delay_s=0.01, time_constant_s=0.008)])
def test_a_torque_that_is_added_is_shown_as_the_leg_s_own_is(leg, rpm, rate_hz, is_instant, channel) -> None:
    """Late, filtered, averaged; and a crank that turns backwards is late in its own direction."""
    speed = TURN * rpm / 60.0
    profile = CrankProfile.steady(speed)
    reference = TorqueReference(profile, np.full((1, 5), 3.0e-4), (), LegParameters.none(leg))
    middle = 0.5 * (reference.angle[1:] + reference.angle[:-1])

    def torque(angle):
        return 10.0 * np.cos(angle) + 4.0 * np.sin(3.0 * angle + 0.5)

    reference = attrs.evolve(reference, torque_nm=(np.tile(torque(middle), (8, 1)),))
    sensor = TorqueSensor(1.0 / rate_hz, 60.0 / abs(rpm), 10.0, is_instant=is_instant, channel=channel)
    measured = simulated_signatures(reference, 0, sensor)[1:-1].mean(axis=0)
    shown = signature_of_torque(torque(np.arange(240) * TURN / 240), sensor, speed)
    # phases at the ends of a gait cycle have samples of one side only
    np.testing.assert_allclose(shown[: sensor.phases], measured[: sensor.phases], atol=12.0 / sensor.samples)
    added = SimulatedSensor(reference, 8, sensor).slope(0, torque(np.arange(240) * TURN / 240), 0.1)
    np.testing.assert_allclose(added[: sensor.phases], measured[: sensor.phases], atol=12.0 / sensor.samples)


def test_averaging_keeps_the_mean_of_whole_groups() -> None:
    np.testing.assert_array_equal(averaged(np.arange(7.0), 3), [1.0, 4.0])


def test_quiet_phases_are_the_calmest_third() -> None:
    found = quiet_phases(np.concatenate([np.zeros(6), [3.0, 1.0, 2.0, 6.0, 5.0, 4.0]]))
    assert np.flatnonzero(found).tolist() == [7, 8]


WIDER, OWN, COMMON = np.log([0.8, 1.2, 1.35, 1.5, 2.0, 3.0, 5.0]), np.full(7, 1.0 / 20.0), 1.0 / 40.0


def simulated_changes(random: np.random.Generator, change: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Changes (7, F) of legs whose means over some gait cycles scatter, as that of the expected leg does."""
    own = random.standard_normal(change.shape) * np.sqrt(OWN)[:, None]
    return change + (own - np.sqrt(COMMON) * random.standard_normal(change.shape[1])) @ root.T


@pytest.mark.parametrize("steepness", [0.025, 0.3, 10.0])
def test_a_change_is_off_by_as_much_as_its_scatter_says(steepness: float) -> None:
    """For any covariance, and both for narrower and for wider joints."""
    random = np.random.default_rng(4)
    root = np.tril(random.standard_normal((60, 60))) + 3.0 * np.eye(60)
    sigma = np.sqrt(steepness * np.diff(WIDER[1:], prepend=0.0))
    off, raw = [], []
    for _ in range(40):
        wider = np.cumsum(sigma[:, None] * random.standard_normal((6, 60)), axis=0)
        narrower = np.sqrt(-WIDER[0] * steepness) * random.standard_normal(60)
        true = np.vstack([narrower, wider]) @ root.T
        measured = simulated_changes(random, true, root)
        found, scatter = without_scatter(WIDER, measured, root @ root.T, OWN, COMMON)
        off.append(np.square(np.linalg.solve(root, (found - true).T)).mean(axis=0) / scatter)
        raw.append(np.square(np.linalg.solve(root, (measured - true).T)).mean(axis=0) / scatter)
    np.testing.assert_allclose(np.mean(off, axis=0), 1.0, atol=0.35)
    assert np.mean(off) < np.mean(raw)


def test_what_the_torque_does_not_show_changes_nothing() -> None:
    """Behind a belt, J changes the torque by less than simulated means scatter, and seemed known."""
    random = np.random.default_rng(5)
    measured = simulated_changes(random, np.zeros((7, 160)), np.eye(160))
    found, scatter = without_scatter(WIDER, measured, np.eye(160), OWN, COMMON)
    assert np.square(found).sum() < 0.01 * np.square(measured).sum()
    assert (scatter < 0.1 * (OWN + COMMON)).all()


def test_a_change_of_few_phases_is_kept() -> None:
    """So does J; and most of its change comes before it is half as wide again."""
    random, kept = np.random.default_rng(7), []
    for _ in range(20):
        true = np.zeros((7, 160))
        true[:, :16] = np.sign(WIDER)[:, None] * np.minimum(np.abs(WIDER), 0.4)[:, None]
        true *= 4.0 * random.standard_normal(160)
        found, _ = without_scatter(
            WIDER, simulated_changes(random, true, np.eye(160)), np.eye(160), OWN, COMMON
        )
        kept.append((found * true).sum(axis=1) / np.square(true).sum(axis=1))
    # with one steepness for all entries, 0.72 to 0.91
    assert np.mean(kept, axis=0)[1:].min() > 0.85


@pytest.mark.usefixtures("solve_of_any_numpy")
def test_a_large_change_stays_as_it_is() -> None:
    random = np.random.default_rng(6)
    true = np.abs(WIDER)[:, None] * 20.0 * random.standard_normal(160)
    measured = simulated_changes(random, true, np.eye(160))
    found, scatter = without_scatter(WIDER, measured, np.eye(160), OWN, COMMON)
    assert np.square(found - true).mean() < 1.05 * (OWN + COMMON).mean()
    np.testing.assert_allclose(scatter, OWN + COMMON, rtol=0.2)


# What bodies change of the ideal leg's torque, held against the torque of changed legs.


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


# Laws of the solver: minima that are known, bounds, points that cannot be, and scatter.


def rosenbrock(x: Floats) -> Point:
    rest = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    return Point(rest, lambda: np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]))


def linear(matrix: Floats, values: Floats) -> Callable[[Floats], Point]:
    return lambda x: Point(matrix @ x - values, lambda: matrix)


def test_a_curved_valley_is_followed_to_its_end() -> None:
    found = gauss_newton(rosenbrock, np.array([-1.2, 1.0]))
    np.testing.assert_allclose(found.x, 1.0, atol=1e-9)


def test_a_linear_model_has_its_solution_and_covariance_after_one_step() -> None:
    random = np.random.default_rng(5)
    matrix, values = random.standard_normal((40, 3)) * [1.0, 1.0e3, 1.0e-3], random.standard_normal(40)
    found = gauss_newton(linear(matrix, values), np.zeros(3))
    np.testing.assert_allclose(found.x, np.linalg.lstsq(matrix, values, rcond=None)[0], rtol=1e-9)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(matrix.T @ matrix), rtol=1e-9)


def test_bounds_hold_and_a_bounded_step_is_shorter() -> None:
    at = linear(np.eye(2), np.array([5.0, -5.0]))
    assert gauss_newton(at, np.zeros(2), low=-1.0, high=2.0).x.tolist() == [2.0, -1.0]
    one = gauss_newton(at, np.zeros(2), longest=0.5, done=0.6)  # so the first step is the last
    assert one.x.tolist() == [0.5, -0.5]


@pytest.mark.parametrize("seed", range(20))
def test_the_least_square_in_a_box_is_found_where_columns_are_correlated(seed: int) -> None:
    """By its law: downhill is inside only where it is out of the box."""
    random = np.random.default_rng(seed)
    matrix = random.standard_normal((40, 4)) @ (np.eye(4) + 0.9)
    at = linear(matrix, matrix @ random.uniform(-2.0, 2.0, 4) + random.standard_normal(40))
    found = gauss_newton(at, np.zeros(4), low=-1.0, high=1.0)
    downhill = -matrix.T @ found.point.rest
    inside = np.abs(found.x) < 1.0
    np.testing.assert_allclose(downhill[inside], 0.0, atol=1e-5)
    assert (downhill * found.x)[~inside].min(initial=0.0) >= 0.0


def test_a_point_that_cannot_be_is_not_gone_to() -> None:
    def at(x: Floats) -> Point:
        return Point(np.array([x[0] - 3.0 if x[0] < 2.0 else np.inf]), lambda: np.eye(1))

    assert 1.8 < gauss_newton(at, np.zeros(1)).x[0] < 2.0


def test_columns_of_any_size_are_solved_for_several_values_at_once() -> None:
    random = np.random.default_rng(6)
    matrix = random.standard_normal((20, 3)) * [1.0e-4, 1.0, 1.0e4]
    true = random.standard_normal((3, 2))
    np.testing.assert_allclose(solved(matrix, matrix @ true), true, rtol=1e-6)
    np.testing.assert_allclose(solved(matrix, matrix @ true[:, 0]), true[:, 0], rtol=1e-6)


def test_leaving_out_parts_gives_the_scatter_of_a_mean() -> None:
    values = np.random.default_rng(7).standard_normal(600)
    (sigma,) = jackknife(lambda some: np.array([values[some].mean()]), len(values), 600)
    assert sigma == pytest.approx(values.std(ddof=1) / np.sqrt(len(values)), rel=1e-6)
