"""Effect of real drives' currents on the diagnosis, from public recordings that are not in this repository.

DIR contains two folders. `dynamic_calibration` (https://github.com/shamilmamedov/dynamic_calibration) has the
currents of a robot's joints; `real_robot.py` evaluates them. `laas_anti_cogging`
(https://github.com/heitor-andrade/laas_anti_cogging) has the angle and the current of a motor without load,
with controlled speed, at 1 kHz: eight seconds with stick-slip, and eight without.

This current is added to the torque of simulated legs in full coordinates with masses 4 % off, behind gears
and torque constants of drives for legs. The part that repeats with the motor's angle (cogging, ripple, mean
friction) is read at the gear's ratio times the crank angle. The rest (noise, stick-slip) is read at its own
times. Its size is the recorded size, although a motor that turns faster shows less cogging in its current.
The samples go through the observer of the monitor: it has the reference that comes with the package,
commissions the healthy leg, and identifies it if required. Its twin and its checks of size, sign and timing
are not part of the benchmark. Behind a gear the crank turns evenly: ripple of the motor's speed, which its
inertia limits, is less by the square of the ratio there. Without a gear, the crank turns evenly or as the
motor did. Each drive begins with 300 healthy gait cycles. Each opened joint follows these, for 12 gait
cycles. A minute follows with a healthy leg and the current of the other half of the recording.
`python benchmarks/real_drive.py DIR --keep DIRECTORY` takes a quarter of an hour of one core. With
`--as-of-file` it takes a third of this time: it does not identify the leg, and corrects if a name is sure.
"""

import argparse
import functools
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

from diagnosis import CLOCK, NEW, PERIODS, RATE, UNWORN, kept, walked  # first: it sets the threads of numpy

# isort: split
import attrs
import numpy as np
from drives import MASSES
from real_robot import FOLDER as ROBOT
from real_robot import print_tables

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE as DRIVE_TORQUE
from leg_wear_monitor.dynamics.run import CrankMotion, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis import references
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.state import TorqueState
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import gait_samples

FILE = Path("laas_anti_cogging/codes/Testing/speed_data/speed_test.txt")
HEAD = "Time, Position, Velocity, Reference Velocity, Iq, Function Activated"
SETTLED_S = 1.0  # left out at the start of each half
MOTION_S = 2.6  # also for its motion: the turn before is 3 % off, later turns by 0.5 to 1.1 %
ORDERS = (
    180  # waves a motor turn that repeat: in a second at 44 to 51 rpm, 130 to 150 of 500 that 1 kHz shows
)
# Waves of the crank's ripple per turn: the 72 waves of cogging are 14 % of the speed of a motor without load,
# which would take 120 N m on the leg's mean inertia of 0.30 kg m^2; the waves below take 4.
WAVES = 30
GRID = np.linspace(0.0, TURN, 7201)  # of motor angles


NOISE_RAD = 1.0e-3

# torque constant [N m/A] and gear of AK60, AK80-9 and ActPack; and the latter's torque without a gear
DRIVES = ((0.068, 6.0), (0.115, 9.0), (0.1133, 41.5), (4.7, 1.0))
OPENED = tuple((joint, size_mm) for size_mm in (0.45, 1.0) for joint in "ABGIJ")
HEALTHY, WORN = 260, 40
BLOCK = 20  # gait cycles that are drawn together: a multiple of the recorded turns
READY, PIECE = 300, 60  # gait cycles until the leg is identified, and at once
AFTER = 12  # gait cycles of an opened joint: a correction takes ten


class Motor(NamedTuple):
    """A motor that turns without load.

    ``speed`` [rad/s]; ``repeated`` current [A] at the motor angles GRID; ``left`` (n,) the rest of it at 1
    kHz [A]; ``ripple`` (n,) angle minus the angle of an even turn over a number of ``turns`` [rad].
    """

    speed: float
    repeated: np.ndarray
    left: np.ndarray
    ripple: np.ndarray
    turns: int

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Current [A] that repeats, at motor angles (n,) [rad]."""
        return np.interp(angle % TURN, GRID, self.repeated)


def waves(angle: np.ndarray) -> np.ndarray:
    """Columns of a Fourier series of motor angles (n,) [rad]."""
    phase = np.outer(angle, np.arange(1, ORDERS + 1))
    return np.hstack([np.ones((len(angle), 1)), np.cos(phase), np.sin(phase)])


def motors(folder: Path) -> dict[str, Motor]:
    """The two halves of the recording: with stick-slip and without."""
    file = folder / FILE
    if not file.exists():
        raise SystemExit(f"{file}: not there; fetch the public repository into {folder}")
    with file.open() as text:
        if text.readline().strip() != HEAD:
            raise SystemExit(f"{file}: the first line is not {HEAD!r}")
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    found = {}
    for flag in np.unique(rows[:, 5]):
        half = rows[rows[:, 5] == flag]
        time = np.arange(half[0, 0] + SETTLED_S, half[-1, 0], 1.0e-3)
        angle, current = (np.interp(time, half[:, 0], half[:, column]) for column in (1, 4))
        columns = waves(angle)
        series = np.linalg.lstsq(columns, current, rcond=None)[0]
        later = angle[time >= half[0, 0] + MOTION_S]
        turns = int((later[-1] - later[0]) / TURN)
        turned = later[later <= later[0] + TURN * turns] - later[0]
        ripple = turned - np.linspace(0.0, turned[-1], len(turned))
        speed = 1.0e3 * turned[-1] / len(turned)
        even = half[:, 2].std() < 0.3 * speed
        left = current - columns @ series
        found["even" if even else "stick-slip"] = Motor(speed, waves(GRID) @ series, left, ripple, turns)
    return found


def turning(motor: Motor) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle, speed and acceleration of a crank at 60 rpm that turns as a motor did, at RATE a gait cycle."""
    size, count = len(motor.ripple), motor.turns * RATE
    order = np.arange(1, motor.turns * WAVES + 1)
    found = 2.0 * np.fft.rfft(motor.ripple)[order] / size
    even = TURN * np.arange(1, count + 1) / RATE
    wave = found[None] * np.exp(1j * np.outer(even / motor.turns, order))
    own = order / motor.turns  # waves a turn
    return (
        even + (wave - wave[-1]).real.sum(axis=1),
        TURN * (1.0 + (1j * own * wave).real.sum(axis=1)),
        TURN**2 * (-(own**2) * wave).real.sum(axis=1),
    )


def turned(leg: Mechanism, clearance: np.ndarray, cycles: int, motor: Motor) -> np.ndarray:
    """Same as `diagnosis.walked`, for a leg with a crank that turns as a motor did."""
    setup, motions, statistics = prepare(leg), np.array(turning(motor)).T, new_run_statistics(len(leg.joints))
    setup.contacts.clearance[:] = clearance
    count, walk = len(motions), np.empty((cycles * RATE, 4))

    def at(i: int) -> CrankMotion:
        angle, speed, acceleration = motions[i % count]
        return CrankMotion(angle + TURN * motor.turns * (i // count), speed, acceleration)

    before = at(-1)
    run = FullRun(attrs.evolve(setup, speed=before.speed), tolerance_m=1e-9)
    for i in range(len(walk)):
        t, now = (i + 1) / RATE, at(i)
        run.polynomial[:] = quintic(i / RATE, before, 1.0 / RATE, now)
        run.advance(t, statistics)
        walk[i] = t, now.angle, statistics.drive_integral[DRIVE_TORQUE], run.sample().drive_torque
        before = now
    return walk


def received(
    walk: np.ndarray, motor: Motor | None, drive: tuple[float, float], first: int, cycles: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Samples of crank and torque behind a drive, of gait cycles in drawn blocks, and their ends [s]."""
    random, skipped = np.random.default_rng(seed), len(walk) // RATE % BLOCK
    blocks = random.integers((len(walk) // RATE - skipped) // BLOCK, size=-(-cycles // BLOCK))
    rows = (((skipped + BLOCK * blocks) * RATE)[:, None] + np.arange(BLOCK * RATE)).ravel()[: cycles * RATE]
    torque = np.diff(walk[:, 2], prepend=0.0)[rows]
    departure = (walk[:, 1] - TURN * walk[:, 0])[rows]
    time = first + np.arange(cycles * RATE + 1) / RATE
    angle, impulse = TURN * time + np.append(departure[0], departure), np.append(0.0, np.cumsum(torque))
    between = CLOCK / RATE
    stamp = between * np.arange(np.floor(first / between) + 1, np.floor((first + cycles) / between) + 1)
    since = np.maximum(stamp - between, first)
    torque = (np.interp(stamp, time, impulse) - np.interp(since, time, impulse)) / (stamp - since)
    if motor is not None:
        constant, gear = drive
        current = motor.at(gear * np.interp(stamp, time, angle))
        current += motor.left[(random.integers(len(motor.left)) + np.arange(len(stamp))) % len(motor.left)]
        torque += constant * gear * current
    crank = angle[1::5] + NOISE_RAD * random.standard_normal(len(angle[1::5]))
    both = [
        gait_samples(np.round(1e9 * time[1::5]).astype(np.int64), CRANK, crank_angle_rad=crank),
        gait_samples(np.round(1e9 * stamp).astype(np.int64), TORQUE, torque_nm=torque),
    ]
    samples = np.concatenate(both)
    ends = np.interp(TURN * np.arange(first + 1, first + cycles + 1), angle, time)
    return samples[np.argsort(samples["stamp_ns"], kind="stable")], ends


class Monitored:
    """The observer of the monitor on a leg, with its diagnoses, corrections and stops.

    Parameters
    ----------
    leg : Mechanism
        Mechanism as in its file.
    state : TorqueState, optional
        State of the observer after some gait cycles.
    cycle : int
        Their number.
    """

    def __init__(self, leg: Mechanism, state: TorqueState | None = None, cycle: int = 0) -> None:
        self.observer = TorqueObserver(leg, MonitorConfig(), torque_size(build_linkage(leg), TURN), NEW)
        if state is not None:
            self.observer.go_on_from(state)
        self.joints, self.cycle, self.counted = leg.clearance_joints, cycle, NEW.copy()
        self.end_ns = cycle * 10**9
        self.found: dict[str, list[int]] = {}  # gait cycles of each finding

    def add(self, samples: np.ndarray, ends: np.ndarray) -> None:
        """Receive samples up to the ends of gait cycles [s]."""
        at = np.searchsorted(samples["stamp_ns"], np.round(1e9 * ends).astype(np.int64))
        for piece, end in zip(np.split(samples, at), np.round(1e9 * ends).astype(np.int64), strict=False):
            self.observer.add_samples(piece)
            self._end(int(end))

    def _end(self, end_ns: int) -> None:
        """End a gait cycle."""
        begin_ns, self.end_ns = self.end_ns, end_ns
        rpm = 6.0e10 / (end_ns - begin_ns)
        self.observer.ended(
            SimpleNamespace(is_steady=True, cadence_rpm=rpm, begin_ns=begin_ns, stamp_ns=end_ns)
        )
        for _ in range(PERIODS):
            correction = self.observer.end_period(self.counted, UNWORN)
            if correction is not None:
                self._note(f"corrected {correction.subject} {1e3 * correction.value:.2f} mm")
                self.counted = self.counted.copy()
                self.counted[self.joints.index(correction.subject)] = correction.value
                self.observer.corrected(correction, self.counted)
        seen, limit_m = self.observer.diagnosis, self.observer.config.limits.clearance_m
        for change in seen.changes:
            if not change.is_corrected:
                self._note(f"{change.cause.value} {change.subject}".strip())
        for joint, least_m in zip(self.joints, seen.least_m, strict=False):
            if least_m >= limit_m:
                self._note(f"stop {joint}")
        self.cycle += 1

    def _note(self, text: str) -> None:
        self.found.setdefault(text, []).append(self.cycle)


class Case(NamedTuple):
    """A half of the recording, a drive, and whether the crank turns as the motor did."""

    half: str
    drive: tuple[float, float]
    is_turning: bool = False

    @property
    def name(self) -> str:
        """In words."""
        if not self.half:
            return "none"
        constant, gear = self.drive
        through = f"{constant:g} N m/A, gear {gear:g}" if gear != 1.0 else f"{constant:g} N m/A, direct"
        return f"{self.half}, {through}{', as it turned' if self.is_turning else ''}"


def cases() -> Iterator[Case]:
    """All cases, the leg without a drive first."""
    yield Case("", (0.0, 1.0))
    for half in ("even", "stick-slip"):
        yield from (Case(half, drive) for drive in DRIVES)
    yield Case("even", DRIVES[-1], True)


def in_words(found: dict[str, list[int]], since: int = 0) -> str:
    """Findings: the number of gait cycles with each, and the cycles from a given one to the first."""
    each = (f"{text} ({cycles[0] - since + 1}; {len(cycles)})" for text, cycles in found.items())
    return ", ".join(each) or "nothing"


def of_leg(one: Monitored) -> str:
    """The observer's knowledge of a healthy leg, and its findings, in words."""
    state, diagnosis = one.observer.state, one.observer.diagnosis
    sensor, channel, off = state.sensor, state.sensor.channel, one.observer.models.misfit(state)
    unused = ", ".join(f"{cause} {number}" for cause, number in diagnosis.cycles_not_used.items())
    return (
        f"Noise {sensor.noise_nm:.3f} N m, delay {1e3 * channel.delay_s:.2f} ms, low-pass "
        f"{1e3 * channel.time_constant_s:.2f} ms, misfit {off:.2f} after {state.rounds} rounds; not used: "
        f"{unused or 'none'}; found in {one.cycle} healthy gait cycles (first; in how many): "
        f"{in_words(one.found)}."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--hours", type=float, default=2.0, help="of each healthy leg")
    parser.add_argument("--as-of-file", action="store_true", help="do not identify, correct as if it were")
    options = parser.parse_args()
    if options.as_of_file:
        references.ROUNDS = 0
        references.CORRECTED_TO = references.NAMED_TO
    found, leg = motors(options.folder), load_mechanism("bionic_leg")
    print_tables(options.folder / ROBOT)
    mass = np.array([MASSES.get(body, 1.0) for body in leg.bodies])
    real = LegParameters(mass, np.ones(len(mass))).applied(leg)

    @functools.cache
    def walk(case: str, joint: str, size_mm: float) -> np.ndarray:
        clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
        cycles = (WORN if joint else HEALTHY) + (found[case].turns if case else 3)
        name = f"{joint or 'new'} {size_mm:.2f} {case or '0'}.pkl"
        if case:
            return kept(
                options.keep and options.keep / name, lambda: turned(real, clearance, cycles, found[case])
            )
        return kept(
            options.keep and options.keep / name,
            lambda: walked(real, clearance, cycles, 0.0),
        )

    for half, motor in found.items():
        repeated = motor.at(GRID).std()
        print(
            f"\n{half}: {60.0 * motor.speed / TURN:.1f} rpm, {motor.at(GRID).mean():.3f} A in the mean, "
            f"{repeated:.3f} A RMS that repeat with the angle, {motor.left.std():.3f} A RMS left"
        )
    for case in cases():
        motor, turns = found.get(case.half), case.half if case.is_turning else ""
        one, size = Monitored(leg), case.drive[0] * case.drive[1]
        part = functools.partial(received, motor=motor, drive=case.drive)
        for first in range(0, READY, PIECE):
            one.add(*part(walk(turns, "", 0.3), first=first, cycles=PIECE, seed=first))
        then = attrs.evolve(one.observer.state)
        for first in range(READY, READY + round(3600 * options.hours), PIECE):
            one.add(*part(walk(turns, "", 0.3), first=first, cycles=PIECE, seed=first))
        swapped = Monitored(leg, then, READY)
        if motor is not None:
            other = found[next(half for half in found if half != case.half)]
            swapped.add(*part(walk(turns, "", 0.3), motor=other, first=READY, cycles=PIECE, seed=7))
        rms = f"{size * motor.at(GRID).std():.3f} and {size * motor.left.std():.3f}" if motor else "no"
        print(
            f"\n**{case.name}**: {rms} N m RMS on the crank that repeat and that do not. {of_leg(one)} "
            f"With the current of the other half instead, found in the next {PIECE} gait cycles: "
            f"{in_words(swapped.found, READY)}.\n\n"
            "| opened [mm] | found (after gait cycles; in how many) | at the end | clearance ± [mm] |\n"
            "|---|---|---|---|",
            flush=True,
        )
        for joint, size_mm in OPENED:
            worn = Monitored(leg, then, READY)
            worn.add(*part(walk(turns, joint, size_mm), first=READY, cycles=AFTER, seed=7))
            seen, k = worn.observer.diagnosis, leg.clearance_joints.index(joint)
            both = [f"{1e3 * each[k]:.3f}" for each in (seen.clearance_m, seen.sigma_m) if each]
            names = (f"{one.subject or one.cause.value}{'' if one.is_sure else '?'}" for one in seen.changes)
            row = [f"{joint} {size_mm}", in_words(worn.found, READY), ", ".join(names), " ± ".join(both)]
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
