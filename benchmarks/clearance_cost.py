"""Where the clearance model's time goes: steps and intervals, its parts one by one, and the floor.

The parts are timed in compiled loops in which every call waits for the result of the one before, as it does
in a step: calls that may overlap look cheaper.
"""

import math
import statistics
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.normal import damped_force, elastic_force
from leg_wear_monitor.dynamics.clearance import take_tables
from leg_wear_monitor.dynamics.clearance_contact import (
    A0,
    CLEARANCE,
    E0,
    FRICTION_COEFFICIENT,
    FRICTION_LAW,
    HYSTERESIS_FACTOR,
    K1E,
    K1V,
    LOCAL_STIFFNESS,
    RAMP_0,
    RAMP_1,
    V0,
    accelerate_clearances,
)
from leg_wear_monitor.dynamics.clearance_outputs import drive_torque, reactions, toe_deviation
from leg_wear_monitor.dynamics.clearance_run import INTERVALS, ClearanceStepper
from leg_wear_monitor.dynamics.clearance_step import integrate_joints, shift_start, try_step
from leg_wear_monitor.dynamics.drive import steady_drive
from leg_wear_monitor.dynamics.rosenbrock import factorise_contacts, solve_contacts
from leg_wear_monitor.dynamics.run import Setup
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.kernel import entry
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.wear.surfaces import deposit_wear

CALLS = 100_000
STEP = 1.0e-5  # s
TURNS = 5  # cycles
FINENESS = (INTERVALS // 2, INTERVALS, 2 * INTERVALS, 4 * INTERVALS)


class Fineness(NamedTuple):
    """With so many intervals a cycle: trial steps and steps taken in a cycle, and its seconds (median)."""

    intervals: int
    trials: float
    taken: float
    seconds: float


class Part(NamedTuple):
    """A part of the model, how often a trial, a taken step or an interval does it, and its seconds."""

    name: str
    times: float
    per: str
    seconds: float


def regression(setup: Setup, repeats: int) -> tuple[list[Fineness], float, float]:
    """Cost over the number of intervals; seconds of a trial step and of an interval by regression."""
    period, polynomial = TURN / abs(setup.speed), steady_drive(0.0, setup.speed)
    joints = len(setup.linkage.mechanism.joints)
    steppers = [ClearanceStepper(setup, period / count) for count in FINENESS]
    tallies = [new_tally(joints) for _ in FINENESS]
    spent: list[list[float]] = [[] for _ in FINENESS]
    for turn in range(repeats + 1):
        for stepper, tally, seconds in zip(steppers, tallies, spent, strict=True):
            since = time.perf_counter()
            stepper.advance(polynomial, (turn + 1) * TURNS * period, tally)
            seconds.append((time.perf_counter() - since) / TURNS)
    cycles = TURNS * (repeats + 1)
    rows = [
        Fineness(count, tally.steps[0] / cycles, tally.steps[1] / cycles, statistics.median(seconds[1:]))
        for count, tally, seconds in zip(FINENESS, tallies, spent, strict=True)
    ]
    counts = np.array([[row.trials, row.intervals] for row in rows])
    (trial, interval), *_ = np.linalg.lstsq(counts, np.array([row.seconds for row in rows]))
    return rows, float(trial), float(interval)


def parts(setup: Setup) -> list[Part]:
    """The parts with all joints in contact; those of a trial step come after the whole of it."""
    stepper, polynomial = ClearanceStepper(setup), steady_drive(0.0, setup.speed)
    tally = new_tally(len(setup.linkage.mechanism.joints))
    stepper.advance(polynomial, TURN / abs(setup.speed), tally)
    while not (stepper.state.approach > 0.0).all():
        stepper.advance(polynomial, stepper.time + stepper.model.interval, tally)
    all_of_it = (stepper.model, stepper.state, stepper.work)
    _evaluations(1, 0.0, *all_of_it)
    added = np.zeros((len(setup.loose), tally.integral.shape[1]))
    return [
        Part("trial step", 1.0, "trial", _least(_trials, *all_of_it)),
        Part("  contact forces and their product", 2.0, "", _least(_evaluations, *all_of_it)),
        Part("  factorise", 1.0, "", _least(_factorisations, *all_of_it)),
        Part("  solve", 3.0, "", _least(_solutions, *all_of_it)),
        Part("integrals of the joints", 1.0, "taken", _least(_integrals, *all_of_it, added)),
        Part("start of the next step", 1.0, "taken", _least(_shifts, *all_of_it)),
        Part("drive torque", 1.0, "taken", _least(_torques, *all_of_it)),
        Part("toe", 1.0, "taken", _least(_toes, *all_of_it, tally)),
        Part("tables at the crank angle", 1.0, "interval", _least(_tables, *all_of_it)),
        Part("reactions of the ideal joints", 0.5, "interval", _least(_reactions, *all_of_it)),
        Part(
            "wear of a joint", 0.5 * len(setup.loose), "interval", _least(_wear, setup.surfaces, *all_of_it)
        ),
    ]


def floor(setup: Setup) -> float:
    """Seconds of what no formulation can avoid: the laws of all loose joints and one product with M^-1."""
    stepper, tally = ClearanceStepper(setup), new_tally(len(setup.linkage.mechanism.joints))
    stepper.advance(steady_drive(0.0, setup.speed), TURN / abs(setup.speed), tally)
    d = 2 * len(setup.loose)
    e, v = math.sqrt(0.5) * (np.repeat(setup.contacts.clearance, 2) + 1.0e-6), np.full(d, 0.03)
    return _least(
        _floors, stepper.model.law, stepper.state.local, e, v, np.ones((d, d)), np.zeros(d), np.zeros(d)
    )


def _least(loop: Callable[..., None], *arguments: object) -> float:
    """Seconds of one call, the least of several rounds; the chain from call to call is 0 times a result."""
    loop(1, 0.0, *arguments)
    rounds = []
    for _ in range(5):
        since = time.perf_counter()
        loop(CALLS, 0.0, *arguments)
        rounds.append((time.perf_counter() - since) / CALLS)
    return min(rounds)


@entry
def _floors(count, chain, law, local, e, v, inverse_mass, force, out_a):
    for _ in range(count):
        e[0] += chain * out_a[0]
        for i in range(e.shape[0]):
            out_a[i] = 0.0
        for k in range(local.shape[0]):
            ex, ey, vx, vy = e[2 * k], e[2 * k + 1], v[2 * k], v[2 * k + 1]
            length = math.sqrt(ex * ex + ey * ey)
            nx, ny = ex / length, ey / length
            elastic = elastic_force(local[k, LOCAL_STIFFNESS], length - local[k, CLEARANCE])
            f_n = damped_force(elastic, law[k, HYSTERESIS_FACTOR], nx * vx + ny * vy)
            mu, code, slip = law[k, FRICTION_COEFFICIENT], law[k, FRICTION_LAW], nx * vy - ny * vx
            f_t = friction_force(code, mu, law[k, RAMP_0], law[k, RAMP_1], f_n, slip)
            force[2 * k], force[2 * k + 1] = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
        for j in range(e.shape[0]):
            for i in range(e.shape[0]):
                out_a[i] += inverse_mass[j, i] * force[j]


@entry
def _trials(count, chain, model, state, work):
    x, law, now, system = work.x, model.law, work.now, work.system
    for _ in range(count):
        error = try_step(
            law, model.tolerance, state.local, state.approach, STEP, now, system, x, work.start, work.end
        )
        x[E0, 0] += chain * min(error, 1.0)


@entry
def _evaluations(count, chain, model, state, work):
    x = work.x
    for _ in range(count):
        accelerate_clearances(
            model.law, state.local, state.approach, work.now, 0.0, x, E0, V0, A0, work.start
        )
        x[E0, 0] += chain * x[A0, 0]


@entry
def _factorisations(count, chain, model, state, work):
    m, now = state.approach.shape[0], work.now
    for _ in range(count):
        h = STEP + chain * work.system.factor[m - 1, m - 1]
        factorise_contacts(h, now.inverse_mass, now.speed[0], work.start, work.system)


@entry
def _solutions(count, chain, model, state, work):
    m, x = state.approach.shape[0], work.x
    for _ in range(count):
        solve_contacts(STEP, work.system, m, 1.0, x, V0, A0, K1E, K1V)
        x[A0, 0] += chain * x[K1E, 0]


@entry
def _integrals(count, chain, model, state, work, added):
    for _ in range(count):
        h = STEP + chain * added[0, 0]
        integrate_joints(model.law, state.local, state.approach, h, work.start, work.end, added)


@entry
def _shifts(count, chain, model, state, work):
    for _ in range(count):
        shift_start(work.now, work.x)
        work.x[V0, 0] += chain * work.x[A0, 0]


@entry
def _torques(count, chain, model, state, work):
    for _ in range(count):
        work.x[A0, 0] += chain * drive_torque(work.now, work.x, work.start)[0]


@entry
def _toes(count, chain, model, state, work, tally):
    for _ in range(count):
        toe_deviation(work.now, work.x, tally.response)
        work.x[A0, 0] += chain * tally.response[2]


@entry
def _tables(count, chain, model, state, work):
    for i in range(count):
        angle = 0.003 * i + chain * work.now.row[0]
        take_tables(model.tables, angle, work.now.speed[0], 0.0, work.now)


@entry
def _reactions(count, chain, model, state, work):
    for i in range(count):
        angle = 0.003 * i + chain * work.reaction[0]
        reactions(model.tables, angle, work.now, work.x, work.start, work.reaction)


@entry
def _wear(count, chain, surfaces, model, state, work):
    for _ in range(count):
        ex, ey = state.e[0] + chain * surfaces.depth[0, 0, 0], state.e[1]
        deposit_wear(model.contacts, surfaces, 0, ex, ey, 0.0, 0.0, 1.0e-9, work.weight)
