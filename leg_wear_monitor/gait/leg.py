"""Ground truth of the synthetic leg: full coordinates, with its own clearances and wear."""

import math
from bisect import bisect_right
from itertools import pairwise
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import (
    TORQUE,
    CrankMotion,
    RunStatistics,
    Setup,
    new_run_statistics,
    quintic,
)
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.gait.config import TEMPLATE, GaitConfig, KnockConfig, LoadConfig, PaceConfig
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.person import (
    GROUND_LOAD,
    Stance,
    nominal_stance,
    stance_template,
    with_person,
    with_toe_force,
)
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive

# The ground under the synthetic leg: a force on its toe that differs from step to step.


POINTS = 512  # entries of the force's table: 2 ms at 60 rpm, a tenth of the transient

_TRANSIENT_S = 0.02
_FURTHEST = 3.0  # bound in standard deviations, so that a stance never overlaps the next one

# Walking on a treadmill, mean of three stances (opensim-models, Rajagopal, grf_walk.mot): coefficients of
# sin(k pi s) of the vertical and of the fore-aft force, over their peaks
_TREADMILL = (
    (0.9697, -0.0111, 0.2704, 0.0111, -0.0928, 0.0058, -0.0567, 0.0148),
    (0.0543, 0.7599, -0.0784, 0.1612, -0.1057, -0.0958, -0.0441, -0.1037),
)


class Ground:
    """Draws the ground's force on the toe, step by step.

    Parameters
    ----------
    mechanism : Mechanism
    config : GaitConfig

    Attributes
    ----------
    swing : float
        Crank angle in the middle of swing, as a fraction of a turn: there, a step begins.

    Raises
    ------
    ConfigError
        If the mechanism has no toe that moves to and fro, or the stance leaves no swing.
    """

    def __init__(self, mechanism: Mechanism, config: GaitConfig) -> None:
        self._load, self._random = config.load, np.random.default_rng([config.seed, 6])
        self._stance = stance = _stance(mechanism, config)
        self._whole = (stance.turned * (stance.toe_off - stance.heel_strike)) % 1.0
        half = 0.5 * (1.0 - self._whole)
        if half < _FURTHEST * self._load.timing_scatter + 0.01:
            fault = f"{self._load.timing_scatter!r} leaves no swing after {self._whole:.2f} turns of stance"
            raise ConfigError("gait", "load.timing_scatter", fault)
        self.swing = stance.toe_off + stance.turned * half

    def step(self, speed: float) -> Floats:
        """Force (POINTS, 2) [N] of the next step at equal steps of the crank angle from 0.

        Parameters
        ----------
        speed : float
            Speed of the crank [rad/s], for the duration of the transient.
        """
        load, stance = self._load, self._stance
        size, late = np.clip(self._random.standard_normal(2), -_FURTHEST, _FURTHEST)
        strike = stance.heel_strike + stance.turned * load.timing_scatter * late
        since = (stance.turned * (np.arange(POINTS) / POINTS - strike)) % 1.0
        vertical, along = _shape(load, since / self._whole)
        risen = since / max(_TRANSIENT_S * abs(speed) / TURN, 1.0 / POINTS)
        vertical += load.heel_strike_transient * np.sin(0.5 * TURN * np.minimum(risen, 1.0)) ** 2
        peak_n = load.ground_n * (1.0 + load.amplitude_scatter * size)
        return np.asarray(
            peak_n * (np.outer(vertical, stance.up) + load.fore_aft * np.outer(along, stance.back))
        )


def _stance(mechanism: Mechanism, config: GaitConfig) -> Stance:
    """Stance of a leg that walks in the first direction of the crank."""
    nominal = nominal_stance(build_linkage(mechanism))
    if nominal.turned * next((rpm for rpm in config.pace.speeds_rpm if rpm), nominal.turned) < 0.0:
        ends = nominal.toe_off, nominal.heel_strike
        nominal = Stance(*ends, -nominal.turned, nominal.up, -nominal.back)
    return nominal


def _shape(load: LoadConfig, s: Floats) -> tuple[Floats, Floats]:
    """Vertical and fore-aft force (n,) over their peaks, at fractions (n,) of stance; 0 beyond 1."""
    if load.shape == TEMPLATE:
        return stance_template(s)
    return _waves(_TREADMILL[0], s), _waves(_TREADMILL[1], s)


def _waves(coefficients: tuple[float, ...], s: Floats) -> Floats:
    waves = np.sin(0.5 * TURN * np.outer(s, np.arange(1, len(coefficients) + 1)))
    return np.where(s <= 1.0, waves @ np.array(coefficients), 0.0)


# Crank motion: a sequence of speeds joined by smooth ramps, with a phase-dependent ripple.


_RIPPLE_PER_TURN = 2.0  # harmonic: the load of a leg has two periods per turn


class Pace:
    """Motion of the crank over time, from angle 0.

    The ramps define the ripple-free angle phi. The crank angle is theta = phi + r / h sin(h phi): the ripple
    amplitude is the fraction r of any speed, and the ripple stops with the crank.
    """

    def __init__(self, config: PaceConfig) -> None:
        self._ramp = config.ramp_s
        self._ripple = config.ripple
        speeds = [rpm * TURN / 60.0 for rpm in config.speeds_rpm]
        # of each change of speed: start time [s], ripple-free start angle [rad], start and end speed [rad/s]
        self._stretches, self._since = [(0.0, 0.0, speeds[0], speeds[0])], [0.0]
        for (_, end), (before, after) in zip(pairwise(config.times_s), pairwise(speeds), strict=True):
            self._stretches.append((end, self._even(end).angle, before, after))
            self._since.append(end)

    def at(self, t: float) -> CrankMotion:
        """Crank motion at a time [s]."""
        angle, speed, acceleration = self._even(t)
        r, h = self._ripple, _RIPPLE_PER_TURN
        sine, factor = math.sin(h * angle), 1.0 + r * math.cos(h * angle)
        return CrankMotion(
            angle + r / h * sine, speed * factor, acceleration * factor - speed * speed * r * h * sine
        )

    def _even(self, t: float) -> CrankMotion:
        """Ripple-free motion: a smooth speed step 10 u^3 - 15 u^4 + 6 u^5, then constant speed."""
        since, angle, before, after = self._stretches[bisect_right(self._since, t) - 1]
        tau, step = t - since, after - before
        if tau >= self._ramp:
            angle = angle + 0.5 * (before + after) * self._ramp + after * (tau - self._ramp)
            return CrankMotion(angle, after, 0.0)
        u = tau / self._ramp
        risen = u * u * u * (10.0 + u * (6.0 * u - 15.0))
        area = u**4 * (2.5 + u * (u - 3.0)) * self._ramp
        slope = 30.0 * u * u * (1.0 + u * (u - 2.0)) / self._ramp
        return CrankMotion(angle + before * tau + step * area, before + step * risen, step * slope)


_LONGEST_PIECE_S = 2.0e-3  # longest drive polynomial: follows a ripple of 50 Hz to 1e-9 rad
_FRICTION_RAMP_RADPS = 0.05


class Instant(NamedTuple):
    """State of the crank at one time, and the ideal sensor values.

    ``torque_impulse`` is the time integral of the drive torque since the start [N m s]; ``torque_nm`` is the
    present drive torque [N m].
    """

    crank: CrankMotion
    torque_impulse: float
    torque_nm: float = math.nan
    foot_force_n: tuple[float, float] = (0.0, 0.0)


class SyntheticLeg:
    """A leg that walks at a given pace.

    Parameters
    ----------
    config : GaitConfig

    Attributes
    ----------
    clearance_joints : tuple of str
        Names of the clearance joints.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(self, config: GaitConfig) -> None:
        mechanism = with_person(load_mechanism(config.mechanism), config.load.person_kg)
        if not isinstance(mechanism.drive, SpeedDrive):
            raise ConfigError(mechanism.source, "drive", "is a torque; a gait needs a crank driven by speed")
        self._pace = Pace(config.pace)
        speed = self._pace.at(0.0).speed
        self._ground = Ground(mechanism, config) if config.load.ground_n else None
        leg = with_toe_force(mechanism, self._ground.step(speed)) if self._ground else mechanism
        setup = _setup(leg, config, speed)
        self.clearance_joints = setup.clearance_joints
        self._foot_loads = [i for i, name in enumerate(leg.loads) if name == GROUND_LOAD]
        self._setup, self._run = setup, FullRun(setup)
        self._knock, self._friction = _checked(config.knock, setup), config.load.friction_nm
        self._statistics: RunStatistics = new_run_statistics(len(mechanism.joints))
        self._friction_impulse = 0.0
        self._cycles: list[tuple[float, Floats]] = [(0.0, self.clearance_m())]

    @property
    def time(self) -> float:
        """Time walked [s]."""
        return self._run.time

    def clearance_m(self) -> Floats:
        """Mean radial clearance (k,) of each clearance joint [m]."""
        opened = self._setup.surfaces.depth.sum(axis=1).mean(axis=1)
        return np.asarray(self._setup.contacts.clearance + opened)

    def advance(self, t: float) -> Instant:
        """Advance the leg to a time [s].

        Raises
        ------
        SimulationError
        """
        pieces = max(1, math.ceil((t - self.time) / _LONGEST_PIECE_S))
        for piece in range(pieces, 0, -1):
            self._step(t if piece == 1 else self.time + (t - self.time) / piece)
        impulse = float(self._statistics.drive_integral[TORQUE]) + self._friction_impulse
        now = self._pace.at(t)
        torque_nm = self._run.sample().drive_torque + self._friction_torque(now.speed)
        return Instant(now, impulse, torque_nm, self.foot_force_n(now.angle))

    def foot_force_n(self, crank_angle: float) -> tuple[float, float]:
        """Force of the ground on the foot in the present step at a crank angle [rad], x and y [N]."""
        arrays, phase = self._run.model.arrays, crank_angle / TURN % 1.0
        x, y = 0.0, 0.0
        for k in self._foot_loads:
            x += float(np.interp(phase, arrays.load_phase[k], arrays.load_force[k, :, 0]))
            y += float(np.interp(phase, arrays.load_phase[k], arrays.load_force[k, :, 1]))
        return x, y

    def _friction_torque(self, speed: float) -> float:
        return self._friction * math.tanh(speed / _FRICTION_RAMP_RADPS)

    def truth(self) -> dict[str, Any]:
        """Ground truth: clearance of each joint at the start, after each cycle, and now [m]."""
        columns = zip(*(clearance.tolist() for _, clearance in self._cycles), strict=True)
        return {
            "mechanism": self._setup.linkage.mechanism.name,
            "walked_s": self.time,
            "cycle_end_s": [time for time, _ in self._cycles],
            "clearance_m": {
                name: [*column, now]
                for name, column, now in zip(
                    self.clearance_joints, columns, self.clearance_m().tolist(), strict=True
                )
            },
        }

    def _step(self, t: float) -> None:
        before = self.time
        if self._knock and before <= self._knock.at_s < t:
            k = self.clearance_joints.index(self._knock.joint)
            self._setup.contacts.clearance[k] = self._knock.clearance_m
        if t <= before:
            return
        start, end = self._pace.at(before), self._pace.at(t)
        self._run.polynomial[:] = quintic(before, start, t - before, end)
        self._run.advance(t, self._statistics)
        self._friction_impulse += self._friction_torque(end.speed) * (t - before)
        if math.floor(start.angle / TURN) != math.floor(end.angle / TURN):
            self._cycles.append((t, self.clearance_m()))
        if self._ground:
            before_step, step = (math.floor(one.angle / TURN - self._ground.swing) for one in (start, end))
            if step != before_step:
                self._load(self._ground.step(end.speed))

    def _load(self, force: Floats) -> None:
        """Let a force (n, 2) [N] act on the toe from now on, closed periodically as in `compile_arrays`."""
        k = list(self._setup.linkage.mechanism.loads).index(GROUND_LOAD)
        table = self._run.model.arrays.load_force[k]
        table[: len(force) + 1] = force[-1], *force
        table[len(force) + 1 :] = force[0]


def _setup(mechanism: Mechanism, config: GaitConfig, speed: float) -> Setup:
    """Simulation setup of the leg, with its own clearance joints, clearances and wear."""
    setup = prepare(mechanism, clearances=config.clearance_joints or None, wear=True)
    contacts = setup.contacts
    clearance = np.array(config.clearances_m) if config.clearances_m else contacts.clearance
    if len(clearance) != len(setup.clearance_joints):
        fault = f"has {len(clearance)} values. Expected one each for {', '.join(setup.clearance_joints)}"
        raise ConfigError("gait", "clearances_m", fault)
    wear = contacts.wear_coefficient * config.wear_acceleration
    return attrs.evolve(
        setup, contacts=contacts._replace(clearance=clearance, wear_coefficient=wear), speed=speed
    )


def _checked(knock: KnockConfig, setup: Setup) -> KnockConfig | None:
    if not knock.joint:
        return None
    if knock.joint not in setup.clearance_joints:
        raise ConfigError(
            "gait", "knock.joint", f"{knock.joint!r} is none of {', '.join(setup.clearance_joints)}"
        )
    return knock
