"""The leg in clearance coordinates as a stepper: what advances it, and what is read of it."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.clearance.advance import ADVANCE, advance_clearances, observe
from leg_wear_monitor.dynamics.clearance.basis import is_damped
from leg_wear_monitor.dynamics.clearance.contact import A0, E0, F_T, NX, NY, V0, contact_laws
from leg_wear_monitor.dynamics.clearance.model import (
    ANGLE,
    SPEED,
    ClearanceModel,
    ClearanceState,
    clearance_state,
    clearance_work,
    state_shapes,
)
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_tables
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Flags, Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive, TorqueDrive

INTERVALS = 2048  # of a turn at the setup's speed
TOLERANCE_M = 5.0e-9  # local error of a step in the eccentricities [m]: finer, the means stay as they are
TOLERANCE_RATE = 1.0e4  # 1/s: the same for their rates, over the time a contact takes


class Moment(NamedTuple):
    """One instant of k clearance joints, in the ground's frame.

    ``deviation`` (3, 2) of the toe from the ideal linkage: position [m], velocity, acceleration;
    ``torque`` of the drive [N m]; ``e`` and ``rate`` (k, 2) of the journals' centres [m, m/s];
    ``force`` (k, 2) of the bushing on the journal [N]; ``reaction`` (r,) the torque again, then the two
    components of the force in each ideal joint; ``toe`` (2,) its position [m], zeros without one;
    ``elastic_energy`` of the contacts [J].
    """

    deviation: Floats
    torque: float
    e: Floats
    rate: Floats
    force: Floats
    reaction: Floats
    toe: Floats
    elastic_energy: float


class Snapshot(NamedTuple):
    """All of a stepper's state; a stepper restored from it goes on bit for bit."""

    motion: Floats
    depth: Floats


class ClearanceStepper:
    """The leg in clearance coordinates, advanced over an arbitrary smooth motion of its crank.

    Parameters
    ----------
    setup : Setup
        Its surfaces are worn as the stepper goes.
    interval_s : float, optional
        Time between the instants at which the state exists; `INTERVALS` a turn at the setup's speed if not
        given.
    tolerance_m : float
        Local error allowed in a step; that of the rates is 1e4 times it per second.
    tables : ClearanceTables, optional
        Tables of this setup, if they are there already.

    Raises
    ------
    ConfigError
        For a mechanism that a torque drives: these coordinates need the crank's motion.
    """

    def __init__(
        self,
        setup: Setup,
        interval_s: float | None = None,
        tolerance_m: float = TOLERANCE_M,
        tables: ClearanceTables | None = None,
    ) -> None:
        mechanism = setup.linkage.mechanism
        if not isinstance(mechanism.drive, SpeedDrive):
            raise needs_speed(mechanism)
        self._setup = setup
        self.model = ClearanceModel(
            contacts=setup.contacts,
            tables=tables or build_tables(setup.linkage, setup.contacts),
            interval=interval_s or TURN / abs(setup.speed) / INTERVALS,
            tolerance=np.array([1.0, 1.0 / TOLERANCE_RATE]) / tolerance_m,
            law=contact_laws(setup.contacts),
            damped=int(is_damped(setup.linkage.arrays)),
        )
        self.state: ClearanceState = clearance_state(setup.surfaces.depth, 0.0, setup.speed)
        self.work = clearance_work(self.model, self.state)

    @property
    def time(self) -> float:
        """Time of the last whole interval [s]."""
        return float(self.state.intervals[0] * self.model.interval)

    def init(self, crank_angle: float, speed: float) -> None:
        """Start afresh at a crank angle [rad] and speed [rad/s], time 0, journals centred; wear stays."""
        start = clearance_state(self.state.depth, crank_angle, speed)
        self.state.motion[:] = start.motion

    @property
    def crank_angle(self) -> float:
        """Crank angle at that time [rad]."""
        return float(self.state.drive[ANGLE])

    @property
    def speed(self) -> float:
        """Crank speed at that time [rad/s]."""
        return float(self.state.drive[SPEED])

    @property
    def eccentricity(self) -> Floats:
        """Journals' centres (k, 2) in their bushings [m]; a copy."""
        return self.state.e.reshape(-1, 2).copy()

    @property
    def last_force(self) -> Floats:
        """Magnitude (k,) of the contact forces [N] at the last sample before that time."""
        sample = self.work.start
        return np.asarray(np.hypot(sample[:, F_N], sample[:, F_T]))

    def place(self, eccentricity: Floats) -> None:
        """Put the journals' centres (k, 2) somewhere in their bushings [m]."""
        self.state.e[:] = eccentricity.ravel()

    def drop_pending_wear(self) -> None:
        """Forget the wear that has not been taken off the surfaces yet."""
        self.state.pending[:] = 0.0

    def place_in_snapshot(self, name: str) -> Flags:
        """Where a part of the state (`ClearanceState`) is in a snapshot's ``motion``."""
        shapes = state_shapes(len(self.state.approach))
        names = np.repeat(list(shapes), [int(np.prod(shape)) for shape in shapes.values()])
        return np.asarray(names == name)

    def observe(self) -> Moment:
        """The leg as it is at that time; leaves the state as it is."""
        work, state = self.work, self.state
        energy = observe(self.model, self._setup.surfaces.feeds_back, state, work)
        x, now, start = work.x, work.now, work.start
        n = start[:, [NX, NY]]
        t = np.stack([-n[:, 1], n[:, 0]], axis=1)
        return Moment(
            deviation=_toe_deviations(now.toe, now.speed[0], x[E0], x[V0], x[A0]),
            torque=float(work.reaction[0]),
            e=self.eccentricity,
            rate=state.v.reshape(-1, 2).copy(),
            force=-start[:, F_N, None] * n + start[:, F_T, None] * t,
            reaction=work.reaction.copy(),
            toe=work.toe.copy(),
            elastic_energy=float(energy),
        )

    def advance(self, polynomial: Floats, t_end: float, statistics: RunStatistics) -> tuple[int, int]:
        """Advance by all whole intervals up to a time, and add to run statistics.

        Parameters
        ----------
        polynomial : (7,) array
            Crank angle [rad]: reference time [s], then six coefficients; it holds since the last call.
        t_end : float, s
        statistics : RunStatistics

        Returns
        -------
        status, k : int
            `DONE`, or why it stopped and the clearance joint concerned (-1: none); the state is then that of
            the last whole interval.
        """
        status, k = advance_clearances(
            self.model, self._setup.surfaces.feeds_back, self.state, polynomial, t_end, statistics, self.work
        )
        return int(status), int(k)

    def advance_address(self, polynomial: Floats, statistics: RunStatistics) -> int:
        """Address by which compiled code calls `ADVANCE` with this stepper; compiles it if need be."""
        feeds_back = self._setup.surfaces.feeds_back
        return ADVANCE.address(self.model, feeds_back, self.state, polynomial, 0.0, statistics, self.work)

    def snapshot(self) -> Snapshot:
        """A copy of the whole state."""
        return Snapshot(self.state.motion.copy(), self.state.depth.copy())

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of a stepper of the same setup."""
        self.state.motion[:] = snapshot.motion
        self.state.depth[:] = snapshot.depth


def needs_speed(mechanism: Mechanism) -> ConfigError:
    """Error for a mechanism that a torque drives, constant or a controller's."""
    key = "drive.torque" if isinstance(mechanism.drive, TorqueDrive) else "drive.track"
    return ConfigError(mechanism.source, key, "the clearance model needs drive.speed; try --model full")


def _toe_deviations(toe: Floats, speed: float, e: Floats, v: Floats, a: Floats) -> Floats:
    """Deviation (3, 2) of the toe's position, velocity and acceleration from the ideal linkage.

    Parameters
    ----------
    toe : (2, 1 + 2 d) array
        As the stepper's tables have it: position, its derivative by e, and of that by the crank angle.
    speed : float, rad/s
    e, v, a : (d,) arrays
        Eccentricities and their rates.
    """
    d = len(e)
    by, turning = toe[:, 1 : 1 + d], speed * toe[:, 1 + d :]
    # as the stepper's own largest deviations: without the part by the second derivative, 1e-3 of it
    return np.stack([by @ e, by @ v + turning @ e, by @ a + 2.0 * (turning @ v)])
