"""The gait cycles since the torque is not as predicted, and what explains them."""

from collections.abc import Callable, Sequence

import attrs

from leg_wear_monitor.estimate.cause import TorqueExplanation
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.twin.statistics import CycleStatistics

_LONGEST = 60  # gait cycles
_RISES = 2  # gait cycles of a new mismatch before it is found in the mean of the last ones
_FIRST, _EVERY = (3, 5, 10), 20  # gait cycles after which they are explained, then each so many


@attrs.frozen(eq=False)
class MismatchWindow:
    """Gait cycles whose torque is not as predicted.

    Attributes
    ----------
    cycles : tuple of CycleStatistics
        The last ones; while the torque is as predicted, the last few that were compared.
    number : int
        How many there were.
    is_open : bool
        Whether the alarm was present in the last gait cycle.
    explanation : TorqueExplanation or None
        As of the last time that one was found; kept while the alarm is latched.
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
        is_compared = statistics.not_compared is None
        if alarm.level is Level.OK:
            if not is_compared:
                return self
            return MismatchWindow((*self.cycles, statistics)[-_FIRST[0] :], self.number + 1)
        if alarm.present is Level.OK:
            return attrs.evolve(self, cycles=(), number=_FIRST[0], is_open=False)
        if not is_compared:
            return self
        before = self if self.is_open else self._before()
        cycles, number = (*before.cycles, statistics)[-_LONGEST:], before.number + 1
        explanation = before.explanation
        if number in _FIRST or number % _EVERY == 0:
            explanation = explain(cycles) or explanation  # a cause stays if the mismatch becomes less
        return MismatchWindow(cycles, number, True, explanation)

    def _before(self) -> "MismatchWindow":
        """Window before the first gait cycle with the alarm: those in which it was found."""
        since = self.number if self.number < _FIRST[0] else _RISES - 1
        cycles = self.cycles[-since:] if since else ()
        return MismatchWindow(cycles, len(cycles), explanation=self.explanation)


NO_MISMATCH = MismatchWindow()
