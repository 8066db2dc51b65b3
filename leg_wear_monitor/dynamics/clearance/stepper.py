"""Stepper of the leg in clearance coordinates: advance, observe, snapshot (physics.md section 7)."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.clearance.advance import ADVANCE, advance_clearances, observe
from leg_wear_monitor.dynamics.clearance.basis import is_damped
from leg_wear_monitor.dynamics.clearance.contact import A0, E0, F_T, NX, NY, V0
from leg_wear_monitor.dynamics.clearance.coupling import rigid_coupling
from leg_wear_monitor.dynamics.clearance.film import FILM_X, FILM_Y
from leg_wear_monitor.dynamics.clearance.film_system import film_model
from leg_wear_monitor.dynamics.clearance.joint_laws import contact_laws, have_usual_laws
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

INTERVALS = 2048  # intervals per turn at the setup's speed
TOLERANCE_M = 5.0e-9  # local error of a step in the eccentricities [m]; a smaller one does not change means
TOLERANCE_RATE = 1.0e4  # 1/s: ratio of the rates' tolerance to it, the reciprocal duration of a contact


class Moment(NamedTuple):
    """The leg at one instant, with k clearance joints, in the ground's frame.

    ``deviation`` (3, 2): of the toe from the ideal linkage, position [m], velocity [m/s], acceleration
    [m/s^2];
    ``torque``: of the drive [N m]; ``e`` [m], ``rate`` [m/s] (k, 2): eccentricities and their rates;
    ``force`` (k, 2) [N]: of the bushing on the journal; ``reaction`` (r,): drive torque [N m], then the two
    components of the force in each ideal joint [N]; ``toe`` (2,) [m]: position, zeros without a toe;
    ``elastic_energy``: of the contacts [J].
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
    """Complete state of a stepper; a restored stepper gives bit-identical results."""

    motion: Floats
    depth: Floats


class ClearanceStepper:
    """The leg in clearance coordinates, advanced over an arbitrary smooth motion of its crank.

    Parameters
    ----------
    setup : Setup
        The stepper wears its surfaces.
    interval_s : float, optional
        Time between the instants at which the state exists; default: `INTERVALS` per turn at the setup's
        speed.
    tolerance_m : float
        Local error allowed in a step [m]; that of the rates is `TOLERANCE_RATE` times it [m/s].
    tables : ClearanceTables, optional
        Tables of this setup, to reuse those built before.

    Raises
    ------
    ConfigError
        For a mechanism driven by a torque: clearance coordinates need a given crank motion.
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
            usual=int(have_usual_laws(setup.contacts)),
            film=film_model(setup.contacts, setup.films),
            damped=int(is_damped(setup.linkage.arrays)),
            coupling=rigid_coupling(),
        )
        self.state: ClearanceState = clearance_state(setup.surfaces.depth, 0.0, setup.speed)
        self.work = clearance_work(self.model, self.state)

    @property
    def time(self) -> float:
        """Time of the last whole interval [s]."""
        return float(self.state.intervals[0] * self.model.interval)

    def init(self, crank_angle: float, speed: float) -> None:
        """Reset to time 0, a crank angle [rad] and speed [rad/s], journals centred; the wear stays."""
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
        """Magnitude (k,) of the forces [N] of contact and film at the last sample before that time."""
        if not len(self.model.film.settings):
            sample = self._sample()
            return np.asarray(np.hypot(sample[F_N], sample[F_T]))
        return np.asarray(np.linalg.norm(self._forces(), axis=1))

    def _forces(self) -> Floats:
        """Forces (k, 2) [N] of contact and film on the journals at that sample."""
        sample = self._sample()
        nx, ny = sample[NX], sample[NY]
        force = np.stack([-sample[F_N] * nx - sample[F_T] * ny, -sample[F_N] * ny + sample[F_T] * nx], axis=1)
        films = sample[[FILM_X, FILM_Y]].T if len(self.model.film.settings) else 0.0
        return np.asarray(force + films)

    def _sample(self) -> Floats:
        """The last sample before that time (SAMPLE_ROWS, k)."""
        return self.work.start[:, : len(self.state.approach)]

    def set_eccentricities(self, eccentricity: Floats) -> None:
        """Set the eccentricities (k, 2) [m]."""
        self.state.e[:] = eccentricity.ravel()

    def drop_pending_wear(self) -> None:
        """Discard the wear that is not yet deposited on the surfaces."""
        self.state.pending[:] = 0.0

    def snapshot_mask(self, name: str) -> Flags:
        """Mask (s,) of the entries of a snapshot's ``motion`` that belong to a field of `ClearanceState`."""
        shapes = state_shapes(len(self.state.approach))
        names = np.repeat(list(shapes), [int(np.prod(shape)) for shape in shapes.values()])
        return np.asarray(names == name)

    def observe(self) -> Moment:
        """The leg at that time; does not change the state."""
        work, state = self.work, self.state
        energy = observe(self.model, self._setup.surfaces.feeds_back, state, work)
        x, now = work.x[:, : len(state.e)], work.now
        return Moment(
            deviation=_toe_deviations(now.toe, now.speed[0], x[E0], x[V0], x[A0]),
            torque=float(work.reaction[0]),
            e=self.eccentricity,
            rate=state.v.reshape(-1, 2).copy(),
            force=self._forces(),
            reaction=work.reaction.copy(),
            toe=work.toe.copy(),
            elastic_energy=float(energy),
        )

    def advance(self, polynomial: Floats, t_end: float, statistics: RunStatistics) -> tuple[int, int]:
        """Advance by all whole intervals up to a time, and add to run statistics.

        Parameters
        ----------
        polynomial : (7,) array
            Crank motion since the last call: reference time [s], then six coefficients of the angle [rad].
        t_end : float, s
        statistics : RunStatistics

        Returns
        -------
        status, k : int
            `DONE`, or the reason for stopping and the clearance joint concerned (-1: none); the state is then
            that of the last whole interval.
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
        """Restore a snapshot of a stepper of the same setup."""
        self.state.motion[:] = snapshot.motion
        self.state.depth[:] = snapshot.depth


def needs_speed(mechanism: Mechanism) -> ConfigError:
    """Error for a mechanism that is driven by a constant torque or by a controller."""
    key = "drive.torque" if isinstance(mechanism.drive, TorqueDrive) else "drive.track"
    return ConfigError(mechanism.source, key, "the clearance model needs drive.speed; try --model full")


def _toe_deviations(toe: Floats, speed: float, e: Floats, v: Floats, a: Floats) -> Floats:
    """Deviation (3, 2) of the toe's position, velocity and acceleration from the ideal linkage.

    Parameters
    ----------
    toe : (2, 1 + 2 d) array
        Of the step tables: position, its derivative by e, and the derivative of the latter by the crank
        angle.
    speed : float, rad/s
    e, v, a : (d,) arrays
        Eccentricities and their rates.
    """
    d = len(e)
    by, turning = toe[:, 1 : 1 + d], speed * toe[:, 1 + d :]
    # as in the run statistics, without the second derivative by the crank angle, whose part is 1e-3
    return np.stack([by @ e, by @ v + turning @ e, by @ a + 2.0 * (turning @ v)])
