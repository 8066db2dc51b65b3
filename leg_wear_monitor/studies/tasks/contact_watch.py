"""A leg watched over whole cycles: at equal steps of its crank, and by its extremes in each cycle."""

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
        return self.stepper.observe()

    def moments(self, statistics: RunStatistics) -> Iterator[Moment]:
        """Moments of the next cycle, from now on at every step; adds to the run statistics meanwhile."""
        for _ in range(SAMPLES):
            yield self.observe()
            self.advance(1, statistics)
