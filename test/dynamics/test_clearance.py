"""Clearance coordinates: their tables, the stepper that a twin drives, and many legs in one call."""

from itertools import pairwise
from typing import NamedTuple

import attrs
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from leg_wear_monitor import Mechanism
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.model import DAMPING, PARTS, coupling_of
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun, ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import (
    COARSER,
    POINTS,
    ClearanceTables,
    build_tables,
    changing_shapes,
    motion_shapes,
    views,
)
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import (
    DONE,
    FORCE,
    INVALID_DRIVE,
    TORQUE,
    RunStatistics,
    new_run_statistics,
    steady_drive,
)
from leg_wear_monitor.dynamics.simulation import Leg, advance_batch, prepare, prepare_legs
from leg_wear_monitor.dynamics.statistics import energy_balance
from leg_wear_monitor.mechanism.constraints import applied_forces_at, external_power
from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism
from leg_wear_monitor.mechanism.position import TURN, Linkage, evaluate, ideal_motion
from leg_wear_monitor.mechanism.spec import Load, Track, TrackDrive

# Tables of the clearance model against the linkage itself: its closures, its reactions, its inertia.


LEGS = ("bionic_leg", "jansen_leg", "four_bar")


@attrs.frozen(eq=False)
class Case:
    """A linkage, its clearance joints and their tables."""

    linkage: Linkage
    contacts: ContactArrays
    tables: ClearanceTables

    @property
    def rows(self) -> list[int]:
        """Rows of the clearance joints among all closures."""
        start = dict(zip(self.linkage.rows.closure.tolist(), self.linkage.rows.row.tolist(), strict=True))
        return [start[int(joint)] + i for joint in self.contacts.joint for i in range(2)]

    def parts(self, i: int) -> dict[str, np.ndarray]:
        """The tables at point i."""
        return views(self.tables.motion[i], motion_shapes(len(self.contacts.joint)))

    def changes(self, i: int, e: np.ndarray) -> dict[str, np.ndarray]:
        """What eccentricities change in the tables at point i."""
        return views(along(e, self.tables.by_e[i // COARSER]), changing_shapes(len(self.contacts.joint)))


def along(e: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Product of eccentricities and a table in blocks of vectors (u / WIDTH, d, WIDTH)."""
    return np.einsum("j,bjw->bw", e, blocks).ravel()


@pytest.fixture(scope="module")
def cases(document):
    """Both legs with five clearance joints, and a four-bar with one, a spring and loads."""
    four_bar = document("four_bar")
    spring = {"bodies": ["ground", "rocker"], "points": ["A", "C"], "stiffness": 200.0, "free_length": 0.1}
    four_bar["springs"] = {"back": spring}
    push = {"body": "coupler", "point": "toe"}
    four_bar["loads"] = {
        "tip": push | {"phase": [0.0, 0.5], "force": [[0, 4], [2, -6]]},
        "all": push | {"force": [1.0, 2.0]},
    }
    mechanisms = [load_mechanism(name) for name in LEGS[:2]] + [parse_mechanism(four_bar, "four_bar")]
    result = {}
    for name, mechanism, clearance_joints in zip(LEGS, mechanisms, ("ABGIJ", "ABGIJ", "B"), strict=True):
        setup = prepare(mechanism, clearances=tuple(clearance_joints))
        tables = build_tables(setup.linkage, setup.contacts)
        result[name] = Case(setup.linkage, setup.contacts, tables)
    return result


@pytest.mark.parametrize("name", LEGS)
def test_the_last_row_is_the_first_a_turn_on(cases, name):
    """But for the angles of bodies that turn with the crank."""
    first, last = (cases[name].parts(i) for i in (0, POINTS))
    for part, values in first.items():
        if part == "angle":
            turns = (last[part] - values) / TURN
            np.testing.assert_allclose(turns, np.round(turns), atol=1.0e-9)
        else:
            np.testing.assert_array_equal(values, last[part])


@pytest.mark.parametrize("name", LEGS)
@pytest.mark.parametrize(
    ("i", "speed", "acceleration"), [(0, 0.0, 0.0), (37, TURN, 0.0), (101, -12.0, 80.0), (200, 0.0, -100.0)]
)
def test_held_journals_feel_the_ideal_reactions(cases, name, i, speed, acceleration):
    """At rest in the bushings' centres: what holds them there, the other reactions, the drive torque."""
    case = cases[name]
    motion = ideal_motion(case.linkage, [TURN * i / POINTS], speed, acceleration)
    at, by = case.parts(i), np.array([1.0, acceleration, speed**2])
    moved = by @ at["free"]
    force = np.abs(motion.joint_force).max()
    held = -moved.reshape(-1, 2)
    np.testing.assert_allclose(held, motion.joint_force[0, case.contacts.joint], atol=1.0e-8 * force)
    steady, room = np.split(by @ case.tables.reaction[i, :3], [len(case.tables.reaction_joint)])
    assert not room.any()
    others = case.tables.reaction_joint[1::2]
    wanted = motion.joint_force[0, others]
    np.testing.assert_allclose(steady[1:].reshape(-1, 2), wanted, atol=1.0e-8 * force)
    torque = at["torque"] @ by
    assert torque == pytest.approx(motion.drive_torque[0], rel=1.0e-8, abs=1.0e-8 * force)
    assert steady[0] == pytest.approx(torque, rel=1.0e-9, abs=1.0e-9 * force)


def _displaced(case, angle, speed, e):
    """Coordinates, velocities and Jacobian with the journals held at e (d,) in a turning linkage."""
    q = ideal_motion(case.linkage, [angle], speed).q[0]
    drive, wanted = (angle, speed, 0.0), np.zeros(len(case.linkage.rows.body))
    wanted[case.rows] = e
    for _ in range(8):
        closures = evaluate(case.linkage, q, np.zeros_like(q), drive)
        q[1:] -= np.linalg.solve(closures.jacobian, closures.phi - wanted).reshape(-1, 3)
    rates = np.zeros(len(wanted))
    rates[case.linkage.rows.drive_row] = speed
    v, jacobian = np.zeros_like(q), evaluate(case.linkage, q, np.zeros_like(q), drive).jacobian
    v[1:] = np.linalg.solve(jacobian, rates).reshape(-1, 3)
    return q, v, jacobian


def _generalised_force(case, angle, speed, e):
    """Force (d,) on the eccentricities held at e, without contact: S^T (Q - M a) with S taken there."""
    q, v, jacobian = _displaced(case, angle, speed, e)
    gamma = evaluate(case.linkage, q, v, (angle, speed, 0.0)).gamma
    force = np.empty_like(q)
    applied_forces_at(case.linkage.arrays, q[None], v[None], np.empty((len(q), 2)), force[None])
    bodies = np.linalg.solve(jacobian, gamma)
    s = np.linalg.inv(jacobian)[:, case.rows]
    return s.T @ (force[1:].ravel() - case.linkage.arrays.mass[1:].ravel() * bodies)


@pytest.mark.parametrize("name", LEGS[:2])
@pytest.mark.parametrize("i", [0, 80, 168])
def test_forces_hold_to_the_first_order_in_the_eccentricities(cases, name, i):
    """What is left out falls with their square: a quarter at half of them; 1e-3 of the force at 0.3 mm."""
    case, at, angle, speed = cases[name], cases[name].parts(i), TURN * i / POINTS, TURN
    direction = np.random.default_rng(i).normal(size=2 * len(case.contacts.joint))
    errors = []
    for size in (3.0e-4, 1.5e-4):
        e = size * direction / np.abs(direction).max()
        by = np.array([1.0, 0.0, speed**2])
        table = by @ (at["free"] + case.changes(i, e)["free"])
        exact = _generalised_force(case, angle, speed, e)
        errors.append(np.abs(table - exact).max() / np.abs(exact).max())
    assert errors[0] < 1.0e-3
    assert errors[1] == pytest.approx(0.25 * errors[0], rel=0.2)


@pytest.mark.parametrize("name", LEGS[:2])
@pytest.mark.parametrize("i", [0, 80, 168])
def test_the_inverse_mass_holds_to_the_first_order_in_the_eccentricities(cases, name, i):
    """What is left out falls with their square; forces by e' twice are those of the linkage's curvature."""
    case, at, angle = cases[name], cases[name].parts(i), TURN * i / POINTS
    random, mass = np.random.default_rng(i), case.linkage.arrays.mass[1:].ravel()
    direction, rates = random.normal(size=(2, 2 * len(case.contacts.joint)))
    errors = []
    for size in (3.0e-4, 1.5e-4):
        e = size * direction / np.abs(direction).max()
        table = at["inverse_mass"] + case.changes(i, e)["inverse_mass"]
        s = np.linalg.inv(_displaced(case, angle, 0.0, e)[2])[:, case.rows]
        exact = np.linalg.inv(s.T @ (mass[:, None] * s))
        errors.append(np.abs(table - exact).max() / np.abs(exact).max())
    assert errors[0] < 1.0e-3
    assert errors[1] == pytest.approx(0.25 * errors[0], rel=0.2)
    q, v, jacobian = _displaced(case, angle, 0.0, np.zeros_like(rates))
    s = np.linalg.inv(jacobian)[:, case.rows]
    v[1:] = (s @ rates).reshape(-1, 3)
    bodies = np.linalg.solve(jacobian, evaluate(case.linkage, q, v, (angle, 0.0, 0.0)).gamma)
    exact = at["inverse_mass"] @ (s.T @ (mass * bodies))
    table = rates @ along(rates, case.tables.bend[i // COARSER])[: len(rates) ** 2].reshape(len(rates), -1)
    np.testing.assert_allclose(table, exact, atol=1.0e-6 * np.abs(exact).max())


@pytest.mark.parametrize("name", LEGS)
@pytest.mark.parametrize("i", [0, 80, 168])
def test_slip_holds_to_the_first_order_in_the_eccentricities(cases, name, i):
    """Its part by the crank's speed, which the bodies' turning makes: a quarter of the error at half."""
    case, at, contacts = cases[name], cases[name].parts(i), cases[name].contacts
    direction = np.random.default_rng(i).normal(size=2 * len(contacts.joint))
    b, j = case.linkage.arrays.joint_body[contacts.joint].T
    errors, changes = [], []
    for size in (3.0e-4, 1.5e-4):
        e = size * direction / np.abs(direction).max()
        table = at["lever_drive"] + case.changes(i, e)["lever_drive"]
        turn = _displaced(case, TURN * i / POINTS, 1.0, e)[1][:, 2]
        radius = contacts.bushing_radius
        exact = turn[j] * (radius - contacts.clearance) - turn[b] * radius
        errors.append(np.abs(table - exact).max())
        changes.append(np.abs(exact - at["lever_drive"]).max())
    assert errors[0] < 0.02 * changes[0]
    assert errors[1] == pytest.approx(0.25 * errors[0], rel=0.2)


@pytest.mark.parametrize("i", [0, 80, 168])
def test_the_power_of_loads_holds_to_the_first_order_in_the_eccentricities(leg, i):
    """By any rates of crank and journals: a quarter of the error at half of the eccentricities."""
    ground = Load(body="foot", point="toe", force=((40.0, 290.0),))
    setup = prepare(attrs.evolve(leg, loads={"ground": ground}))
    case = Case(setup.linkage, setup.contacts, build_tables(setup.linkage, setup.contacts))
    random = np.random.default_rng(i)
    direction, rates = random.normal(size=(2, 2 * len(setup.clearance_joints)))
    errors, changes = [], []
    for size in (3.0e-4, 1.5e-4):
        e = size * direction / np.abs(direction).max()
        table = case.parts(i)["load_power"] + case.changes(i, e)["load_power"]
        q, v, jacobian = _displaced(case, TURN * i / POINTS, TURN, e)
        v[1:] += (np.linalg.inv(jacobian)[:, case.rows] @ rates).reshape(-1, 3)
        cs = np.column_stack([np.cos(q[:, 2]), np.sin(q[:, 2])])
        exact = external_power(case.linkage.arrays, q, v, cs)
        errors.append(abs(table @ [*rates, TURN] - exact))
        changes.append(abs(case.parts(i)["load_power"] @ [*rates, TURN] - exact))
    assert errors[0] < 0.02 * changes[0]
    assert errors[1] == pytest.approx(0.25 * errors[0], rel=0.2)


@pytest.mark.parametrize("name", LEGS[:2])
def test_the_toe_follows_the_eccentricities_to_the_first_order(cases, name):
    """A quarter of the error at half of them."""
    case, i = cases[name], 30
    toe, k = case.parts(i)["toe"], len(case.contacts.joint)
    body, point = case.linkage.mechanism.toe
    direction = np.random.default_rng(1).normal(size=2 * k)
    index = 1 + list(case.linkage.mechanism.bodies).index(body)
    lever = (
        np.array(case.linkage.mechanism.bodies[body].points[point]) - case.linkage.mechanism.bodies[body].com
    )
    errors = []
    for size in (1.0e-3, 5.0e-4):
        e = size * direction
        x, y, angle = _displaced(case, TURN * i / POINTS, 1.0, e)[0][index]
        turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ lever
        errors.append(np.linalg.norm(toe[:, 0] + toe[:, 1 : 1 + 2 * k] @ e - turned - [x, y]))
    assert errors[0] < 1.0e-4
    assert errors[1] == pytest.approx(0.25 * errors[0], rel=0.1)


# The clearance model in motion, also with a crank behind a coupling.


# The clearance stepper as a twin drives it: any motion of the crank, in any pieces, from any snapshot.


FAST_WEAR = 1.0e-11  # 1/Pa: a cycle opens clearances by what steel does in ten thousand
SHORT = 0.3  # s


class Piece(NamedTuple):
    """A stretch of the crank's motion and the time at which it ends [s]."""

    polynomial: np.ndarray
    end: float


def motion_of(speeds: list[float], duration: float) -> list[Piece]:
    """A crank that goes from each of the speeds [rad/s] to the next, smoothly and in equal times [s]."""
    pieces, angle, since = [], 0.0, 0.0
    for before, after in pairwise(speeds):
        change = after - before
        slope = [change / duration**2, -0.5 * change / duration**3]
        pieces.append(Piece(np.array([since, angle, before, 0.0, *slope, 0.0]), since + duration))
        angle, since = angle + 0.5 * (before + after) * duration, since + duration
    return pieces


START_STOP_REVERSE = motion_of([TURN, 2.0 * TURN, 0.0, 0.0, -TURN, 0.0, TURN], 0.05)


@pytest.fixture(scope="module")
def worn_leg(leg: Mechanism) -> Mechanism:
    """The leg of a material so soft that wear opens its clearances while one watches."""
    soft = {
        name: attrs.evolve(c, wear_coefficient=(FAST_WEAR, 2.0 * FAST_WEAR))
        for name, c in leg.clearances.items()
    }
    return attrs.evolve(leg, clearances=soft)


@pytest.fixture(scope="module")
def tables(leg: Mechanism) -> ClearanceTables:
    setup = prepare(leg)
    return build_tables(setup.linkage, setup.contacts)


@pytest.fixture(scope="module")
def new_stepper(worn_leg, tables):
    """Makes steppers of the soft leg with five clearance joints, all at the ideal start; wear feeds back."""
    setup = prepare(worn_leg, wear=True)

    def make() -> ClearanceStepper:
        surfaces = setup.surfaces._replace(depth=np.zeros_like(setup.surfaces.depth))
        return ClearanceStepper(attrs.evolve(setup, surfaces=surfaces), tables=tables)

    return make


def drive(
    stepper: ClearanceStepper, pieces: list[Piece], statistics: RunStatistics, cuts: list[float] | None = None
) -> None:
    """Take a stepper through pieces of motion, stopping at times [s] in between too."""
    for polynomial, end in pieces:
        for t in [*sorted(cut for cut in cuts or () if stepper.time < cut < end), end]:
            assert stepper.advance(polynomial, t, statistics) == (DONE, -1)


def assert_same(one: ClearanceStepper, other: ClearanceStepper) -> None:
    """Bit for bit."""
    np.testing.assert_array_equal(one.state.motion, other.state.motion)
    np.testing.assert_array_equal(one.state.depth, other.state.depth)


def assert_same_statistics(one: RunStatistics, other: RunStatistics) -> None:
    for name, values, others in zip(RunStatistics._fields, one, other, strict=True):
        np.testing.assert_array_equal(values, others, err_msg=name)


@pytest.fixture(scope="module")
def in_one_go(new_stepper):
    """The whole motion with starts, stops and reversals, one call a piece."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    drive(stepper, START_STOP_REVERSE, statistics)
    return stepper, statistics


@settings(max_examples=20)
@given(cuts=st.lists(st.floats(0.0, SHORT), max_size=30))
@example(cuts=[1.0e-9, 0.1, 0.1, np.nextafter(0.1, 1.0)])
@example(cuts=(np.arange(1, 600) * 0.0005).tolist())
def test_any_split_of_the_time_axis_gives_the_same(new_stepper, in_one_go, cuts):
    """State and sums bit for bit, through starts, stops and reversals with wear fed back."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    drive(stepper, START_STOP_REVERSE, statistics, cuts)
    assert_same(stepper, in_one_go[0])
    assert_same_statistics(statistics, in_one_go[1])


@settings(max_examples=20)
@given(at=st.floats(0.0, SHORT), astray=st.floats(-20.0, 20.0))
def test_restored_it_goes_on_bit_for_bit(new_stepper, in_one_go, at, astray):
    """Also in another stepper of the same setup, whatever either has done meanwhile."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    before = [Piece(polynomial, min(end, at)) for polynomial, end in START_STOP_REVERSE if end - 0.05 < at]
    after = [piece for piece in START_STOP_REVERSE if piece.end >= at]
    drive(stepper, before, statistics)
    motion, depth = stepper.state.motion.copy(), stepper.state.depth.copy()
    away = steady_drive(stepper.state.drive[0], astray, stepper.time)
    drive(stepper, [Piece(away, stepper.time + 0.02)], new_run_statistics(10))
    another = new_stepper()
    for restored in (stepper, another):
        restored.state.motion[:], restored.state.depth[:] = motion, depth
        drive(restored, after, new_run_statistics(10))
        assert_same(restored, in_one_go[0])


def test_a_new_start_keeps_the_wear_only(new_stepper, in_one_go):
    stepper, other = new_stepper(), new_stepper()
    for one in (stepper, other):
        one.state.depth[:] = in_one_go[0].state.depth
    drive(stepper, START_STOP_REVERSE[:2], new_run_statistics(10))
    depth = stepper.state.depth.copy()
    stepper.init(1.0, TURN)
    np.testing.assert_array_equal(stepper.state.depth, depth)
    other.state.depth[:] = depth
    other.init(1.0, TURN)
    assert stepper.time == 0.0
    for one in (stepper, other):
        drive(one, [Piece(steady_drive(1.0, TURN), 0.1)], new_run_statistics(10))
    assert_same(stepper, other)


@settings(max_examples=20)
@given(speeds=st.lists(st.floats(-20.0, 20.0), min_size=2, max_size=5))
@example(speeds=[0.0, 0.0, 0.0])
@example(speeds=[20.0, -20.0, 20.0])
def test_no_motion_of_the_crank_leaves_the_finite(new_stepper, speeds):
    """From any speed to any other within a twentieth of a second, from rest too."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    stepper.init(0.0, speeds[0])
    drive(stepper, motion_of(speeds, 0.05), statistics)
    assert np.isfinite(stepper.state.motion).all()
    assert np.isfinite(statistics.integral).all()
    assert np.isfinite(statistics.drive_integral).all()
    eccentricity = np.hypot(*stepper.state.e.reshape(-1, 2).T)
    assert (eccentricity < 1.2 * 3.0e-4).all()


@settings(max_examples=30)
@given(
    i=st.integers(0, 6),
    value=st.sampled_from([np.nan, np.inf, -np.inf, 1.0e300, -1.0e300]),
    steps=st.integers(1, 200),
)
def test_a_senseless_drive_is_refused_and_forgotten(new_stepper, in_one_go, i, value, steps):
    """State and sums as if it had never come, for however long it would have lasted."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    drive(stepper, START_STOP_REVERSE[:3], statistics)
    senseless = START_STOP_REVERSE[3].polynomial.copy()
    senseless[i] = value
    status = stepper.advance(senseless, stepper.time + steps * stepper.model.interval, statistics)
    assert status == (INVALID_DRIVE, -1)
    assert np.isfinite(stepper.state.e).all()
    drive(stepper, START_STOP_REVERSE[3:], statistics)
    assert_same(stepper, in_one_go[0])
    assert_same_statistics(statistics, in_one_go[1])


@pytest.mark.parametrize("t_end", [np.nan, -1.0, -np.inf])
def test_an_end_that_is_not_ahead_changes_nothing(new_stepper, t_end):
    stepper, statistics = new_stepper(), new_run_statistics(10)
    before = stepper.state.motion.copy()
    assert stepper.advance(steady_drive(0.0, TURN), t_end, statistics) == (DONE, -1)
    np.testing.assert_array_equal(stepper.state.motion, before)
    assert not statistics.time[0]


def test_a_drive_that_tears_the_leg_apart_is_stopped(new_stepper):
    """Thousands of radians a second: a status and the last good state; with new bushings it goes as new."""
    stepper, statistics = new_stepper(), new_run_statistics(10)
    drive(stepper, START_STOP_REVERSE[:1], statistics)
    mad = motion_of([2.0 * TURN, 9.0e3], 0.05)[0].polynomial
    mad[:2] = 0.05, stepper.state.drive[0]
    status, k = stepper.advance(mad, 0.1, new_run_statistics(10))
    assert status != DONE
    assert -1 <= k < 5
    assert np.isfinite(stepper.state.e).all()
    assert np.isfinite(stepper.state.depth).all()
    stepper.state.depth[:] = 0.0  # such a drive wears through any bushing
    stepper.init(0.0, TURN)
    another = new_stepper()
    for one in (stepper, another):
        drive(one, START_STOP_REVERSE[:2], new_run_statistics(10))
    assert_same(stepper, another)


@pytest.mark.chaotic
def test_at_rest_the_contacts_carry_the_weight(leg, tables):
    """Two seconds after the crank has stopped, mean forces are the static reactions of the ideal leg.

    Journals go on rocking, since friction begins at 1 mm/s only; and the leg hangs a little elsewhere.
    """
    setup = prepare(leg)
    stepper, statistics = ClearanceStepper(setup, tables=tables), new_run_statistics(10)
    pieces = motion_of([TURN, TURN, 0.0], 0.2)
    drive(stepper, pieces, new_run_statistics(10))
    angle = stepper.state.drive[0]
    rest = steady_drive(angle, 0.0)
    drive(stepper, [Piece(rest, 2.4)], new_run_statistics(10))
    drive(stepper, [Piece(rest, 3.4)], statistics)
    static = ideal_motion(setup.linkage, [angle], 0.0).joint_force[0]
    wanted = np.linalg.norm(static, axis=1)
    np.testing.assert_allclose(statistics.integral[:, FORCE] / statistics.time[0], wanted, rtol=0.01)


# A crank behind a coupling: energy, the rigid limit, full coordinates.


PHASES = 32


def coupled(leg: Mechanism, stiffness: float, damping_ratio: float) -> ClearanceRun:
    """A run of the leg behind a coupling [N m/rad], at a constant speed of the drive."""
    setup = prepare(leg)
    run = ClearanceRun(setup)
    model = run.stepper.model
    coupling = coupling_of(
        model.tables, len(setup.clearance_joints), model.interval, stiffness, damping_ratio
    )
    run.stepper.model = model._replace(coupling=coupling)
    return run


def spring_energy(run: ClearanceRun, stiffness: float) -> float:
    """Energy that is stored in the coupling [J]."""
    return float(0.5 * stiffness * (TURN * run.time - run.stepper.crank_angle) ** 2)


def torque_by_phase(run: ClearanceRun | FullRun, cycles: int) -> np.ndarray:
    """Mean torque (PHASES,) [N m] of gait cycles of a second each, after two that do not count."""
    run.advance(2.0, new_run_statistics(10))
    statistics, impulse = new_run_statistics(10), [0.0]
    for i in range(cycles * PHASES):
        run.advance(2.0 + (i + 1) / PHASES, statistics)
        impulse.append(float(statistics.drive_integral[TORQUE]))
    return np.diff(impulse).reshape(cycles, PHASES).mean(axis=0) * PHASES


@pytest.mark.chaotic
@pytest.mark.parametrize(
    "stiffness, bound",
    [
        (200.0, 0.017),
        pytest.param(1000.0, 0.006, marks=pytest.mark.slow),
        pytest.param(5000.0, 0.004, marks=pytest.mark.slow),
    ],
)
def test_the_work_of_the_drive_is_lost_in_the_joints_alone(leg, stiffness, bound):
    """A coupling without damper only stores energy; with 16 parts of an interval, not 4 as usual.

    Off by 0.0141 with a sigma of 0.0003 on 200 N m/rad, 0.0018 and 0.0005 on 1000, -0.0005 and 0.0004 on 5000
    (12 moved starts, 2026-11-24). The residual on 200 halves with the parts: 0.26, 0.13, 0.066, 0.031, 0.014.
    """
    run = coupled(leg, stiffness, 0.0)
    run.stepper.model.coupling.law[PARTS] = 16.0
    run.advance(1.0, new_run_statistics(10))
    statistics, start = new_run_statistics(10), run.stored_energy + spring_energy(run, stiffness)
    run.advance(7.0, statistics)
    energy = energy_balance(statistics, start, run.stored_energy + spring_energy(run, stiffness))
    assert abs(energy.residual) < bound * (energy.friction_loss + energy.contact_loss)


@pytest.mark.slow  # energy and full coordinates hold for a coupling in `make test`
@pytest.mark.chaotic
def test_a_stiff_coupling_is_a_rigid_drive(leg):
    """RMS difference from the mean torque of a rigid drive: 7.66 N m with a sigma of 0.03, and 1.06 and 0.17.

    So much do mean torques of 12 gait cycles scatter (4 moved starts, 2026-11-24).
    """
    rigid = torque_by_phase(ClearanceRun(prepare(leg)), 12)
    soft, stiff = (
        np.sqrt(np.mean((torque_by_phase(coupled(leg, stiffness, 0.05), 12) - rigid) ** 2))
        for stiffness in (2.0e3, 2.0e5)
    )
    assert soft > 5.0
    assert stiff < 2.5


@pytest.mark.chaotic
@pytest.mark.parametrize("stiffness", [200.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_the_torque_of_a_coupling_is_that_of_full_coordinates(leg, stiffness):
    """There, it is a controller's with the same gains.

    RMS difference over the RMS: 0.0044 with a sigma of 0.0021 on 200 N m/rad, 0.0041 and 0.0015 on 1000 (30
    moved starts, 2026-11-24).
    """
    run = coupled(leg, stiffness, 0.05)
    damping = float(run.stepper.model.coupling.law[DAMPING])
    track = Track(speed_radps=TURN, kp_nm_per_rad=stiffness, kd_nm_s_per_rad=damping)
    driven = attrs.evolve(leg, drive=TrackDrive(body=leg.drive.body, track=track))
    full = torque_by_phase(FullRun(prepare(driven), tolerance_m=1.0e-9), 12)
    off = torque_by_phase(run, 12) - full
    assert np.sqrt(np.mean(off**2)) < 0.018 * np.sqrt(np.mean(full**2))


# Many legs in one call: each as if it were alone, whatever the others and however many threads.


def with_joint(leg, name, **changes):
    """The leg with other settings of one joint's clearance."""
    return attrs.evolve(
        leg, clearances={**leg.clearances, name: attrs.evolve(leg.clearances[name], **changes)}
    )


@pytest.fixture(scope="module")
def rigid_stepper(leg):
    setup = prepare(leg, clearances=("A", "G"))
    tables = build_tables(setup.linkage, setup.contacts)
    return lambda: ClearanceStepper(prepare(leg, clearances=("A", "G")), tables=tables)


@settings(max_examples=25)
@given(perturb_m=st.floats(0.0, 3.0e-4), seed=st.integers(0, 2**32), angle=st.floats(-10.0, 10.0))
def test_a_start_is_inside_the_clearance_and_repeats_itself(leg, rigid_stepper, perturb_m, seed, angle):
    stepper = rigid_stepper()
    one = Leg(mechanism=leg, perturb_m=perturb_m, seed=seed, crank_angle_rad=angle)
    one.start(stepper)
    e = stepper.state.e.reshape(-1, 2).copy()
    assert (np.linalg.norm(e, axis=1) <= perturb_m * (1.0 + 1.0e-12) + 1.0e-14).all()  # m: moved starts
    np.testing.assert_array_equal(stepper.state.drive, [angle, TURN, 0.0])
    assert not stepper.state.v.any()
    one.start(stepper)
    np.testing.assert_array_equal(stepper.state.e.reshape(-1, 2), e)


def test_starts_fill_the_disc_evenly(leg, rigid_stepper):
    """Half of them inside 1 / sqrt 2 of its radius, a quarter in each quadrant."""
    stepper, starts = rigid_stepper(), []
    for seed in range(1000):
        Leg(mechanism=leg, perturb_m=2.0e-4, seed=seed).start(stepper)
        starts.append(stepper.state.e.reshape(-1, 2).copy())
    e = np.concatenate(starts)
    assert (np.linalg.norm(e, axis=1) < 2.0e-4 / np.sqrt(2.0)).mean() == pytest.approx(0.5, abs=0.06)
    assert ((e[:, 0] > 0.0) & (e[:, 1] > 0.0)).mean() == pytest.approx(0.25, abs=0.05)


def test_legs_that_differ_in_their_material_alone_keep_it(leg):
    """The text of a mechanism, by which legs are prepared once, leaves it out."""
    pairs = ("ds-on-steel-greased", "graphite-bronze-oil-on-steel")
    setups = prepare_legs([Leg(mechanism=with_joint(leg, "A", material=pair)) for pair in pairs])
    assert [setup.linkage.mechanism.clearances["A"].material for setup in setups] == list(pairs)


def test_advancing_a_batch_is_advancing_each(rigid_stepper):
    """Each to its own time; a drive that makes no sense stops its own leg only."""
    alone, together = ([rigid_stepper() for _ in range(3)] for _ in range(2))
    polynomials = [steady_drive(0.0, TURN), steady_drive(0.0, np.nan), steady_drive(1.0, -TURN)]
    times = [0.1, 0.2, 0.3]
    for steppers in (alone, together):
        steppers[2].init(1.0, -TURN)
    statistics_of_all, statistics_alone = ([new_run_statistics(10) for _ in range(3)] for _ in range(2))
    statuses = [
        stepper.advance(*job)
        for stepper, *job in zip(alone, polynomials, times, statistics_alone, strict=True)
    ]
    assert advance_batch(together, polynomials, times, statistics_of_all, workers=3) == statuses
    assert [status for status, _ in statuses] == [DONE, INVALID_DRIVE, DONE]
    for one, other, statistics, wanted in zip(
        alone, together, statistics_of_all, statistics_alone, strict=True
    ):
        np.testing.assert_array_equal(one.state.motion, other.state.motion)
        np.testing.assert_array_equal(one.state.depth, other.state.depth)
        np.testing.assert_array_equal(statistics.integral, wanted.integral)


@pytest.mark.parametrize("shared", ["tally", "stepper", "setup", "length"])
def test_what_two_threads_would_write_is_refused(leg, rigid_stepper, shared):
    steppers, statistics_of_all = (
        [rigid_stepper(), rigid_stepper()],
        [new_run_statistics(10), new_run_statistics(10)],
    )
    if shared == "tally":
        statistics_of_all[1] = statistics_of_all[0]
    elif shared == "stepper":
        steppers[1] = steppers[0]
    elif shared == "setup":
        setup = prepare(leg, clearances=("G",))
        steppers = [ClearanceStepper(setup), ClearanceStepper(setup)]
    else:
        statistics_of_all.append(new_run_statistics(10))
    with pytest.raises(ValueError, match=r"share|zip|shorter|longer"):
        advance_batch(steppers, [steady_drive(0.0, TURN)] * 2, 0.1, statistics_of_all)
