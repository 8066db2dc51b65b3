"""The full-coordinate formulation as a `Run`."""

from copy import copy

import attrs
import numpy as np

from leg_wear_monitor.dynamics.full.advance import FullState, advance_full, full_state, full_work
from leg_wear_monitor.dynamics.full.model import full_model, total_energy
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Sample, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import FORCE, TORQUE, RunStatistics, new_run_statistics
from leg_wear_monitor.dynamics.run.toe_deviation import NO_TOE, Toe, ideal_toe
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import ideal_motion, rotated
from leg_wear_monitor.mechanism.position import assemble
from leg_wear_monitor.mechanism.spec import SpeedDrive, TorqueDrive

TOLERANCE_M = (
    1.0e-10  # local error of a step in every coordinate [m, rad]; the energy residual is 1e-3 of the losses
)
TOLERANCE_RATE = 1.0e4  # 1/s: ratio of the velocities' tolerance to it, the reciprocal duration of a contact


class FullRun:
    """A leg in full coordinates that starts from its ideal motion, journals centred (physics.md section 2).

    Parameters
    ----------
    setup : Setup
    tolerance_m : float
        Local error allowed in a step [m or rad]; that of velocities is `TOLERANCE_RATE` times it per second.

    Attributes
    ----------
    state : FullState
        Complete state, the surfaces aside.
    """

    def __init__(self, setup: Setup, tolerance_m: float = TOLERANCE_M) -> None:
        linkage = setup.linkage
        driven = isinstance(linkage.mechanism.drive, SpeedDrive)
        self._setup = setup
        self.model = full_model(linkage.arrays, setup.contacts, driven, setup.films)
        self.state = _start(setup)
        self.toe: Toe = ideal_toe(linkage, setup.speed) if driven else NO_TOE
        self.polynomial = steady_drive(0.0, setup.speed)
        sectors = setup.surfaces.depth.shape[2]
        self._tolerances = tolerance_m, tolerance_m * TOLERANCE_RATE
        self._work = full_work(self.model, *self._tolerances, sectors)
        self.advance(0.0, new_run_statistics(0))  # evaluates the initial state for `sample`

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.state.clock[0])

    @property
    def q(self) -> Floats:
        """Coordinates (n, 3): centre of mass [m] and angle [rad] of every body, ground first."""
        return self.state.y[: len(self.state.y) // 2].reshape(-1, 3)

    @property
    def v(self) -> Floats:
        """Velocities (n, 3)."""
        return self.state.y[len(self.state.y) // 2 :].reshape(-1, 3)

    @property
    def lam(self) -> Floats:
        """Multipliers (m,) of the ideal joints' rows and the drive's, in the order of ``model.rows``."""
        return self._work.scratch.lam

    @property
    def stored_energy(self) -> float:
        """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""
        energy = total_energy(self.model, self._setup.surfaces, self.q, self.v, self._work.scratch)
        return float(energy)

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges; names the joint, the time and what to try.
        """
        status, k = advance_full(
            self.model,
            self._setup.surfaces,
            self.state,
            self.polynomial,
            t_end,
            self.toe,
            statistics,
            self._work,
        )
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def branch(self) -> "FullRun":
        """An independent copy of the run in its present state."""
        run = copy(self)
        surfaces = self._setup.surfaces._replace(depth=self._setup.surfaces.depth.copy())
        run._setup = attrs.evolve(self._setup, surfaces=surfaces)
        run.state = FullState(*(part.copy() for part in self.state))
        run._work = full_work(run.model, *self._tolerances, surfaces.depth.shape[2])
        return run

    def sample_at(self, _t: float) -> Sample:
        """The present state of the leg: this formulation can be advanced to any time."""
        return self.sample()

    def sample(self) -> Sample:
        """The present state of the leg."""
        crank_angle = float(self.q[self.model.arrays.drive_body, 2])
        toe = None
        if self.toe.body >= 0:
            x, y, angle = self.q[self.toe.body]
            toe = rotated(self.toe.point, angle) + np.array([x, y])
        force = self._work.rates[0, :, FORCE].copy()
        return Sample(crank_angle, toe, float(self._work.drive_rates[0, TORQUE]), force)


def _start(setup: Setup) -> FullState:
    """Initial state: the ideal motion at crank angle 0, or at the assembly's angle for a constant torque."""
    linkage = setup.linkage
    if not isinstance(linkage.mechanism.drive, TorqueDrive):
        motion = ideal_motion(linkage, [0.0], setup.speed)
        return full_state(motion.q[0], motion.v[0], len(setup.clearance_joints))
    angle = linkage.mechanism.assembly.crank_angle
    velocity = ideal_motion(linkage, [angle], setup.speed).v[0]
    return full_state(assemble(linkage), velocity, len(setup.clearance_joints))
