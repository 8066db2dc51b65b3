"""History of a leg's drive torque: friction at commissioning, lag at other speeds."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.estimate.cause import NamedCause
from leg_wear_monitor.estimate.timing_by_speed import TimingBySpeed
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.twin.statistics import CycleStatistics, NotCompared

COMMISSIONING_CYCLES = 20  # in a row with the torque as predicted, to store their friction as this leg's
FRICTION_KEY, SIGMA_KEY = "friction_commissioned_nm", "friction_commissioned_sigma_nm"

_FORGETTING = 0.99  # per gait cycle
_RESOLVED_RAD = 0.005  # largest standard deviation of a known offset


@attrs.frozen
class TorqueRecord:
    """Stored properties of a leg's drive torque.

    Attributes
    ----------
    cycles : int
        Gait cycles in a row with the torque as predicted, before commissioning.
    friction_nm, sigma_nm : float
        Constant torque at the commissioning of this leg, and its standard deviation; NaN before.
    timing : TimingBySpeed
    not_compared : mapping of str to int
        Gait cycles whose torque was not compared in this run, by the values of `NotCompared`.
    """

    cycles: int = 0
    friction_nm: float = math.nan
    sigma_nm: float = math.nan
    timing: TimingBySpeed = TimingBySpeed()
    not_compared: Mapping[str, int] = attrs.field(factory=dict)

    @property
    def lag_and_offset(self) -> tuple[NamedCause, NamedCause] | None:
        """Lag, and offset of the crank; None while the speeds are too similar to separate them."""
        found = self.timing.split
        return found if found and found[1].sigma < _RESOLVED_RAD else None

    @classmethod
    def of(cls, totals: dict[str, float]) -> "TorqueRecord":
        """Record from the totals in a ledger."""
        return cls(0, totals.get(FRICTION_KEY, math.nan), totals.get(SIGMA_KEY, math.nan))

    @property
    def totals(self) -> dict[str, float]:
        """Totals for the ledger; empty before commissioning."""
        if math.isnan(self.friction_nm):
            return {}
        return {FRICTION_KEY: self.friction_nm, SIGMA_KEY: self.sigma_nm}

    def with_cycle(
        self,
        statistics: CycleStatistics,
        report: CycleReport,
        is_sound: bool,
        not_compared: NotCompared | None = None,
    ) -> "TorqueRecord":
        """Record with one more gait cycle.

        Parameters
        ----------
        statistics : CycleStatistics
        report : CycleReport
        is_sound : bool
            Whether its torque was as predicted.
        not_compared : NotCompared, optional
            Why it was not compared.
        """
        if not report.torque_samples:
            return self
        record = attrs.evolve(self, timing=self._timing_with(statistics))
        if not_compared is not None:
            number = self.not_compared.get(not_compared.value, 0) + 1
            return attrs.evolve(record, not_compared={**self.not_compared, not_compared.value: number})
        if not math.isnan(self.friction_nm):
            return record
        cycles = self.cycles + 1 if is_sound else 0
        if cycles < COMMISSIONING_CYCLES:
            return attrs.evolve(record, cycles=cycles)
        friction_nm, sigma_nm = report.friction_nm, report.friction_sigma_nm
        return attrs.evolve(record, cycles=cycles, friction_nm=friction_nm, sigma_nm=sigma_nm)

    def _timing_with(self, statistics: CycleStatistics) -> TimingBySpeed:
        """The lag by speed with one more gait cycle; unchanged if the cycle has none."""
        lag_s, sigma_s = statistics.torque.cycle_lag_s, statistics.torque.cycle_lag_sigma_s
        if not (math.isfinite(lag_s) and sigma_s > 0.0):
            return self.timing
        speed = statistics.direction * TURN / statistics.moving_s
        return self.timing.with_angle(-lag_s * speed, speed, sigma_s * abs(speed), _FORGETTING)
