"""Tables of the clearance model against the linkage itself: its closures, its reactions, its inertia."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.tables import (
    COARSER,
    POINTS,
    ClearanceTables,
    build_tables,
    changing_shapes,
    motion_shapes,
    views,
)
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.constraints import applied_forces_at, external_power
from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism
from leg_wear_monitor.mechanism.position import TURN, Linkage, evaluate, ideal_motion
from leg_wear_monitor.mechanism.spec import ConstantLoad

LEGS = ("bionic_leg", "jansen_leg", "four_bar")


@attrs.frozen(eq=False)
class Case:
    """A linkage, its clearance joints and their tables."""

    linkage: Linkage
    contacts: ContactArrays
    tables: ClearanceTables
    damped: bool

    @property
    def rows(self) -> list[int]:
        """Rows of the clearance joints among all closures."""
        start = dict(zip(self.linkage.rows.closure.tolist(), self.linkage.rows.row.tolist(), strict=True))
        return [start[int(joint)] + i for joint in self.contacts.joint for i in range(2)]

    def parts(self, i: int) -> dict[str, np.ndarray]:
        """The tables at point i."""
        return views(self.tables.motion[i], motion_shapes(len(self.contacts.joint), self.damped))

    def changes(self, i: int, e: np.ndarray) -> dict[str, np.ndarray]:
        """What eccentricities change in the tables at point i."""
        return views(along(e, self.tables.by_e[i // COARSER]), changing_shapes(len(self.contacts.joint)))


def along(e: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Product of eccentricities and a table in blocks of vectors (u / WIDTH, d, WIDTH)."""
    return np.einsum("j,bjw->bw", e, blocks).ravel()


@pytest.fixture(scope="module")
def cases(document):
    """Both legs with five clearance joints, and a four-bar with one, a spring, a damper and loads."""
    four_bar = document("four_bar")
    spring = {"bodies": ["ground", "rocker"], "points": ["A", "C"], "stiffness": 200.0, "free_length": 0.1}
    four_bar["springs"] = {"back": spring | {"damping": 3.0}}
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
        result[name] = Case(setup.linkage, setup.contacts, tables, name == "four_bar")
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
    if case.damped:
        moved = moved + np.linalg.solve(at["inverse_mass"], speed * at["viscous"][:, -1])
    force = np.abs(motion.joint_force).max()
    held = -moved.reshape(-1, 2)
    np.testing.assert_allclose(held, motion.joint_force[0, case.contacts.joint], atol=1.0e-8 * force)
    steady, room = np.split(
        np.array([*by, speed]) @ case.tables.reaction[i, :4], [len(case.tables.reaction_joint)]
    )
    assert not room.any()
    others = case.tables.reaction_joint[1::2]
    wanted = motion.joint_force[0, others]
    np.testing.assert_allclose(steady[1:].reshape(-1, 2), wanted, atol=1.0e-8 * force)
    torque = at["torque"] @ [*by, speed]
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
    ground = ConstantLoad(body="foot", point="toe", force=(40.0, 290.0))
    setup = prepare(attrs.evolve(leg, loads={"ground": ground}))
    case = Case(setup.linkage, setup.contacts, build_tables(setup.linkage, setup.contacts), damped=False)
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
