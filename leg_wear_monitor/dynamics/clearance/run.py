"""The clearance formulation as a `Run`."""

from copy import copy

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.layout import stored_shapes, views
from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper, needs_speed
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Sample, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics, new_run_statistics
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import SpeedDrive

_ROUNDING = 1.0e-6  # tolerance for rounding of times at whole intervals, as a fraction of an interval


class ClearanceRun:
    """A leg in clearance coordinates with constant crank speed.

    Parameters
    ----------
    setup : Setup
    intervals : int
        Number of intervals per turn, see `INTERVALS`.

    Raises
    ------
    ConfigError
        For a mechanism that is not driven by speed.
    """

    def __init__(self, setup: Setup, intervals: int = INTERVALS) -> None:
        if not isinstance(setup.linkage.mechanism.drive, SpeedDrive):
            raise needs_speed(setup.linkage.mechanism)
        self.stepper = ClearanceStepper(setup, TURN / abs(setup.speed) / intervals)
        self._setup = setup
        self._polynomial = steady_drive(0.0, setup.speed)
        self._ahead: tuple[ClearanceRun, RunStatistics] | None = None

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.stepper.time

    @property
    def stored_energy(self) -> float:
        """Kinetic plus potential energy of gravity, springs and contacts [J], to the order of e / L."""
        state, tables = self.stepper.state, self.stepper.model.tables
        angle, speed, _ = state.drive
        u = angle / TURN % 1.0 * (len(tables.stored) - 1)
        i = min(int(u), len(tables.stored) - 2)
        row = tables.stored[i] + (u - i) * (tables.stored[i + 1] - tables.stored[i])
        at, e, v = views(row, stored_shapes(len(state.approach))), state.e, state.v
        moving = 0.5 * v @ at["a"] @ v + speed * v @ (at["b"] + at["b_e"] @ e)
        moving += 0.5 * speed**2 * (at["c"][0] + at["c_e"] @ e + 0.5 * e @ at["c_ee"] @ e)
        resting = at["potential"][0] - at["push"] @ e - 0.5 * e @ at["push_e"] @ e
        return float(moving + resting) + self.stepper.observe().elastic_energy

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to the last whole interval before a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges; names the joint, the time and what to try.
        """
        status, k = self.stepper.advance(self._polynomial, t_end, statistics)
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def sample(self) -> Sample:
        """The present state of the leg."""
        moment, tables, contacts = self.stepper.observe(), self.stepper.model.tables, self._setup.contacts
        force = np.zeros(len(self._setup.linkage.mechanism.joints))
        force[contacts.joint] = self.stepper.last_force
        np.add.at(force, tables.reaction_joint[1:], moment.reaction[1:] ** 2)
        ideal = tables.reaction_joint[1::2]
        force[ideal] = np.sqrt(force[ideal])
        toe = moment.toe if self._setup.linkage.mechanism.toe else None
        return Sample(self.stepper.crank_angle, toe, moment.torque, force)

    def branch(self) -> "ClearanceRun":
        """An independent copy of the run in its present state."""
        surfaces = self._setup.surfaces._replace(depth=self.stepper.state.depth.copy())
        run, model = copy(self), self.stepper.model
        run._ahead = None
        run._setup = attrs.evolve(self._setup, surfaces=surfaces)
        run.stepper = ClearanceStepper(run._setup, model.interval, tables=model.tables)
        run.stepper.restore(self.stepper.snapshot())
        return run

    def sample_at(self, t: float) -> Sample:
        """The leg at a time [s] less than one interval ahead, reached by one shorter interval."""
        stepper, rest = self.stepper, t - self.time
        if rest <= _ROUNDING * stepper.model.interval:
            return self.sample()
        if self._ahead is None:  # kept for the next sample: to build a stepper takes longer than the interval
            joints = len(self._setup.linkage.mechanism.joints)
            self._ahead = self.branch(), new_run_statistics(joints)
        ahead, statistics = self._ahead
        ahead.stepper.restore(stepper.snapshot())
        ahead.stepper.model = stepper.model._replace(interval=rest)
        ahead.stepper.state.intervals[0] = 0.0
        angle, speed, _ = stepper.state.drive
        ahead._polynomial = steady_drive(angle, speed)
        ahead.advance(rest, statistics)
        return ahead.sample()
