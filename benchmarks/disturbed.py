"""Healthy and worn legs behind drives and under loads that people have: what the diagnosis says of them.

A leg in full coordinates with masses 4 % off the file walks in the air and under a ground reaction of 100 and
300 N at the toe, which varies by 10 % and by 2 % of the cycle from step to step. Its torque, at 200 Hz with
0.5 N m of noise, comes late, through a low-pass, at a crank angle that is off, with samples lost and stamps
that are off. The first table is of healthy legs: gait cycles drawn in blocks of ten make up two hours of
walking. The second is of joints that open after 90 gait cycles. The reference is that of the file, and no leg
is identified, so that nothing but the channel is found; names may correct wherever they are sure.
`python benchmarks/disturbed.py --keep DIRECTORY` takes half an hour, ten minutes of it again.
"""

import argparse
import functools
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import attrs
import numpy as np
from diagnosis import BODIES, CLOCK, NEW, RATE, UNWORN, kept, measured

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.estimate import identification
from leg_wear_monitor.estimate.signature import TorqueSensor, signatures
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import Mechanism, PhaseLoad
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis import observer, references
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters

MASSES = dict(zip(BODIES, (1.04, 0.96, 1.04, 0.96, 1.04, 0.96, 1.04), strict=True))
# force over its peak in stance, sum of sines of half turns: two overground stances (ground_reaction.json)
STANCE = (1.147, -0.033, 0.325, -0.014, -0.007, -0.026, -0.061, 0.01)
FORE_AFT, PHASES = 0.15, 200
NOISE_NM, BLOCK, COMMISSIONED, HEALTHY, WORN = 0.5, 10, 90, 260, 40
OPENINGS = (("A", 0.45), ("B", 0.45), ("G", 0.42), ("G", 0.6), ("I", 0.6), ("J", 1.0), ("G", 2.0))
DISTURBED = (
    *({"lag": 1.0e-3 * ms} for ms in range(21)),
    *({"offset": rad} for rad in (-0.1, -0.063, -0.03, 0.03, 0.063, 0.1)),
    *({"hz": hz} for hz in (20.0, 30.0, 50.0, 70.0, 100.0)),
    {"hz": 20.0, "lag": 0.01},
    {"loss": 0.02},
    {"jitter": 5.0e-4},
)
ON_GROUND = ({}, {"lag": 0.01}, {"hz": 20.0}, {"hz": 50.0}, {"hz": 20.0, "lag": 0.01}, {"loss": 0.02})
OPENED = ({}, {"lag": 0.01}, {"hz": 20.0}, {"hz": 50.0}, {"hz": 20.0, "lag": 0.01})


def stance(leg: Mechanism) -> tuple[float, float]:
    """Phase at which the toe begins to move as it does on the ground, and for how long."""
    body, point = leg.toe
    linkage = build_linkage(leg)
    place, velocity, _ = point_motion(one_cycle(linkage, PHASES, TURN), linkage, body, point)
    back = velocity[:, 0] < 0.0
    inside = back if place[back, 1].mean() < place[~back, 1].mean() else ~back
    begins = [i for i in range(PHASES) if inside[i] and not inside[i - 1]]
    lengths = {i: next(n for n in range(1, PHASES) if not inside[(i + n) % PHASES]) for i in begins}
    begin = max(lengths, key=lengths.__getitem__)
    return begin / PHASES, lengths[begin] / PHASES


def reaction(phase: np.ndarray, begin: float, length: float) -> np.ndarray:
    """Force (n, 2) on the toe over its vertical peak."""
    part = ((phase - begin) % 1.0) / length
    vertical = sum(c * np.sin((k + 1) * np.pi * part) for k, c in enumerate(STANCE))
    return (part < 1.0)[:, None] * np.stack([-FORE_AFT * np.sin(2.0 * np.pi * part), vertical / 1.2], axis=1)


def walked(leg: Mechanism, clearance: np.ndarray, cycles: int, peak_n: float, seed: int) -> np.ndarray:
    """Time [s], crank angle [rad], impulse [N m s] and instants [N m] of the torque, RATE a gait cycle."""
    contact = stance(leg)
    if peak_n:
        phase = np.arange(PHASES) / PHASES
        force = tuple(map(tuple, peak_n * reaction(phase, *contact)))
        ground = PhaseLoad(body=leg.toe[0], point=leg.toe[1], phase=tuple(phase.tolist()), force=force)
        leg = attrs.evolve(leg, loads={**leg.loads, "ground": ground})
    setup, random = prepare(leg), np.random.default_rng(seed)
    setup.contacts.clearance[:] = clearance
    run = FullRun(attrs.evolve(setup, speed=TURN), tolerance_m=1e-9)
    statistics, arrays, walk = (
        new_run_statistics(len(leg.joints)),
        run.model.arrays,
        np.empty((cycles * RATE, 4)),
    )
    for i in range(len(walk)):
        if peak_n and i % RATE == 0:
            size, shift = 1.0 + 0.1 * random.standard_normal(), 0.02 * random.standard_normal()
            arrays.load_force[0] = size * peak_n * reaction(arrays.load_phase[0] - shift, *contact)
        before, t = i / RATE, (i + 1) / RATE
        begin, end = (SimpleNamespace(angle=TURN * at, speed=TURN, acceleration=0.0) for at in (before, t))
        run.polynomial[:] = quintic(before, begin, t - before, end)
        run.advance(t, statistics)
        walk[i] = t, TURN * t, statistics.drive_integral[TORQUE], run.sample().drive_torque
    return walk


def received(walk: np.ndarray, lag: float = 0.0, hz: float = 0.0, offset: float = 0.0) -> np.ndarray:
    """A walk as its drive reports it: late, behind a first-order low-pass, at a crank angle that is off."""
    walk, step = walk.copy(), 1.0 / RATE
    torque = np.diff(walk[:, 2], prepend=0.0) / step
    if hz:
        part, value = 1.0 - np.exp(-TURN * hz * step), torque[0]
        for i, now in enumerate(torque):
            value += part * (now - value)
            torque[i] = value
    time = walk[:, 0]
    walk[:, 2] = np.interp(time - lag, time, np.cumsum(torque) * step, left=0.0)
    walk[:, 1] += offset + TURN
    return walk


def signed(
    walk: np.ndarray,
    sensor: TorqueSensor,
    seed: int,
    loss: float = 0.0,
    jitter: float = 0.0,
    quantum_nm: float = 0.0,
):
    """Signatures (cycles, F) of a walk; a part of the samples lost, stamps off [s], torque in steps."""
    random = np.random.default_rng(seed)
    if not (loss or jitter or quantum_nm):
        return measured(walk, sensor, NOISE_NM, random)[1:]
    between = sensor.period_s * CLOCK
    time = np.arange(between, walk[-1, 0], between)
    torque = np.diff(np.interp(time, walk[:, 0], walk[:, 2]), prepend=0.0) / between
    torque += NOISE_NM * random.standard_normal(len(time))
    if quantum_nm:
        torque = quantum_nm * np.round(torque / quantum_nm)
    angle = np.interp(time + jitter * random.standard_normal(len(time)), walk[:, 0], walk[:, 1])
    there = random.random(len(time)) >= loss
    step = np.where(np.roll(there, 1), np.diff(torque, prepend=np.nan), np.nan)
    angle, torque, step = angle[there], torque[there], step[there]
    return signatures(np.floor(angle / TURN - 1e-9).astype(np.int64), angle, torque, step, sensor)[3:-1]


def watched(
    leg: Mechanism,
    size_nm: float,
    rows: list[np.ndarray],
    one: observer.TorqueObserver | None = None,
    first: int = 0,
    config: MonitorConfig | None = None,
    periods: int = 1,
    counted_m: np.ndarray = NEW,
) -> tuple[observer.TorqueObserver, list[str]]:
    """The observer after gait cycles with given signatures; what it named, corrected or stopped, and when.

    Goes on with an observer whose gait cycles end before the one with the number ``first``. Of the evaluation
    periods of a gait cycle, all but one can be left out where no reference is made.
    """
    left, reference = iter(rows), shipped_references(leg)[0]
    one = one or observer.TorqueObserver(leg, config or MonitorConfig(), size_nm, NEW)
    counted, found = counted_m.copy(), []
    joints, limit_m, second = leg.clearance_joints, MonitorConfig().limits.clearance_m, 10**9

    def next_cycle(state, begin_ns, end_ns):
        return SignedCycle(begin_ns, end_ns, next(left), reference.profile, 0.0)

    def find(state, *_):
        state.sensor = state.sensor or TorqueSensor(0.005, 1.0, size_nm)

    with mock.patch.multiple(observer, signed_cycle=next_cycle, find_sensor=find):
        for i in range(first, first + len(rows)):
            begin, end = (i + 1) * second, (i + 2) * second
            one.ended(SimpleNamespace(is_steady=True, cadence_rpm=60.0, begin_ns=begin, stamp_ns=end))
            correction = one.end_period(counted, UNWORN)
            for _ in range(periods - 1):
                one.end_period(counted, UNWORN)
            seen = one.diagnosis
            texts = [
                f"{change.cause.name} {change.subject}" for change in seen.changes if not change.is_corrected
            ]
            stops = zip(joints, seen.least_m, strict=False)
            texts += [f"stop {joint}" for joint, least_m in stops if least_m >= limit_m]
            if correction is not None:
                texts.append(f"corrected {correction.subject} {1e3 * correction.value:.3f} mm")
                counted = counted.copy()
                counted[joints.index(correction.subject)] = correction.value
                one.corrected(correction, counted)
            found += [f"{i}: {text}" for text in texts]
    return one, found


def drawn(cycles: np.ndarray, number: int, seed: int = 1) -> list[np.ndarray]:
    """Gait cycles drawn in blocks, after as many consecutive ones as commissioning takes."""
    random = np.random.default_rng(seed)
    begin, order = random.integers(len(cycles) - COMMISSIONED), []
    order += range(begin, begin + COMMISSIONED)
    while len(order) < number:
        begin = random.integers(len(cycles) - BLOCK)
        order += range(begin, begin + BLOCK)
    return [cycles[i] for i in order[:number]]


def cases() -> Iterator[tuple[float, dict]]:
    """Peak of the load [N] and disturbance of each healthy leg."""
    yield from ((0.0, dict(one)) for one in DISTURBED)
    yield from ((peak_n, dict(one)) for peak_n in (100.0, 300.0) for one in ON_GROUND)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--cycles", type=int, default=7200)
    options = parser.parse_args()
    references.ROUNDS, identification.UNLIKE_FILE = 0, references.NAMED_TO
    references.CORRECTED_TO = references.NAMED_TO
    leg = load_mechanism("bionic_leg")
    mass = np.array([MASSES.get(body, 1.0) for body in leg.bodies])
    real = LegParameters(mass, np.ones(len(mass))).applied(leg)
    size = torque_size(build_linkage(leg), TURN)
    sensor = TorqueSensor(0.005, 1.0, size)

    @functools.cache
    def walk(joint: str, size_mm: float, peak_n: float) -> np.ndarray:
        clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
        cycles = WORN if joint else HEALTHY
        file = options.keep / f"{joint or 'new'} {size_mm:.2f} {peak_n:.0f}.pkl" if options.keep else None
        return kept(file, lambda: walked(real, clearance, cycles + 3, peak_n, round(1000 * size_mm)))

    def cycles_of(joint: str, size_mm: float, peak_n: float, seed: int, given: dict) -> np.ndarray:
        own = {name: value for name, value in given.items() if name in ("loss", "jitter")}
        drive = {name: value for name, value in given.items() if name not in own}
        return signed(received(walk(joint, size_mm, peak_n), **drive), sensor, seed, **own)

    print("| load [N] | drive | delay, time constant found [ms] | misfit | findings |\n|---|---|---|---|---|")
    for peak_n, given in cases():
        rows = drawn(cycles_of("", 0.3, peak_n, 5, given), options.cycles)
        one, found = watched(leg, size, rows)
        own, off = one.state.sensor, one.models.misfit(one.state)
        channel = f"{1e3 * own.channel.delay_s:.2f}, {1e3 * own.channel.time_constant_s:.2f}"
        print(f"| {peak_n:.0f} | {given or '-'} | {channel} | {off:.1f} | {found or 'none'} |", flush=True)
    print("\n| load [N] | drive | opened [mm] | found, in cycle | clearance ± |\n|---|---|---|---|---|")
    for peak_n in (0.0, 300.0):
        for given in OPENED:
            healthy = drawn(cycles_of("", 0.3, peak_n, 5, given), COMMISSIONED)
            for joint, size_mm in OPENINGS:
                worn = cycles_of(joint, size_mm, peak_n, 6, given)
                one, found = watched(leg, size, [*healthy, *worn])
                first = {text.partition(": ")[2]: text.partition(":")[0] for text in reversed(found)}
                seen, k = one.diagnosis, leg.clearance_joints.index(joint)
                value = (
                    f"{1e3 * seen.clearance_m[k]:.3f} ± {1e3 * seen.sigma_m[k]:.3f}"
                    if seen.clearance_m
                    else "-"
                )
                when = ", ".join(
                    f"{what} ({int(at) - COMMISSIONED + 1})" for what, at in reversed(first.items())
                )
                print(f"| {peak_n:.0f} | {given or '-'} | {joint} {size_mm} | {when} | {value} |", flush=True)


if __name__ == "__main__":
    main()
