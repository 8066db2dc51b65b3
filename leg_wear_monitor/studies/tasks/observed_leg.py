"""A leg sampled at equal crank steps over whole gait cycles, with run statistics."""

from collections.abc import Iterator

from leg_wear_monitor.dynamics.batch.leg import Leg
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, Moment
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.studies.tasks.grid import SAMPLES


class ObservedLeg:
    """A leg with constant crank speed, advanced in steps of 1 / `SAMPLES` of a gait cycle.

    Parameters
    ----------
    leg : Leg
    setup : Setup
        Setup of this leg; its surfaces must not be shared with other legs.
    tables : ClearanceTables, optional
        Tables of this setup, to reuse those built before.
    tolerance_m : float, optional
        Integration tolerance of `ClearanceStepper` [m].
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
        """Advance by a number of steps and add to the run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        done = round(self.stepper.time / self._step)
        status, k = self.stepper.advance(self._polynomial, (done + steps) * self._step, statistics)
        if status != DONE:
            raise stop(self.setup, status, k, self.stepper.time)

    def observe(self) -> Moment:
        """The present state of the leg."""
        return self.stepper.observe()

    def moments(self, statistics: RunStatistics) -> Iterator[Moment]:
        """States at every step of the next cycle, from the present one on; adds to the run statistics."""
        for _ in range(SAMPLES):
            yield self.observe()
            self.advance(1, statistics)
