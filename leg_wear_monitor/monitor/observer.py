"""Observers: parts that evaluate the samples in addition to the twin."""

from collections.abc import Mapping, Sequence
from typing import Any

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import CycleReport, Status
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import CycleStatistics


class Observer:
    """An observer of a monitor; each observer defines only the methods that it needs.

    The monitor calls `passed`, `add_samples`, `end_cycle`, `alarm_values`, `judge` and `end_period` in this
    order. All of them depend on the order of the samples only, not on how the stream is cut into blocks.
    """

    def warm_up(self) -> None:
        """Compile, before the first sample."""

    def configure(self, config: MonitorConfig) -> None:
        """Use other parameters from now on."""

    def go_live(self) -> None:
        """Never wait for simulations."""

    def close(self) -> None:
        """Note the content of the last entry of the ledger."""

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""

    def begin_epoch(self) -> None:
        """The stamps begin again at a new origin."""

    def passed(self, piece: Samples, ends_period: bool) -> Samples:
        """Samples that the twin may follow now; of those that are held back, see `unmonitored_s`."""
        del ends_period
        return piece

    @property
    def unmonitored_s(self) -> float:
        """Time of the samples that are held back, as far as the twin does not count it."""
        return 0.0

    def add_samples(self, piece: Samples) -> None:
        """Add samples that the twin follows."""

    def end_cycle(self, statistics: CycleStatistics, is_refused: bool) -> None:
        """Note the end of a gait cycle before it is reported; ``is_refused``: its input has a fault."""

    def alarm_values(self, report: CycleReport) -> Mapping[str, float]:
        """Values of a gait cycle by the names of their alarms."""
        del report
        return {}

    def judge(self, statistics: CycleStatistics, report: CycleReport) -> None:
        """Learn from a gait cycle whose alarms are evaluated."""

    def end_period(self) -> None:
        """Evaluate the gait cycles that ended in an evaluation period."""

    def replaced(self, k: int) -> None:
        """Forget the estimates of the former part of joint k."""

    @property
    def seen(self) -> Sequence[KnownClearance | None]:
        """Estimated clearance of each joint, None if it is not observable; empty without estimates."""
        return ()

    @property
    def shows(self) -> str:
        """Source of the present estimates; empty without estimates."""
        return ""

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Notes for rules of the verdict, a sentence each, by the rule's code."""
        return {}

    @property
    def leg_fields(self) -> Mapping[str, Any]:
        """Fields of the state of the leg that the observer sets."""
        return {}

    @property
    def statuses(self) -> Sequence[Status]:
        """Own statuses for /diagnostics; their names and order are constant."""
        return ()
