"""A run of a leg whose first seconds do not count: what it adds up after them."""

from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.result import EnergyBalance
from leg_wear_monitor.dynamics.run import RunStatistics, new_run_statistics
from leg_wear_monitor.dynamics.statistics import energy_balance


def counted(run: FullRun | ClearanceRun, begin: float, end: float) -> tuple[RunStatistics, EnergyBalance]:
    """Statistics and energy balance of a run from a time to another [s]."""
    if begin > 0.0:
        run.advance(begin, new_run_statistics(10))
    statistics, stored = new_run_statistics(10), run.stored_energy
    run.advance(end, statistics)
    return statistics, energy_balance(statistics, stored, run.stored_energy)
