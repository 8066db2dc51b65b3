"""Conditions: classes of gait cycles with about the same cadence and load."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.twin.statistics import TorqueProfile

# wear a cycle grows with the second to fourth power of the cadence: within a class it differs by a tenth
_CADENCE_STEP = 0.04
_KEPT = 0.75  # steps from the middle of a class up to which a cycle still belongs to that of the cycle before

_LEAST_PHASES = 32  # with a torque, for a load


class Condition(NamedTuple):
    """Class of a gait cycle: direction, steps of the logarithm of the cadence, and of the load.

    ``load`` is None where the torque does not show one.
    """

    direction: int
    cadence: int
    load: int | None

    def distance(self, other: "Condition") -> float:
        """How unlike another condition is, in steps; a reversal counts as many."""
        load = 0 if self.load is None or other.load is None else abs(self.load - other.load)
        turned = 100.0 if self.direction != other.direction else 0.0
        return turned + abs(self.cadence - other.cadence) + load


def condition_of(cadence_rpm: float, load_steps: float, before: Condition | None = None) -> Condition:
    """Condition of a gait cycle.

    Parameters
    ----------
    cadence_rpm : float
        Negative backward.
    load_steps : float
        As of `measured_load`, in steps; NaN if not known.
    before : Condition, optional
        That of the cycle before, which is kept near the border of two classes.
    """
    direction = 1 if cadence_rpm > 0.0 else -1
    near = before if before is not None and before.direction == direction else None
    cadence = _step(math.log(abs(cadence_rpm)) / _CADENCE_STEP, near.cadence if near else None)
    load = None if math.isnan(load_steps) else _step(load_steps, near.load if near else None)
    return Condition(direction, cadence, load)


def _step(value: float, before: int | None) -> int:
    return before if before is not None and abs(value - before) <= _KEPT else round(value)


def measured_load(profile: TorqueProfile) -> float:
    """Part of a cycle's measured torque that acts as a load at the foot [N]; NaN if not known.

    It contains what the leg itself needs at this cadence, so it compares gait cycles of one cadence only. It
    rests on measured values alone: cycles that are only tracked have it as well.
    """
    known = profile.number > 0.0
    if np.count_nonzero(known) < _LEAST_PHASES:
        return math.nan
    measured = profile.measured_nm[known] / profile.number[known]
    lever = profile.lever_m[known] / profile.number[known]
    lever = lever - lever.mean()
    squares = float(lever @ lever)
    return float(measured @ lever) / squares if squares > 0.0 else math.nan
