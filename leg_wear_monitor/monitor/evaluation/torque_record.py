"""History of a leg's drive torque: friction at commissioning, lag at other speeds."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.estimate.cause import Cause, NamedCause
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.twin.statistics import CycleStatistics, NotCompared

COMMISSIONING_CYCLES = 20  # in a row with the torque as predicted, to store their friction as this leg's
FRICTION_KEY, SIGMA_KEY = "friction_commissioned_nm", "friction_commissioned_sigma_nm"

_FORGETTING = 0.99  # per gait cycle
_RESOLVED_RAD = 0.005  # largest standard deviation of a known offset


@attrs.frozen
class LagBySpeed:
    """Regression of apparent lags on 1/speed of the crank: a lag is equal at all speeds, an offset is not.

    Attributes
    ----------
    sums : tuple of float
        Sums of weights, and of weights times 1/speed, its square, the lag, and 1/speed times the lag.
    """

    sums: tuple[float, float, float, float, float] = (0.0,) * 5

    def with_cycle(self, statistics: CycleStatistics) -> "LagBySpeed":
        """Regression with one more gait cycle; unchanged if the cycle has no lag."""
        lag_s, sigma_s = statistics.torque.cycle_lag_s, statistics.torque.cycle_lag_sigma_s
        if not (math.isfinite(lag_s) and sigma_s > 0.0):
            return self
        x, w = statistics.direction * statistics.moving_s / TURN, 1.0 / sigma_s**2
        new = (w, w * x, w * x * x, w * lag_s, w * x * lag_s)
        w0, w1, w2, wy, wxy = (_FORGETTING * a + b for a, b in zip(self.sums, new, strict=True))
        return LagBySpeed((w0, w1, w2, wy, wxy))

    @property
    def split(self) -> tuple[NamedCause, NamedCause] | None:
        """Lag, and offset of the crank; None while the speeds are too similar to separate them."""
        w, x, xx, y, xy = self.sums
        if not w > 0.0:
            return None
        spread = xx - x * x / w
        if not spread > _RESOLVED_RAD**-2:
            return None
        late_rad = (xy - x * y / w) / spread
        lag = NamedCause(Cause.LAG, (y - late_rad * x) / w, math.sqrt(xx / (w * spread)))
        return lag, NamedCause(Cause.CRANK_OFFSET, -late_rad, 1.0 / math.sqrt(spread))


@attrs.frozen
class TorqueRecord:
    """Stored properties of a leg's drive torque.

    Attributes
    ----------
    cycles : int
        Gait cycles in a row with the torque as predicted, before commissioning.
    friction_nm, sigma_nm : float
        Constant torque at the commissioning of this leg, and its standard deviation; NaN before.
    lags : LagBySpeed
    not_compared : mapping of str to int
        Gait cycles whose torque was not compared in this run, by the values of `NotCompared`.
    """

    cycles: int = 0
    friction_nm: float = math.nan
    sigma_nm: float = math.nan
    lags: LagBySpeed = LagBySpeed()
    not_compared: Mapping[str, int] = attrs.field(factory=dict)

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
        record = attrs.evolve(self, lags=self.lags.with_cycle(statistics))
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
