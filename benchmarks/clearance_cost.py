"""Where the clearance model's time goes: steps and intervals, its parts one by one, and the floor."""

import math
from collections.abc import Callable
from statistics import median
from typing import NamedTuple

import clearance_loops as loops
import numpy as np
from watch import Watch

from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper
from leg_wear_monitor.dynamics.run import Setup, new_run_statistics, steady_drive
from leg_wear_monitor.mechanism.position import TURN

CALLS = 100_000
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
    statistics_of_all = [new_run_statistics(joints) for _ in FINENESS]
    spent: list[list[float]] = [[] for _ in FINENESS]
    for turn in range(repeats + 1):
        for stepper, statistics, seconds in zip(steppers, statistics_of_all, spent, strict=True):
            watch = Watch()
            stepper.advance(polynomial, (turn + 1) * TURNS * period, statistics)
            seconds.append(watch.processor / TURNS)
    cycles = TURNS * (repeats + 1)
    rows = [
        Fineness(count, statistics.steps[0] / cycles, statistics.steps[1] / cycles, median(seconds[1:]))
        for count, statistics, seconds in zip(FINENESS, statistics_of_all, spent, strict=True)
    ]
    counts = np.array([[row.trials, row.intervals] for row in rows])
    (trial, interval), *_ = np.linalg.lstsq(counts, np.array([row.seconds for row in rows]))
    return rows, float(trial), float(interval)


def parts(setup: Setup) -> list[Part]:
    """The parts with all joints in contact; those of a trial step come after the whole of it."""
    stepper, polynomial = ClearanceStepper(setup), steady_drive(0.0, setup.speed)
    statistics = new_run_statistics(len(setup.linkage.mechanism.joints))
    stepper.advance(polynomial, TURN / abs(setup.speed), statistics)
    while not (stepper.state.approach > 0.0).all():
        stepper.advance(polynomial, stepper.time + stepper.model.interval, statistics)
    all_of_it = (stepper.model, stepper.state, stepper.work)
    contact = (stepper.model, setup.surfaces, stepper.state, stepper.work)
    loops.evaluations(1, 0.0, *contact)
    added = np.zeros_like(stepper.work.added)
    return [
        Part("trial step", 1.0, "trial", _least(loops.trials, *contact)),
        Part("  contact forces and their product", 2.0, "", _least(loops.evaluations, *contact)),
        Part("  factorise", 1.0, "", _least(loops.factorisations, *all_of_it)),
        Part("  solve", 3.0, "", _least(loops.solutions, *all_of_it)),
        Part("integrals of the joints", 1.0, "taken", _least(loops.integrals, *all_of_it, added)),
        Part(
            "touch and parting", 1.0, "taken", _least(loops.touches, *all_of_it, setup.contacts, statistics)
        ),
        Part("start of the next step", 1.0, "taken", _least(loops.shifts, *all_of_it)),
        Part("drive torque", 1.0, "taken", _least(loops.torques, *all_of_it)),
        Part("toe", 1.0, "taken", _least(loops.toes, *all_of_it, statistics)),
        Part("tables at the crank angle", 1.0, "interval", _least(loops.tables, *all_of_it)),
        Part("reactions of the ideal joints", 0.5, "interval", _least(loops.ideal_reactions, *all_of_it)),
        Part(
            "wear of a joint",
            0.5 * len(setup.clearance_joints),
            "interval",
            _least(loops.wear, *contact),
        ),
    ]


def floor(setup: Setup) -> float:
    """Seconds that no formulation can avoid: the laws of all clearance joints, one product with M^-1."""
    stepper, statistics = ClearanceStepper(setup), new_run_statistics(len(setup.linkage.mechanism.joints))
    stepper.advance(steady_drive(0.0, setup.speed), TURN / abs(setup.speed), statistics)
    d = 2 * len(setup.clearance_joints)
    e, v = math.sqrt(0.5) * (np.repeat(setup.contacts.clearance, 2) + 1.0e-6), np.full(d, 0.03)
    law, clearance = stepper.model.law, setup.contacts.clearance
    return _least(loops.floors, law, clearance, e, v, np.ones((d, d)), np.zeros(d), np.zeros(d))


def _least(loop: Callable[..., None], *arguments: object) -> float:
    """Seconds of one call, the least of several rounds; the chain from call to call is 0 times a result."""
    loop(1, 0.0, *arguments)
    rounds = []
    for _ in range(5):
        watch = Watch()
        loop(CALLS, 0.0, *arguments)
        rounds.append(watch.processor / CALLS)
    return min(rounds)
