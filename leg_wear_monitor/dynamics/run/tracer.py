"""Traces: samples at equal times, taken on branches of a run so that they do not change the run."""

import math
from typing import Protocol, Self

from leg_wear_monitor.dynamics.run.protocol import Run, Sample
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics

_ROUNDING = 1.0e-9  # tolerance for rounding of sums of steps, as a fraction of a step


class Traceable(Run, Protocol):
    """A run that can be branched."""

    def branch(self) -> Self:
        """An independent copy of the run in its present state."""

    def sample_at(self, t: float) -> Sample:
        """The leg at a time [s] to which the run was advanced, up to its own time step."""


class Tracer:
    """Takes the samples between the instants to which a run is advanced.

    Parameters
    ----------
    run : Traceable
    joints : int
        Number of joints of the mechanism.
    begin, end : float, s
        Begin and end of the trace; no sample is taken at the end.
    step : float, s
        Time between samples; infinite for no samples.

    Attributes
    ----------
    samples : list of Sample
    """

    def __init__(self, run: Traceable, joints: int, begin: float, end: float, step: float) -> None:
        self._run, self._joints, self._begin, self._step = run, joints, begin, step
        self._count = 0 if math.isinf(step) else max(1, math.ceil((end - begin) / step - _ROUNDING))
        self.samples: list[Sample] = []

    def look_ahead(self, t: float) -> None:
        """Take the samples up to a time [s], before the run is advanced to it."""
        branch, statistics = None, new_run_statistics(self._joints)
        while len(self.samples) < self._count:
            due = self._begin + len(self.samples) * self._step
            if due >= t - _ROUNDING * self._step:
                break
            branch = branch or self._run.branch()
            branch.advance(due, statistics)
            self.samples.append(branch.sample_at(due))
