"""A trace: samples at equal times, taken on branches of a run, which is the same with and without them."""

import math
from typing import Protocol, Self

from leg_wear_monitor.dynamics.run.protocol import Run, Sample
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics

_ROUNDING = 1.0e-9  # of a step: what a sum of steps is off


class Traceable(Run, Protocol):
    """A run that can be left where it is while a copy of it goes on."""

    def branch(self) -> Self:
        """A run of its own that goes on from here; this one stays as it is."""

    def sample_at(self, t: float) -> Sample:
        """The leg at the time [s] that the run was told to go to."""


class Tracer:
    """Takes the samples that fall between the run's own instants.

    Parameters
    ----------
    run : Traceable
    joints : int
        Of the mechanism.
    begin, end : float, s
        Of the trace; no sample is taken at the end.
    step : float, s
        Infinite for no samples.

    Attributes
    ----------
    samples : list of Sample
    """

    def __init__(self, run: Traceable, joints: int, begin: float, end: float, step: float) -> None:
        self._run, self._joints, self._begin, self._step = run, joints, begin, step
        self._count = 0 if math.isinf(step) else max(1, math.ceil((end - begin) / step - _ROUNDING))
        self.samples: list[Sample] = []

    def look_ahead(self, t: float) -> None:
        """Take the samples before a time [s] that the run is about to go to."""
        branch, statistics = None, new_run_statistics(self._joints)
        while len(self.samples) < self._count:
            due = self._begin + len(self.samples) * self._step
            if due >= t - _ROUNDING * self._step:
                break
            branch = branch or self._run.branch()
            branch.advance(due, statistics)
            self.samples.append(branch.sample_at(due))
