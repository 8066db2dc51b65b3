"""Ground truth of the synthetic leg: full coordinates, with its own clearances and wear."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.full.run import FullRun
from leg_wear_monitor.dynamics.run.drive import CrankMotion, quintic
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.dynamics.run.run_statistics import TORQUE, RunStatistics, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.gait.config import GaitConfig, KnockConfig
from leg_wear_monitor.gait.ground import Ground
from leg_wear_monitor.gait.pace import Pace
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.ground_reaction import GROUND, with_toe_force
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.person import with_person
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism, RevoluteJoint, SpeedDrive

_LONGEST_PIECE_S = 2.0e-3  # longest drive polynomial: follows a ripple of 50 Hz to 1e-9 rad
_PUSH, _PUSH_PHASES = "toe_force_n", 72  # name of a load, and entries of its table
_FRICTION_RAMP_RADPS = 0.05


class Instant(NamedTuple):
    """State of the crank at one time, and the ideal sensor values.

    ``torque_impulse`` is the time integral of the drive torque since the start [N m s]; ``encoder_rad`` are
    the error-free angles of further encoders [rad]; ``torque_nm`` is the present drive torque [N m].
    """

    crank: CrankMotion
    torque_impulse: float
    encoder_rad: tuple[float, ...] = ()
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
        leg = _pushed(mechanism, config.load.toe_force_n)
        if self._ground:
            leg = with_toe_force(leg, self._ground.step(speed))
        setup = _setup(leg, config, speed)
        self.clearance_joints = setup.clearance_joints
        self._foot_loads = [i for i, name in enumerate(leg.loads) if name in (GROUND, _PUSH)]
        self._setup, self._run = setup, FullRun(setup)
        self._knock, self._friction = _checked(config.knock, setup), config.load.friction_nm
        self._sides = _sides(mechanism, config.joint_encoders.joints)
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
        turned = tuple(float(self._run.q[j, 2] - self._run.q[b, 2]) for b, j in self._sides)
        now = self._pace.at(t)
        torque_nm = self._run.sample().drive_torque + self._friction_torque(now.speed)
        return Instant(now, impulse, turned, torque_nm, self.foot_force_n(now.angle))

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
        k = list(self._setup.linkage.mechanism.loads).index(GROUND)
        table = self._run.model.arrays.load_force[k]
        table[: len(force) + 1] = force[-1], *force
        table[len(force) + 1 :] = force[0]


def _setup(mechanism: Mechanism, config: GaitConfig, speed: float) -> Setup:
    """Simulation setup of the leg, with its own clearance joints, clearances and wear."""
    setup = prepare(mechanism, clearances=config.clearance_joints or None, wear=True)
    contacts = setup.contacts
    clearance = np.array(config.clearances_m) if config.clearances_m else contacts.clearance
    if len(clearance) != len(setup.clearance_joints):
        fault = f"has {len(clearance)} values, expected one each for {', '.join(setup.clearance_joints)}"
        raise ConfigError("gait", "clearances_m", fault)
    wear = contacts.wear_coefficient * config.wear_acceleration
    return attrs.evolve(
        setup, contacts=contacts._replace(clearance=clearance, wear_coefficient=wear), speed=speed
    )


def _pushed(mechanism: Mechanism, force_n: float) -> Mechanism:
    """Mechanism with a ground force on its toe, proportional to the toe's depth below its mean height."""
    if force_n == 0.0:
        return mechanism
    if mechanism.toe is None:
        raise ConfigError("gait", "load.toe_force_n", f"{mechanism.source} has no point called toe to push")
    linkage = build_linkage(mechanism)
    position, _, _ = point_motion(one_cycle(linkage, _PUSH_PHASES, TURN), linkage, *mechanism.toe)
    depth = np.maximum(0.0, position[:, 1].mean() - position[:, 1])
    push = force_n * depth / depth.max()
    return with_toe_force(mechanism, np.stack([np.zeros_like(push), push], axis=1), _PUSH)


def _sides(mechanism: Mechanism, joints: Sequence[str]) -> list[list[int]]:
    """Row indices of the bushing body and the journal body of each revolute joint."""
    names = body_names(mechanism)
    for name in joints:
        if not isinstance(mechanism.joints.get(name), RevoluteJoint):
            raise ConfigError("gait", "joint_encoders.joints", f"{name!r} is not a revolute joint")
    return [[names.index(body) for body in mechanism.sides(joint)] for joint in joints]


def _checked(knock: KnockConfig, setup: Setup) -> KnockConfig | None:
    if not knock.joint:
        return None
    if knock.joint not in setup.clearance_joints:
        raise ConfigError(
            "gait", "knock.joint", f"{knock.joint!r} is none of {', '.join(setup.clearance_joints)}"
        )
    return knock
