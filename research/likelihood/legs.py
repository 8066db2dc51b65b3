"""Simulated legs: for training in clearance coordinates, for tests in full coordinates.

Each leg is one small file: the drive torque (cycles, 512) [N m] of the leg when new, and after changes of it.
The simulation is slow and knows no drive: `signals.py` adds drives to the stored torque, many times.

`python legs.py DIRECTORY [--test] [--first 0] [--number 5000]` makes the legs that are missing.
"""

import argparse
import os
import time
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# isort: split
import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import POINTS as LOAD_POINTS
from leg_wear_monitor.gait.leg import Ground
from leg_wear_monitor.mechanism.person import FORE_AFT, nominal_stance, with_toe_force
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.twin.reference import HARMONICS, POINTS, CrankProfile, LegParameters, LegSimulation
from leg_wear_monitor.wear import SECTORS

LEG = load_mechanism("bionic_leg")
JOINTS, BODIES = LEG.clearance_joints, tuple(LEG.bodies)
NEW_M = 3.0e-4
SETTLING, BASELINE, AFTER = 2, 12, 4  # gait cycles of a training leg
TEST_BASELINE, TEST_AFTER = 62, 12
LEAST_M, MIDDLE_M, MOST_M = 3.6e-4, 1.0e-3, 4.0e-3  # an opened joint; six of ten are below the middle


class State(NamedTuple):
    """A leg when new, or after a change: clearances [m], and factors on masses, joint friction and load."""

    clearance_m: np.ndarray
    mass: np.ndarray
    friction: float = 1.0
    load: float = 1.0


class Drawn(NamedTuple):
    """A leg: how its crank turns, its parameters, its ground, and its states, the new one first."""

    profile: CrankProfile
    parameters: LegParameters
    ground: LoadConfig | None
    states: list[State]


def drawn(seed: int, is_test: bool) -> Drawn:
    """A leg that a seed gives; each third training leg is on the ground, and test legs from number 100 on."""
    rng = np.random.default_rng([seed, int(is_test)])
    wide = 0.5 if is_test else 1.0
    bodies = len(BODIES)
    mass, length = 1.0 + wide * rng.uniform(-0.1, 0.1, bodies), 1.0 + wide * rng.uniform(-0.01, 0.01, bodies)
    friction = np.exp(rng.uniform(*np.log((0.5, 2.0) if is_test else (0.4, 2.5))))
    rpm = 60.0 if is_test else rng.uniform(50.0, 70.0)
    # waves of the speed in a turn
    size = rng.uniform(0.0, 0.03 if is_test else 0.05) * rng.dirichlet([1.0, 3.0, 1.0])
    # at the begin of a test leg's gait cycle, as today's diagnosis has it, the crank is at its zero
    turned = 0.25 * TURN * rng.choice([-1.0, 1.0], 3) if is_test else rng.uniform(0.0, TURN, 3)
    waves = np.pad(size / np.arange(1, 4) * np.exp(1j * turned), (0, HARMONICS - 3))
    profile = CrankProfile(rpm * TURN / 60.0, waves.real, waves.imag)
    is_loaded = seed >= 100 if is_test else seed % 3 == 0
    ground, load = None, np.zeros((0, 2))
    if is_loaded:
        peak_n = np.exp(rng.uniform(np.log(50.0), np.log(600.0)))
        peak_n = (100.0, 300.0, 600.0)[seed % 3] if is_test else peak_n
        ground = LoadConfig(ground_n=peak_n, shape="treadmill" if is_test else "template")
        load = np.zeros((1, 2)) if is_test else _load(rng, peak_n)
    parameters = LegParameters(mass, length, float(friction), load=load)
    states = _test_states(rng, is_loaded) if is_test else _training_states(rng, is_loaded)
    return Drawn(profile, parameters, ground, states)


def _load(rng: np.random.Generator, peak_n: float) -> np.ndarray:
    """Force (PHASES, 2) of the ground in a stance of free shape and time [N]."""
    stance = nominal_stance(build_linkage(LEG))
    shift = np.clip(0.03 * rng.standard_normal(2), -0.08, 0.08)
    stance = attrs.evolve(
        stance, heel_strike=stance.heel_strike + shift[0], toe_off=stance.toe_off + shift[1]
    )
    s, order = stance.fractions(), np.arange(1, 9)
    waves = np.where(s <= 1.0, np.sin(0.5 * TURN * np.outer(order, s)), 0.0)
    vertical = np.array([1.0, 0.0, 0.25, 0, 0, 0, 0, 0]) + 0.3 * rng.standard_normal(8) / order
    along = np.array([0.0, 0.8, 0, 0, 0, 0, 0, 0]) + 0.4 * rng.standard_normal(8) / order
    up, back = np.maximum(vertical @ waves, 0.0), along @ waves
    fore_aft = FORE_AFT * rng.uniform(0.0, 1.5) / max(np.abs(back).max(), 1e-3)
    return np.asarray(peak_n * (np.outer(up / up.max(), stance.up) + fore_aft * np.outer(back, stance.back)))


def _training_states(rng: np.random.Generator, is_loaded: bool) -> list[State]:
    same, fresh = np.ones(len(BODIES)), NEW_M * np.exp(0.1 * rng.standard_normal(5))
    if rng.random() < 0.2:  # a leg that was worn when the monitor began
        worn = rng.random(5) < 0.4
        fresh[worn] = np.exp(rng.uniform(np.log(LEAST_M), np.log(MIDDLE_M), worn.sum()))

    def opened(which: np.ndarray, most_m: float = MOST_M) -> State:
        clearance = fresh.copy()
        for k in which:
            low, high = (LEAST_M, MIDDLE_M) if rng.random() < 0.6 else (MIDDLE_M, max(MIDDLE_M, most_m))
            clearance[k] = max(1.15 * fresh[k], np.exp(rng.uniform(np.log(low), np.log(high))))
        return State(clearance, same)

    states = [State(fresh, same), *(opened(np.array([k])) for k in range(5))]
    states.append(opened(rng.permutation(5)[: rng.integers(2, 4)], MIDDLE_M))
    states.append(State(fresh * np.exp(rng.uniform(0.0, 0.7, 5)), same))

    mass = same.copy()
    mass[rng.permutation(len(mass))[:1]] = np.exp(rng.uniform(np.log(0.75), np.log(1.4)))
    others = [
        State(fresh, mass),
        State(fresh, same, float(np.exp(rng.uniform(np.log(0.5), np.log(3.2))))),
        State(fresh, same, 1.0, float(rng.uniform(0.6, 1.5))),
    ]
    return [*states, others[rng.integers(3 if is_loaded else 2)]]


def _test_states(rng: np.random.Generator, is_loaded: bool) -> list[State]:
    same, fresh = np.ones(len(BODIES)), np.full(5, NEW_M)

    def opened(sizes_m: dict[int, float]) -> State:
        clearance = fresh.copy()
        clearance[list(sizes_m)] = list(sizes_m.values())
        return State(clearance, same)

    states = [State(fresh, same)]
    states += [opened({k: size}) for size in ((6.0e-4,) if is_loaded else (4.5e-4, 6.0e-4)) for k in range(5)]
    one, two, three, four = rng.permutation(5)[:4].tolist()
    if not is_loaded:
        states += [opened({one: 1.2e-3}), opened({one: 4.5e-4, two: 4.5e-4})]
    states.append(opened({three: 6.0e-4, four: 6.0e-4}))
    states.append(opened(dict(enumerate([4.5e-4, 3.5e-4, 3.45e-4, 3.15e-4, 3.1e-4]))))  # a life
    mass = same.copy()
    mass[rng.integers(1, len(mass))] = rng.uniform(1.2, 1.4)
    states += [State(fresh, mass), State(fresh, same, float(rng.choice([0.6, 1.5, 2.2])))]
    return states


def _simulated(leg: Drawn) -> list[np.ndarray]:
    """Torque (cycles, POINTS) of each state, in clearance coordinates."""
    simulation, none = LegSimulation(LEG), np.zeros((5, 2, SECTORS))
    found = []
    for i, state in enumerate(leg.states):
        own = leg.parameters
        changed = attrs.evolve(
            own,
            mass=own.mass * state.mass,
            friction=own.friction * state.friction,
            load=state.load * own.load,
        )
        cycles = AFTER if i else BASELINE
        one = simulation.simulate(leg.profile, changed, state.clearance_m, none, SETTLING, cycles)
        if one is None:
            raise LegWearError(f"state {i} cannot be simulated")
        found.append(one[0].astype(np.float16))
    return found


def _walked(leg: Drawn, seed: int) -> list[np.ndarray]:
    """Torque (cycles, POINTS) of each state, in full coordinates."""
    found, own = [], attrs.evolve(leg.parameters, load=np.zeros((0, 2)))
    for i, state in enumerate(leg.states):
        cycles = SETTLING + (TEST_AFTER if i else TEST_BASELINE)
        changed = attrs.evolve(own, mass=own.mass * state.mass, friction=own.friction * state.friction)
        mechanism = changed.applied(LEG)
        ground = Ground(mechanism, GaitConfig(load=leg.ground, seed=100 * seed + i)) if leg.ground else None
        if ground:
            mechanism = with_toe_force(mechanism, np.zeros((LOAD_POINTS, 2)))
        setup = prepare(mechanism)
        setup.contacts.clearance[:] = state.clearance_m
        speed = leg.profile.speed
        run = FullRun(attrs.evolve(setup, speed=leg.profile.at(0.0).speed), tolerance_m=1e-9)
        statistics, impulse = new_run_statistics(len(mechanism.joints)), np.zeros(cycles * POINTS + 1)
        step, swing = TURN / speed / POINTS, round((ground.swing if ground else 0.0) * POINTS)
        before = leg.profile.at(0.0)
        for j in range(cycles * POINTS):
            if ground and (j == 0 or j % POINTS == swing % POINTS):
                force = ground.step(speed)
                run.model.arrays.load_force[-1] = np.pad(force, ((1, 1), (0, 0)), mode="wrap")
            now = leg.profile.at(speed * step * (j + 1))
            run.polynomial[:] = quintic(step * j, before, step, now)
            run.advance(step * (j + 1), statistics)
            impulse[j + 1], before = statistics.drive_integral[TORQUE], now
        found.append((np.diff(impulse) / step).reshape(cycles, POINTS)[SETTLING:].astype(np.float16))
    return found


def save(path: Path, leg: Drawn, torque: list[np.ndarray], seconds: float) -> None:
    """Write a leg; a file that is there is whole."""
    own, states = leg.parameters, leg.states
    part = path.with_suffix(f".{os.getpid()}.npz")
    np.savez_compressed(
        part, speed=leg.profile.speed, cosine=leg.profile.cosine, sine=leg.profile.sine, mass=own.mass,
        length=own.length, friction=own.friction, peak_n=leg.ground.ground_n if leg.ground else 0.0,
        clearance_m=np.array([one.clearance_m for one in states]),
        state_mass=np.array([one.mass for one in states]),
        state_friction=np.array([one.friction for one in states]),
        state_load=np.array([one.load for one in states]), new=torque[0], changed=np.array(torque[1:]),
        seconds=seconds,
    )  # fmt: skip
    part.rename(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--test", action="store_true", help="test legs, in full coordinates")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--number", type=int, default=5000)
    options = parser.parse_args()
    for seed in range(options.first, options.first + options.number):
        path = options.directory / f"{seed:05d}.npz"
        if path.exists():
            continue
        began, leg = time.process_time(), drawn(seed, options.test)
        try:
            torque = _walked(leg, seed) if options.test else _simulated(leg)
        except LegWearError as error:
            print(f"{seed}: {error}", flush=True)
            continue
        save(path, leg, torque, time.process_time() - began)


if __name__ == "__main__":
    main()
