"""Estimates by the drive torque: signatures and fits, the drive's channel, changes of clearances."""

import math
from collections.abc import Callable

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from leg_wear_monitor.estimate.channel import channel_of
from leg_wear_monitor.estimate.clearance_fit import FACTORS, ChangeDetector, excess, fit_clearances, threshold
from leg_wear_monitor.estimate.drive import DIRECT, Channel, DriveFigures
from leg_wear_monitor.estimate.explanations import Baseline, Explainer
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton, jackknife, solved
from leg_wear_monitor.estimate.leg_model import (
    commissioned_baseline,
    nuisances,
    parts_left_out,
    with_scatter_of,
)
from leg_wear_monitor.estimate.signature import (
    Changes,
    CommissionedTorque,
    PhaseMeans,
    SignatureModel,
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
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.references import TorqueReference

# Signatures of clearances in the drive torque, and the fits behind them.


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


# The channel of a drive from a mean signature: found in the air, half observable on the ground, declared.


HZ = 35.0
DRIVE = Channel(delay_s=0.0075, time_constant_s=1.0 / (TURN * HZ), load_friction=0.2)


@pytest.fixture(scope="module")
def known(leg):
    reference = shipped_references(leg)[0]
    sensor = TorqueSensor(0.005, 1.0, torque_size(build_linkage(leg), TURN), noise_nm=0.5)
    return reference, sensor, nuisances(leg, reference, sensor)


def behind(known, channel: Channel) -> np.ndarray:
    """Mean signature of the leg as expected behind a drive, in gait cycles that the search does not use."""
    reference, sensor, _ = known
    return simulated_signatures(reference, 0, attrs.evolve(sensor, channel=channel))[20:].mean(axis=0)


def test_lag_low_pass_and_load_friction_are_found_in_the_air(known):
    reference, sensor, columns = known
    found = channel_of(reference, sensor, behind(known, DRIVE), columns)
    assert found.channel.lateness_s == pytest.approx(DRIVE.lateness_s, abs=0.0025)
    assert found.channel.load_friction == pytest.approx(0.2, abs=3.0 * found.load_friction_sigma)
    assert found.load_friction_sigma < 0.04


@pytest.mark.parametrize(("hz", "delay_s"), [(17.0, 0.0), (22.4, 0.0), (29.6, 0.0072)])
def test_a_low_pass_is_found_whatever_its_corner_frequency(known, hz, delay_s):
    """Such corner frequencies are the furthest from those with which the search begins."""
    reference, sensor, columns = known
    drive = Channel(delay_s=delay_s, time_constant_s=1.0 / (TURN * hz))
    found = channel_of(reference, sensor, behind(known, drive), columns).channel
    assert found.time_constant_s == pytest.approx(drive.time_constant_s, rel=0.05)
    assert found.lateness_s == pytest.approx(drive.lateness_s, abs=0.0003)


@pytest.mark.parametrize("hz", [15.0, 20.0])
def test_a_low_pass_of_second_order_is_found(known, hz):
    """One of first order would be 1.9 to 2.9 ms later, and leave 12 to 22 times the mean square."""
    reference, sensor, columns = known
    drive = Channel(time_constant_s=math.sqrt(2.0) / (TURN * hz), second_order=0.5)
    found = channel_of(reference, sensor, behind(known, drive), columns)
    assert found.channel.bandwidth_hz == pytest.approx(hz, rel=0.05)
    assert found.channel.lateness_s == pytest.approx(drive.lateness_s, abs=0.0005)
    assert found.square < 0.1


@pytest.mark.parametrize(("second_order", "order"), [(0.0, 1), (0.5, 2)])
def test_low_passes_are_those_of_butterworth(second_order, order):
    time_constant_s = math.sqrt(order) / (TURN * 20.0)
    channel = Channel(time_constant_s=time_constant_s, second_order=second_order)
    omega = TURN * np.array([1.0, 20.0, 100.0])
    _, expected = signal.freqs(*signal.butter(order, TURN * 20.0, analog=True), omega)
    np.testing.assert_allclose(channel.response(omega), expected)
    assert channel.bandwidth_hz == pytest.approx(20.0)
    two = Channel(time_constant_s=2.0 * time_constant_s, second_order=0.25)  # in a row
    one = Channel(time_constant_s=time_constant_s)
    np.testing.assert_allclose(two.response(omega), one.response(omega) ** 2)
    assert abs(two.response(np.array([TURN * two.bandwidth_hz])))[0] == pytest.approx(math.sqrt(0.5))
    assert math.isinf(DIRECT.bandwidth_hz)


@pytest.mark.parametrize("channel", [pytest.param(DIRECT, marks=pytest.mark.slow), DRIVE])
def test_a_leg_that_is_commissioned_with_a_worn_joint_has_its_right_channel(known, leg, channel):
    """Lateness, by joints: 1.0 ± 0.1 and 0.8 ± 0.1 ms RMS (25 draws of cycles); 1.9 if as modelled."""
    reference, sensor, columns = known
    behind_it, off_s = attrs.evolve(sensor, channel=channel), []
    for k in range(len(leg.clearance_joints)):
        worn = int(np.argmin(np.abs(reference.clearance_m[:, k] - 1.5 * reference.clearance_m[0, k])))
        measured = simulated_signatures(reference, worn, behind_it).mean(axis=0)
        found = channel_of(reference, sensor, measured, columns)
        off_s.append(found.channel.lateness_s - channel.lateness_s)
        assert found.channel.load_friction == pytest.approx(
            channel.load_friction, abs=3.0 * found.load_friction_sigma
        )
    assert np.sqrt(np.mean(np.square(off_s))) < 0.0017


def test_a_direct_drive_has_no_channel(known):
    reference, sensor, columns = known
    assert channel_of(reference, sensor, behind(known, DIRECT), columns).channel == DIRECT


def test_under_an_unknown_load_the_lag_is_found_and_the_load_friction_is_not_observable(known):
    reference, sensor, columns = known
    phase = (np.arange(sensor.phases) + 0.5) / sensor.phases
    stance = np.concatenate(
        [60.0 * np.clip(np.sin(TURN * (phase - 0.1)), 0.0, None), np.zeros(sensor.phases)]
    )
    measured = behind(known, attrs.evolve(DRIVE, load_friction=0.0)) + stance
    found = channel_of(reference, sensor, measured, columns)
    assert found.channel.lateness_s == pytest.approx(DRIVE.lateness_s, abs=0.0025)
    assert found.channel.load_friction == 0.0
    assert math.isnan(found.load_friction_sigma)


def test_declared_figures_are_used(known):
    reference, sensor, columns = known
    figures = DriveFigures(bandwidth_hz=HZ, load_friction=0.2)
    found = channel_of(reference, sensor, behind(known, DRIVE), columns, figures)
    assert found.channel.time_constant_s == DRIVE.time_constant_s
    assert found.channel.delay_s == pytest.approx(DRIVE.delay_s, abs=0.0013)
    assert found.channel.load_friction == pytest.approx(0.2, abs=0.05)
    assert figures.lateness_s == pytest.approx(DRIVE.time_constant_s)


def test_a_drive_that_rubs_takes_power_whichever_way_the_power_flows():
    """The motor drives with more than the leg takes, and is driven by less than the leg gives."""
    torque = np.array([10.0, -10.0, 0.0])
    rubbing = Channel(load_friction=0.3)
    np.testing.assert_allclose(rubbing.received(torque, 0.01, 1.0), [13.0, -7.0, 0.0])
    np.testing.assert_allclose(rubbing.received(torque, 0.01, -1.0), [7.0, -13.0, 0.0])


def test_a_drive_without_a_declared_stiffness_or_a_large_one_is_rigid():
    assert DriveFigures().compliance == DriveFigures(stiffness_nm_per_rad=1.0e5).compliance == 0.0
    assert DriveFigures(stiffness_nm_per_rad=1000.0).compliance == pytest.approx(1.0e-3)


# CUSUM tests on signatures of which the statistics are known.


NEW = np.array([3.0e-4, 3.0e-4])
F = 12


def model(entries: int = F) -> SignatureModel:
    """Two joints whose signatures are linear in the logarithm of their clearances."""
    random = np.random.default_rng(1)
    grid = np.tile(NEW[0] * np.array([1.0, 2.0, 5.0]), (2, 1))
    slopes = random.standard_normal((2, entries))
    change = np.log(grid / NEW[0])[:, :, None] * 4.0 * slopes[:, None, :]
    sensor = TorqueSensor(0.005, 1.0, 10.0)
    return SignatureModel(
        sensor, random.standard_normal(entries), Changes(grid, change), np.eye(entries), 1.0e-9
    )


def detector(hours: float = 240.0) -> ChangeDetector:
    none = Baseline(np.zeros(F), np.zeros((F, F)))
    return ChangeDetector(Explainer(model(), ("A", "B"), none, ()), NEW, 3600.0 * hours)


def walked(tests, clearance, cycles, seed, begin=0):
    """State after some cycles, and the cycles until a detection."""
    random, state = np.random.default_rng(seed), tests.fresh()
    mean = model().at(np.asarray(clearance))[0]
    for i in range(cycles):
        state = tests.with_cycle(state, mean + random.standard_normal(F), begin + 1 + i)
        found = tests.detected_ns(state)
        if found:
            return state, found, i + 1
    return state, 0, cycles


def test_the_threshold_grows_with_the_time_between_false_alarms_and_with_the_tests() -> None:
    assert threshold(math.e, 1) == pytest.approx(1.0)
    assert threshold(1000.0, 20) == pytest.approx(math.log(20_000.0))


@pytest.mark.parametrize("k", [0, 1])
def test_the_widest_joint_that_is_not_seen_is_the_last_that_is_not_found(k: int) -> None:
    """Within as many gait cycles, on a leg that shows 0.8 of what the model expects."""
    tests, own, cycles = detector(), model(), 8
    unseen = tests.unseen_m(cycles)[k]
    after = FACTORS[int(np.searchsorted(FACTORS, unseen / NEW[k] + 1e-9))]
    for size, least, most in ((unseen, 0, 11), (after * NEW[k], 14, 20)):
        wide, found = NEW.copy(), 0
        wide[k] = size
        mean = own.mean + 0.8 * (own.at(wide)[0] - own.mean)
        for seed in range(20):
            random, state = np.random.default_rng(seed), tests.fresh()
            for i in range(round(1.3 * cycles)):
                state = tests.with_cycle(state, mean + random.standard_normal(F), 1 + i)
            found += tests.detected_ns(state) > 0
        assert least <= found <= most


def test_a_joint_that_the_torque_does_not_show_is_never_seen() -> None:
    own = model()
    change = own.joints.change * np.array([1.0, 0.0])[:, None, None]
    hidden = attrs.evolve(own, joints=attrs.evolve(own.joints, change=change))
    none = Baseline(np.zeros(F), np.zeros((F, F)))
    tests = ChangeDetector(Explainer(hidden, ("A", "B"), none, ()), NEW, 1e6)
    unseen = tests.unseen_m(10**6)
    assert unseen[0] == NEW[0]
    assert unseen[1] == FACTORS[-1] * NEW[1]


def test_false_alarms_are_as_rare_as_chosen() -> None:
    """With a chosen mean of 200 cycles, in 6000 cycles at most 30 are expected; the bound is conservative."""
    tests, alarms = detector(200.0 / 3600.0), 0
    random, state, mean = np.random.default_rng(5), tests.fresh(), model().mean
    for i in range(6000):
        state = tests.with_cycle(state, mean + random.standard_normal(F), i + 1)
        if tests.detected_ns(state):
            alarms, state = alarms + 1, tests.fresh()
    assert alarms <= 30


@pytest.mark.parametrize("k", [0, 1])
def test_a_wider_joint_is_detected_within_a_few_cycles_and_named(k: int) -> None:
    for seed in range(20):
        wide = NEW.copy()
        wide[k] *= 1.5
        state, found, cycles = walked(detector(), wide, 100, seed)
        assert found
        assert cycles <= 20
        assert int(state.sums.argmax()) // len(FACTORS) == k


def test_two_cycles_alone_raise_nothing() -> None:
    tests, strange = detector(), model().at(5.0 * NEW)[0]
    state = tests.fresh()
    for i in (1, 2):
        state = tests.with_cycle(state, strange, i)
        assert not tests.detected_ns(state)
    assert tests.detected_ns(tests.with_cycle(state, strange, 3))


def test_since_is_the_begin_of_the_change() -> None:
    tests, random = detector(), np.random.default_rng(2)
    state, wide = tests.fresh(), model().at(np.array([6.0e-4, 3.0e-4]))[0]
    for i in range(40):
        mean = model().mean if i < 30 else wide
        state = tests.with_cycle(state, mean + random.standard_normal(F), 1000 + i)
        found = tests.detected_ns(state)
        if found:
            break
    assert 1028 <= found <= 1030


def test_the_offset_of_a_commissioned_leg_is_not_taken_for_a_clearance() -> None:
    own, offset = model(), 5.0 * np.random.default_rng(3).standard_normal(F)
    explainer = Explainer(own, ("A", "B"), Baseline(offset, np.zeros((F, F))), ())
    wide = np.array([6.0e-4, 3.0e-4])
    found = fit_clearances(explainer, own.at(wide)[0] + offset, 100, NEW, NEW)
    assert found.clearance_m == pytest.approx(wide, rel=0.02)


def test_later_cycles_scatter_as_the_tests_expect() -> None:
    """Seen before: tests expected half of it, since their covariance was made of the cycles they knew."""
    entries = 160
    legs, found = model(entries), []
    for seed in range(40):
        random = np.random.default_rng(seed)
        root = np.eye(entries) + 0.08 * random.standard_normal((entries, entries))
        known, later = (legs.mean + random.standard_normal((n, entries)) @ root.T for n in (50, 2000))
        own = attrs.evolve(legs, covariance=with_scatter_of(legs.covariance, known))
        baseline = commissioned_baseline(
            CommissionedTorque(1, NEW, known),
            legs.mean,
            own.covariance,
            parts_left_out(legs.covariance, known),
        )
        tests = ChangeDetector(Explainer(own, ("A", "B"), baseline, ()), NEW, 1000.0)
        ratio = (later - later.mean(axis=0)) @ tests._weighted.T / np.sqrt(tests._excess)
        supposed = ((tests._weighted @ own.covariance) * tests._weighted).sum(axis=1)
        there = supposed > 0.0
        found.append((ratio.var(axis=0)[there] / supposed[there]).mean())
    # 0.98, with a standard error of 0.024; 1.45 before
    assert 0.85 < np.mean(found) < 1.12


def test_a_leg_that_scatters_more_than_expected_counts_less() -> None:
    random = np.random.default_rng(4)
    found = excess(random.standard_normal((4000, 3)) * [0.5, 1.0, 2.0])
    assert found == pytest.approx([1.0, 1.0, 4.0], rel=0.1)
    assert excess(np.zeros((0, 3))).tolist() == [1.0, 1.0, 1.0]
    alternating = np.tile([[1.0], [-1.0]], (50, 1))  # neighbours that cancel add up to nothing
    assert excess(alternating).tolist() == [1.0]
