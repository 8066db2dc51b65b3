"""A leg watched over whole cycles: at equal steps of its crank, and by its extremes in each cycle."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.batch.leg import Leg
from leg_wear_monitor.dynamics.clearance.advance import observe
from leg_wear_monitor.dynamics.clearance.contact import A0, E0, F_T, NX, NY, V0
from leg_wear_monitor.dynamics.clearance.run import ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.studies.tasks.grid import SAMPLES


class Moment(NamedTuple):
    """One instant of k clearance joints, in the ground's frame.

    ``deviation`` (3, 2) of the toe from the ideal linkage: position [m], velocity, acceleration;
    ``torque`` of the drive [N m]; ``e`` and ``rate`` (k, 2) of the journals' centres [m, m/s];
    ``force`` (k, 2) of the bushing on the journal [N].
    """

    deviation: Floats
    torque: float
    e: Floats
    rate: Floats
    force: Floats


class ObservedLeg:
    """A leg under a steady crank, advanced by whole steps of which `SAMPLES` make a cycle.

    Parameters
    ----------
    leg : Leg
    setup : Setup
        Of this leg, with surfaces of its own.
    tables : ClearanceTables, optional
        Of this setup, if they are there already.
    tolerance_m : float, optional
        As `ClearanceStepper` takes it.
    """

    def __init__(
        self,
        leg: Leg,
        setup: Setup,
        tables: ClearanceTables | None = None,
        tolerance_m: float | None = None,
    ) -> None:
        accuracy = {} if tolerance_m is None else {"tolerance_m": tolerance_m}
        self.setup = setup
        self.stepper = ClearanceStepper(setup, tables=tables, **accuracy)
        leg.start(self.stepper)
        self._polynomial = steady_drive(leg.crank_angle_rad, setup.speed)
        self._step = TURN / abs(setup.speed) / SAMPLES

    def advance(self, steps: int, statistics: RunStatistics) -> None:
        """Advance by some steps, adding to the statistics; raises SimulationError if the motion diverges."""
        done = round(self.stepper.time / self._step)
        status, k = self.stepper.advance(self._polynomial, (done + steps) * self._step, statistics)
        if status != DONE:
            raise stop(self.setup, status, k, self.stepper.time)

    def observe(self) -> Moment:
        """The leg as it is now."""
        stepper = self.stepper
        observe(stepper.model, self.setup.surfaces.feeds_back, stepper.state, stepper.work)
        work = stepper.work
        x, now, start = work.x, work.now, work.start
        normal, friction = start[:, F_N, None], start[:, F_T, None]
        n = start[:, [NX, NY]]
        t = np.stack([-n[:, 1], n[:, 0]], axis=1)
        return Moment(
            deviation=toe_deviations(now.toe, now.speed[0], x[E0], x[V0], x[A0]),
            torque=float(work.reaction[0]),
            e=stepper.state.e.reshape(-1, 2).copy(),
            rate=stepper.state.v.reshape(-1, 2).copy(),
            force=-normal * n + friction * t,
        )

    def moments(self, statistics: RunStatistics) -> Iterator[Moment]:
        """Moments of the next cycle, from now on at every step; adds to the run statistics meanwhile."""
        for _ in range(SAMPLES):
            yield self.observe()
            self.advance(1, statistics)


def toe_deviations(toe: Floats, speed: float, e: Floats, v: Floats, a: Floats) -> Floats:
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
