"""The real-time formulation: a stepper that a twin can drive, and a run that a simulation can ask."""

from copy import copy
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.advance import advance_clearances, observe
from leg_wear_monitor.dynamics.clearance.basis import is_damped
from leg_wear_monitor.dynamics.clearance.contact import F_T, contact_laws
from leg_wear_monitor.dynamics.clearance.layout import stored_shapes, views
from leg_wear_monitor.dynamics.clearance.model import (
    ANGLE,
    ClearanceModel,
    ClearanceState,
    clearance_state,
    clearance_work,
)
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_tables
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Sample, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics, new_run_statistics
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive, TorqueDrive

INTERVALS = 2048  # of a turn at the setup's speed
TOLERANCE_M = 5.0e-9  # local error of a step in the eccentricities [m]: finer, the means stay as they are
TOLERANCE_RATE = 1.0e4  # 1/s: the same for their rates, over the time a contact takes
_ROUNDING = 1.0e-6  # of an interval: what is left to a time that falls on a whole one


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


class ClearanceRun:
    """The stepper under a steady crank, as `simulate` wants it.

    Parameters
    ----------
    setup : Setup
    intervals : int
        Of a turn, as `INTERVALS`.
    """

    def __init__(self, setup: Setup, intervals: int = INTERVALS) -> None:
        if not isinstance(setup.linkage.mechanism.drive, SpeedDrive):
            raise needs_speed(setup.linkage.mechanism)
        self.stepper = ClearanceStepper(setup, TURN / abs(setup.speed) / intervals)
        self._setup = setup
        self._polynomial = steady_drive(0.0, setup.speed)

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.stepper.time

    @property
    def stored_energy(self) -> float:
        """Kinetic and potential energy, that of gravity, springs and contacts [J], to the order of e / L."""
        state, tables = self.stepper.state, self.stepper.model.tables
        angle, speed, _ = state.drive
        u = angle / TURN % 1.0 * (len(tables.stored) - 1)
        i = min(int(u), len(tables.stored) - 2)
        row = tables.stored[i] + (u - i) * (tables.stored[i + 1] - tables.stored[i])
        at, e, v = views(row, stored_shapes(len(state.approach))), state.e, state.v
        moving = 0.5 * v @ at["a"] @ v + speed * v @ (at["b"] + at["b_e"] @ e)
        moving += 0.5 * speed**2 * (at["c"][0] + at["c_e"] @ e + 0.5 * e @ at["c_ee"] @ e)
        resting = at["potential"][0] - at["push"] @ e - 0.5 * e @ at["push_e"] @ e
        return float(moving + resting) + self._observe()

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Go on to the last whole interval before a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            Naming the joint, the time and what to try.
        """
        status, k = self.stepper.advance(self._polynomial, t_end, statistics)
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def sample(self) -> Sample:
        """The leg as it is now."""
        self._observe()
        work, tables, contacts = self.stepper.work, self.stepper.model.tables, self._setup.contacts
        force = np.zeros(len(self._setup.linkage.mechanism.joints))
        force[contacts.joint] = np.hypot(work.start[:, F_N], work.start[:, F_T])
        np.add.at(force, tables.reaction_joint[1:], work.reaction[1:] ** 2)
        ideal = tables.reaction_joint[1::2]
        force[ideal] = np.sqrt(force[ideal])
        toe = work.toe.copy() if self._setup.linkage.mechanism.toe else None
        return Sample(float(self.stepper.state.drive[ANGLE]), toe, float(work.reaction[0]), force)

    def branch(self) -> "ClearanceRun":
        """A run of its own that goes on from here; this one stays as it is."""
        surfaces = self._setup.surfaces._replace(depth=self.stepper.state.depth.copy())
        run, model = copy(self), self.stepper.model
        run._setup = attrs.evolve(self._setup, surfaces=surfaces)
        run.stepper = ClearanceStepper(run._setup, model.interval, tables=model.tables)
        run.stepper.restore(self.stepper.snapshot())
        return run

    def sample_at(self, t: float) -> Sample:
        """The leg at a time [s] less than an interval from here; what is left to it is a shorter interval."""
        stepper, rest = self.stepper, t - self.time
        if rest <= _ROUNDING * stepper.model.interval:
            return self.sample()
        run = self.branch()
        run.stepper.model = stepper.model._replace(interval=rest)
        run.stepper.state.intervals[0] = 0.0
        angle, speed, _ = stepper.state.drive
        run._polynomial = steady_drive(angle, speed)
        run.advance(rest, new_run_statistics(len(self._setup.linkage.mechanism.joints)))
        return run.sample()

    def _observe(self) -> float:
        stepper = self.stepper
        return float(observe(stepper.model, self._setup.surfaces.feeds_back, stepper.state, stepper.work))
