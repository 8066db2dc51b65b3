"""The gait cycles since the torque is not as predicted, and what explains them."""

from collections.abc import Callable, Sequence

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.torque_causes.explanation import TorqueExplanation
from leg_wear_monitor.twin.statistics import CycleStatistics

_LONGEST = 60  # gait cycles
_FIRST, _EVERY = (3, 5, 10), 20  # gait cycles after which they are explained, then each so many


@attrs.frozen(eq=False)
class MismatchWindow:
    """Gait cycles whose torque is not as predicted.

    Attributes
    ----------
    cycles : tuple of CycleStatistics
        The last ones.
    number : int
        How many there were.
    is_open : bool
        Whether the alarm was present in the last gait cycle.
    explanation : TorqueExplanation or None
        As of the last time it was due; kept while the alarm is latched.
    """

    cycles: tuple[CycleStatistics, ...] = ()
    number: int = 0
    is_open: bool = False
    explanation: TorqueExplanation | None = None

    def with_cycle(
        self,
        statistics: CycleStatistics,
        alarm: Alarm,
        explain: Callable[[Sequence[CycleStatistics]], TorqueExplanation | None],
    ) -> "MismatchWindow":
        """Window after one more gait cycle.

        Parameters
        ----------
        statistics : CycleStatistics
        alarm : Alarm
            ``torque_mismatch`` after that cycle.
        explain : callable
            Explanation of some gait cycles.
        """
        if alarm.level is Level.OK:
            return NO_MISMATCH
        if alarm.present is Level.OK or not statistics.torque.samples:
            return attrs.evolve(self, is_open=False)
        before = self if self.is_open else NO_MISMATCH
        cycles, number = (*before.cycles, statistics)[-_LONGEST:], before.number + 1
        explanation = before.explanation
        if number in _FIRST or number % _EVERY == 0:
            explanation = explain(cycles)
        return MismatchWindow(cycles, number, True, explanation)


NO_MISMATCH = MismatchWindow()
