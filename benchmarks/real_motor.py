"""A motor without load, from a public recording: its current by angle, what is left of it, and its motion."""

from pathlib import Path
from typing import NamedTuple

import attrs
import numpy as np
from diagnosis import RATE

from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, CrankMotion, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism

FILE = Path("laas_anti_cogging/codes/Testing/speed_data/speed_test.txt")
HEAD = "Time, Position, Velocity, Reference Velocity, Iq, Function Activated"
SETTLED_S = 1.0  # left out at the begin of each half
MOTION_S = 2.6  # and of its motion: the turn before is 3 % off the others, which differ by 0.5 to 1.1 %
ORDERS = (
    180  # waves a motor turn that repeat: in a second at 44 to 51 rpm, 130 to 150 of 500 that 1 kHz shows
)
# of the crank's ripple a turn: the 72 of cogging are 14 % of the speed of a motor without load, which would
# take 120 N m on the leg's mean inertia of 0.30 kg m^2; those below take 4
WAVES = 30
GRID = np.linspace(0.0, TURN, 7201)  # of motor angles


class Motor(NamedTuple):
    """A motor that turns without load.

    ``speed`` [rad/s]; ``repeated`` current [A] at the motor angles GRID; ``left`` (n,) the rest of it at
    1 kHz [A]; ``ripple`` (n,) angle less that of an even turn over a number of ``turns`` [rad].
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
    """As `disturbed.walked`, of a leg whose crank turns as a motor did."""
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
        walk[i] = t, now.angle, statistics.drive_integral[TORQUE], run.sample().drive_torque
        before = now
    return walk
