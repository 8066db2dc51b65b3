"""Full coordinates: their equations, the motion, and what it must do whatever the leg."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.full_run import (
    BAUMGARTE,
    TOLERANCE_M,
    FullRun,
    accelerate,
    add_contacts,
    eccentricity,
    full_model,
    full_scratch,
)
from leg_wear_monitor.dynamics.joint import joint_force
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    DISSIPATION,
    FRICTION,
    JOINT_RATES,
    POWER,
    TORQUE,
    new_run_statistics,
    steady_drive,
)
from leg_wear_monitor.dynamics.simulation import prepare, simulate
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.constraints import closures, closures_at, rotations
from leg_wear_monitor.mechanism.loader import parse_mechanism
from leg_wear_monitor.mechanism.position import TURN, dense_jacobian, one_cycle
from leg_wear_monitor.wear import SECTORS, Surfaces

# Full coordinates: their equations, and the motion.


# Equations of motion: structure against dense algebra, and what contact forces may and may not do.


pytestmark = pytest.mark.slow  # kernels that only tests call are compiled for it

CLEARANCE_JOINTS = ("A", "B", "G", "I", "J")
APPROACH = np.full(len(CLEARANCE_JOINTS), 0.2)

phases = st.integers(0, 35)
# m and rad: enough to bring journals into contact and others out of it
offsets = arrays(float, (8, 3), elements=st.floats(-4.0e-4, 4.0e-4))
velocities = arrays(float, (8, 3), elements=st.floats(-3.0, 3.0))


@pytest.fixture(scope="module")
def cycle(linkage_of):
    return one_cycle(linkage_of("bionic_leg"), 36, TURN)


@pytest.fixture(scope="module")
def model(leg, linkage_of):
    contacts = compile_contacts(leg, CLEARANCE_JOINTS, clearance_settings(leg, CLEARANCE_JOINTS))
    return full_model(linkage_of("bionic_leg").arrays, contacts, driven=True)


@pytest.fixture(scope="module")
def worn():
    """Surfaces with some micrometres of uneven wear that opens the clearances."""
    rng, centres = np.random.default_rng(3), np.arange(SECTORS) * TURN / SECTORS
    waves = [[1.0 + np.cos(centres * n + shift) for shift in rng.uniform(0, TURN, 2)] for n in range(1, 6)]
    return Surfaces(5.0e-6 * np.array(waves), 1)


def _state(cycle, phase, offset, velocity):
    """A state near the ideal motion; the ground stays where it is."""
    q, v = cycle.q[phase] + offset, cycle.v[phase] + velocity
    q[0] = v[0] = 0.0
    return q, v


def _contacts(model, surfaces, q, v):
    """Generalised contact forces (n, 3) and the rates of the integrals."""
    scratch, rate = full_scratch(model), np.zeros((10, JOINT_RATES))
    rotations(q, scratch.cs)
    add_contacts(model, surfaces, APPROACH, q, v, scratch, rate)
    return scratch.force, rate, scratch.cs


def _forces(model, surfaces, k, q, v, cs):
    """Normal and tangential force, delta_dot and slip of clearance joint k."""
    ex, ey, vx, vy, b, j, _, _ = eccentricity(model, k, q, v, cs)
    f_n, f_t, _, delta_dot, slip, *_ = joint_force(
        model.contacts, surfaces, k, ex, ey, vx, vy, q[b, 2], q[j, 2], v[b, 2], v[j, 2], APPROACH[k]
    )
    return f_n, f_t, delta_dot, slip


@given(phase=phases, offset=offsets, velocity=velocities)
def test_contact_is_action_and_reaction_moments_included(model, worn, cycle, phase, offset, velocity):
    """All forces, the ground's too, sum to nothing; so do their moments about the origin, hence any point."""
    q, v = _state(cycle, phase, offset, velocity)
    force, _, _ = _contacts(model, worn, q, v)
    size = np.abs(force).max()
    np.testing.assert_allclose(force[:, :2].sum(axis=0), 0.0, atol=1.0e-12 * size)
    moment = force[:, 2] + q[:, 0] * force[:, 1] - q[:, 1] * force[:, 0]
    assert abs(moment.sum()) <= 1.0e-12 * size


@given(phase=phases, offset=offsets, velocity=velocities)
def test_contact_does_no_work_but_that_of_its_two_forces(model, worn, cycle, phase, offset, velocity):
    """Generalised forces times velocities = sum of - F_N delta_dot + F_T v_t."""
    q, v = _state(cycle, phase, offset, velocity)
    force, rate, cs = _contacts(model, worn, q, v)
    power = 0.0
    for k, joint in enumerate(model.contacts.joint):
        f_n, f_t, delta_dot, slip = _forces(model, worn, k, q, v, cs)
        power += -f_n * delta_dot + f_t * slip
        assert rate[joint, FRICTION] == pytest.approx(-f_t * slip)
        assert rate[joint, ARCHARD] == pytest.approx(f_n * abs(slip))
    assert (force * v).sum() == pytest.approx(power, rel=1.0e-9, abs=1.0e-12 * np.abs(force).max())


@given(phase=phases, offset=offsets, velocity=velocities)
def test_accelerations_are_those_of_dense_algebra(model, worn, cycle, phase, offset, velocity):
    """[M, phi_q^T; phi_q, 0] [a; lambda] = [Q; gamma - 2 alpha phi' - alpha^2 phi], solved whole."""
    q, v = _state(cycle, phase, offset, velocity)
    arrays_, rows, n = model.arrays, model.rows, len(q)
    scratch, a = full_scratch(model), np.zeros_like(q)
    good = accelerate(
        model, worn, APPROACH, steady_drive(cycle.crank_angle[phase], TURN), 0.0, q, v, scratch, a,
        np.zeros((10, JOINT_RATES)), np.zeros(3),
    )  # fmt: skip
    assert good
    m = len(rows.body)
    phi, blocks, gamma = np.empty(m), np.zeros((m, 2, 3)), np.empty(m)
    drive = np.array([cycle.crank_angle[phase], TURN, 0.0])
    closures(arrays_, rows, q, v, scratch.cs, drive, phi, blocks, gamma)
    jacobian = dense_jacobian(rows, blocks, n)
    phi_dot = jacobian @ v[1:].ravel()
    phi_dot[rows.drive_row] -= TURN
    mass = np.diag(arrays_.mass[1:].ravel())
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
    right = np.concatenate(
        [scratch.force[1:].ravel(), gamma - 2.0 * BAUMGARTE * phi_dot - BAUMGARTE**2 * phi]
    )
    solution = np.linalg.solve(matrix, right)
    size = np.abs(solution).max()
    np.testing.assert_allclose(a[1:].ravel(), solution[: 3 * (n - 1)], atol=1.0e-9 * size)
    np.testing.assert_allclose(scratch.lam, solution[3 * (n - 1) :], atol=1.0e-9 * size)
    np.testing.assert_array_equal(a[0], 0.0)


# A controller that drives the crank: gains on the errors of angle and speed, feed-forward, a limit.


SPEED = 5.0  # rad/s
INERTIA = 0.02  # kg m^2


def _tracked(document, name, **track):
    """A mechanism that comes with the package under a controller."""
    mechanism = document(name)
    mechanism["drive"] = {"body": mechanism["drive"]["body"], "track": {"speed_radps": SPEED} | track}
    return mechanism


def _rotor(**track):
    """A rotor on a fixed pin, which closed forms know."""
    return parse_mechanism(
        {
            "name": "rotor",
            "gravity": [0.0, 0.0],
            "ground": {"points": {"A": [0.0, 0.0]}},
            "bodies": {
                "rotor": {"mass": 1.0, "inertia": INERTIA, "com": [0.0, 0.0], "points": {"A": [0.0, 0.0]}}
            },
            "joints": {"A": {"bushing": "ground", "journal": "rotor"}},
            "drive": {"body": "rotor", "track": {"speed_radps": SPEED} | track},
            "assembly": {"crank_angle": 0.0, "rotor": [0.0, 0.0, 0.0]},
        },
        "rotor",
    )


def _advance(mechanism, t_end, **options):
    run = FullRun(prepare(mechanism, clearances=options.pop("clearances", ())), **options)
    statistics, stored = new_run_statistics(len(mechanism.joints)), run.stored_energy
    run.advance(t_end, statistics)
    return run, statistics, stored


@pytest.mark.parametrize("t_end", [0.1, 0.35, 0.8])
def test_a_rotor_settles_as_the_closed_form_says(t_end):
    """A step of feed-forward moves it to where the gain holds it, as a damped oscillator."""
    kp, kd, step = 2.0, 0.06, 0.5
    run, _, _ = _advance(
        _rotor(kp_nm_per_rad=kp, kd_nm_s_per_rad=kd, feed_forward_nm=step), t_end, tolerance_m=1.0e-12
    )
    decay = kd / (2.0 * INERTIA)
    wave = math.sqrt(kp / INERTIA - decay**2)
    swing = math.exp(-decay * t_end)
    error = step / kp * (1.0 - swing * (math.cos(wave * t_end) + decay / wave * math.sin(wave * t_end)))
    rate = step / kp * swing * (wave + decay**2 / wave) * math.sin(wave * t_end)
    assert run.q[1, 2] == pytest.approx(SPEED * t_end + error, rel=1.0e-9)
    assert run.v[1, 2] == pytest.approx(SPEED + rate, rel=1.0e-9)


@pytest.mark.parametrize("asked", [7.0, -7.0])
def test_the_drive_gives_no_more_than_its_largest_torque(asked):
    run, statistics, _ = _advance(_rotor(feed_forward_nm=asked, max_torque_nm=0.4), 0.5, tolerance_m=1.0e-12)
    torque = math.copysign(0.4, asked)
    assert run.v[1, 2] == pytest.approx(SPEED + torque / INERTIA * 0.5, rel=1.0e-9)
    assert statistics.drive_integral[TORQUE] == pytest.approx(0.5 * torque, rel=1.0e-12)


def test_the_feed_forward_follows_the_phase_of_the_wanted_motion():
    """Linear between its phases, and from the last on to the first: over a turn its mean is the table's."""
    table = {"feed_forward_nm": [1.0, -2.0, 0.5], "feed_forward_phase": [0.0, 0.25, 0.75]}
    _, statistics, _ = _advance(_rotor(**table), TURN / SPEED, tolerance_m=1.0e-10)
    mean = 0.25 * (1.0 - 2.0) / 2.0 + 0.5 * (-2.0 + 0.5) / 2.0 + 0.25 * (0.5 + 1.0) / 2.0
    assert statistics.drive_integral[TORQUE] * SPEED / TURN == pytest.approx(mean, rel=1.0e-6)


def test_without_gains_it_is_a_constant_torque(document):
    constant = document("four_bar")
    constant["drive"] = {"body": "crank", "torque": -0.3, "initial_speed": SPEED}
    tracked = _tracked(document, "four_bar", feed_forward_nm=-0.3)
    a, b = (_advance(parse_mechanism(one, "four_bar"), 0.6)[0] for one in (tracked, constant))
    assert abs(a.q[1, 2] - 0.6 * SPEED) > 0.1  # it has left the motion to follow
    np.testing.assert_allclose(a.state.y, b.state.y, rtol=0.0, atol=1.0e-9)


def test_high_gains_tend_to_a_constant_speed(document):
    """Ten times the gains, a tenth of the error; the torque tends to that of the ideal linkage."""
    errors, torques = [], []
    for gain in (1.0, 10.0, 100.0):
        gains = {"kp_nm_per_rad": 30.0 * gain, "kd_nm_s_per_rad": 10.0 * gain}
        mechanism = parse_mechanism(_tracked(document, "four_bar", **gains), "four_bar")
        run, _, _ = _advance(mechanism, 1.0)
        errors.append(abs(run.q[1, 2] - SPEED * 1.0))
        torques.append(run.sample().drive_torque)
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=0.1)
    assert errors[2] == pytest.approx(0.01 * errors[0], rel=0.1)
    steady = document("four_bar")
    steady["drive"] = {"body": "crank", "speed": SPEED}
    wanted = _advance(parse_mechanism(steady, "four_bar"), 1.0)[0].sample().drive_torque
    assert torques[2] == pytest.approx(wanted, rel=5.0e-3)


def test_the_ideal_torque_as_feed_forward_leaves_little_to_the_gains(document):
    steady = document("four_bar")
    steady["drive"] = {"body": "crank", "speed": SPEED}
    linkage = prepare(parse_mechanism(steady, "four_bar"), clearances=()).linkage
    table = {
        "feed_forward_nm": one_cycle(linkage, 128, SPEED).drive_torque.tolist(),
        "feed_forward_phase": (np.arange(128) / 128).tolist(),
    }
    gains = {"kp_nm_per_rad": 2.0, "kd_nm_s_per_rad": 0.1}
    bare, fed = (
        _advance(parse_mechanism(_tracked(document, "four_bar", **gains, **more), "four_bar"), 1.0)[0]
        for more in ({}, table)
    )
    assert abs(fed.q[1, 2] - SPEED) < 1.0e-3 * abs(bare.q[1, 2] - SPEED)


@pytest.mark.parametrize("clearances", [(), ("B",)])
def test_the_work_of_the_drive_is_in_the_energy(document, clearances):
    """With a limit that is reached, so that the torque is not that of a spring and a damper."""
    four_bar = _tracked(
        document, "four_bar", kp_nm_per_rad=8.0, kd_nm_s_per_rad=1.0, feed_forward_nm=0.1, max_torque_nm=0.2
    )
    run, statistics, stored = _advance(
        parse_mechanism(four_bar, "four_bar"), 0.5, clearances=clearances, tolerance_m=1.0e-11
    )
    lost = statistics.integral[:, [FRICTION, DISSIPATION]].sum()
    assert statistics.drive_range[1] == 0.2
    assert statistics.drive_integral[POWER] == pytest.approx(
        run.stored_energy - stored + lost, rel=1.0e-8 if not clearances else 1.0e-4
    )


def test_simulate_counts_the_turns_it_made(document):
    """At a slow pace and with a stiff controller these are those asked for, but for the little it lags."""
    mechanism = parse_mechanism(
        _tracked(document, "four_bar", kp_nm_per_rad=300.0, kd_nm_s_per_rad=30.0), "four_bar"
    )
    result = simulate(mechanism, clearances=(), cycles=2.0, trace=8)
    assert result.model == "full"
    assert result.cycles == pytest.approx(2.0, abs=1.0e-3)
    assert result.speed_rpm == pytest.approx(60.0 * SPEED / TURN, rel=1.0e-3)
    assert abs(result.energy_j.residual) < 1.0e-6
    assert len(result.trace.crank_angle_rad) == 16
    faster = simulate(mechanism, clearances=(), cycles=1.0, speed_rpm=90.0)
    assert faster.speed_rpm == pytest.approx(90.0, rel=1.0e-3)


def test_the_clearance_model_says_what_it_needs(document):
    mechanism = parse_mechanism(_tracked(document, "four_bar", kp_nm_per_rad=1.0), "my_leg.yaml")
    message = r"^my_leg.yaml: drive.track: the clearance model needs drive.speed; try --model full$"
    with pytest.raises(ConfigError, match=message):
        simulate(mechanism, model="clearance")


@pytest.mark.parametrize(
    ("track", "fault"),
    [
        ({"speed_radps": 0.0}, r"drive.track.speed_radps: 0.0 rad/s does not turn the crank"),
        ({"kp_nm_per_rad": -1.0}, r"drive.track.kp_nm_per_rad: -1.0 is not at least 0 N m/rad"),
        ({"max_torque_nm": 0.0}, r"drive.track.max_torque_nm: 0.0 is not above 0 N m"),
        ({"kp": 1.0}, r"drive.track.kp: unknown key"),
        ({"feed_forward_nm": "much"}, r"drive.track.feed_forward_nm: 'much' is not a number"),
        (
            {"feed_forward_nm": [1.0, 2.0]},
            r"drive.track.feed_forward_nm: has 2 torques for 1 phases. Expected one each",
        ),
        (
            {"feed_forward_nm": [1.0, 2.0], "feed_forward_phase": [0.5, 0.5]},
            r"drive.track.feed_forward_phase: \[0.5, 0.5\] does not increase",
        ),
    ],
)
def test_a_controller_that_cannot_be_is_refused(track, fault):
    with pytest.raises(ConfigError, match=fault):
        _rotor(**track)


def test_one_kind_of_drive_at_a_time(document):
    four_bar = _tracked(document, "four_bar")
    four_bar["drive"]["torque"] = 1.0
    with pytest.raises(ConfigError, match=r"drive: has torque and track. Expected one of speed .*, track"):
        parse_mechanism(four_bar, "four_bar")


# Small clearances, drift: what the motion must do whatever the leg.


@pytest.mark.chaotic
def test_a_vanishing_clearance_is_an_ideal_joint(leg_cycles, leg, linkage_of):
    """Mean forces fall towards the ideal ones as all clearances shrink, and come within 5 %, J's 20 %.

    From 3e-4 m on, means of three cycles have sigmas of 0.4 % (J 2.9 %) and less, of the ideal force; J comes
    from 0.136 to 0.117 above it in the last step, with sigmas of 0.012 and 0.004 (10 starts, 2026-11-23).
    """
    ideal = one_cycle(linkage_of("bionic_leg"), 360, TURN).joint_force
    joints = [list(leg.joints).index(name) for name in "ABGIJ"]
    wanted = np.linalg.norm(ideal[:, joints], axis=2).mean(axis=0)
    forces = [leg_cycles("ABGIJ", 3, clearance_m=c).force for c in (1.0e-3, 3.0e-4, 1.0e-4, 3.0e-5)]
    surplus = np.array([force.mean(axis=0) for force in forces]) - wanted
    assert (np.diff(surplus[:3], axis=0) < 0.0).all()
    assert (surplus[3] - surplus[2] < 0.05 * wanted).all()
    assert (surplus[-1] < 0.35 * surplus[0]).all()
    assert (np.abs(surplus[-1, :4]) < 0.05 * wanted[:4]).all()
    assert abs(surplus[-1, 4]) < 0.2 * wanted[4]


def _drift(leg, clearance_joints, seconds, baumgarte, tolerance_m=TOLERANCE_M):
    """Largest residual [m, rad] and its rate in each second of a run, looked at 100 times."""
    setup = prepare(leg, clearances=clearance_joints)
    run, statistics = FullRun(setup, tolerance_m=tolerance_m), new_run_statistics(len(leg.joints))
    run.model = run.model._replace(baumgarte=baumgarte)
    rows, n = run.model.rows, len(run.q)
    phi, blocks, gamma = np.empty(len(rows.body)), np.zeros((len(rows.body), 2, 3)), np.empty(len(rows.body))
    cs, drift = np.empty((n, 2)), np.zeros((seconds, 2))
    for i in range(100 * seconds):
        run.advance((i + 1) / 100.0, statistics)
        drive = np.array([TURN * run.time, TURN, 0.0])
        closures_at(run.model.arrays, rows, run.q, run.v, drive, cs, phi, blocks, gamma)
        phi_dot = dense_jacobian(rows, blocks, n) @ run.v[1:].ravel()
        phi_dot[rows.drive_row] -= TURN
        drift[i // 100] = np.maximum(drift[i // 100], [np.abs(phi).max(), np.abs(phi_dot).max()])
    return drift


@pytest.mark.parametrize("clearance_joints", ["", "ABGIJ"])
def test_closures_stay_closed(leg, clearance_joints):
    """Below 1e-8 m and 1e-6 m/s over several cycles, without a trend."""
    drift = _drift(leg, tuple(clearance_joints), 4, BAUMGARTE)
    assert (drift < [1.0e-8, 1.0e-6]).all()
    assert drift[-1, 0] < 3.0 * drift[0, 0]


def test_closures_drift_apart_without_baumgarte(leg):
    """At ten times the default's step error, so that four seconds show it."""
    drift = _drift(leg, tuple("ABGIJ"), 4, 0.0, 10.0 * TOLERANCE_M)[:, 0]
    assert drift[-1] > 3.0 * drift[0]
    assert drift[-1] > 1.0e-8
