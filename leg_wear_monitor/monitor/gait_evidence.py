"""Evidence of gait cycles: fit to this leg, torque residuals, impossible torques."""

import math
from collections import Counter
from collections.abc import Callable, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Cause, NamedCause, TorqueExplanation, beyond_friction
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.alarms import BIAS, CAUSES_OF_ALARMS, LAG, Alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import BRIDGE_LIMIT_S, FAULTS, NO_FAULT, Samples
from leg_wear_monitor.twin.statistics import LONGEST, CycleStatistics

# Evidence that the tracked motion is a gait of this leg; without one such cycle, forces are meaningless.


_SLOWEST, _FASTEST = 0.5, 2.0  # cadence over the commanded one
_UNLIKE = 0.8  # unexplained torque over the predicted one
_FLAT = 0.05  # measured torque over the predicted one
_STEEP = 20.0  # likewise; 1/_FLAT, and far beyond what any load or wear adds
_SAMPLES_A_TURN = 12


def _unit_words(measured: float, predicted: float) -> str:
    """Parameters to check if the torque is in a wrong unit; empty if it is not."""
    if not any(1.0 / 3.0 < factor * measured / predicted < 3.0 for factor in (1.0e-3, 1.0e3)):
        return ""
    return (
        "; that is a factor of 1000: check its unit (of a table table.units.drive_torque, "
        "else drive_torque.scale)"
    )


def _difference(cycle: CycleReport) -> float:
    """Difference of measured and predicted torque, as a fraction of the predicted one."""
    if math.isnan(cycle.torque_mismatch):  # explained by load, friction and lag, as in the first gait cycles
        return cycle.residual_torque_rms_nm / cycle.predicted_torque_rms_nm
    return cycle.torque_mismatch


def doubts(cycle: CycleReport, config: MonitorConfig) -> list[str]:
    """Reasons why a gait cycle is probably not from this leg; empty if there are none.

    Parameters
    ----------
    cycle : CycleReport
    config : MonitorConfig
        Gives the commanded cadence.
    """
    commanded, found = config.cadence.commanded_rpm, []
    # a gait cycle with a stop also contains the stopping and starting
    stood = cycle.stamp_ns - cycle.begin_ns > LONGEST * 1.0e9 * cycle.moving_s
    if not (stood or _SLOWEST <= cycle.cadence_rpm / commanded <= _FASTEST):
        found.append(
            f"the crank turns at {cycle.cadence_rpm:.3g} rpm; the commanded cadence is {commanded:.3g} rpm"
        )
    if cycle.torque_samples:
        predicted, measured = cycle.predicted_torque_rms_nm, cycle.measured_torque_rms_nm
        if not _FLAT * predicted <= measured <= _STEEP * predicted and math.isfinite(measured):
            size = f"only {measured:.3g}" if measured < predicted else f"{measured:.3g}"
            found.append(
                f"the drive torque is {size} N m RMS, {predicted:.3g} N m are predicted"
                + _unit_words(measured, predicted)
            )
        elif not (differs := _difference(cycle)) < _UNLIKE:
            found.append(
                "the drive torque does not resemble the predicted torque: they differ by "
                f"{differs:.2g} times the predicted torque"
            )
    return found


@attrs.define
class GaitEvidence:
    """Counts gait cycles that fit this leg, and reports missing conditions.

    Parameters
    ----------
    config : MonitorConfig

    Attributes
    ----------
    believable, doubtful : int
        Numbers of gait cycles that fit this leg, and that do not.
    """

    config: MonitorConfig
    believable: int = 0
    doubtful: int = 0
    _doubts: list[str] = attrs.field(factory=list, init=False)
    _faults: Counter[str] = attrs.field(factory=Counter, init=False)
    _sound: int = attrs.field(default=0, init=False)
    _turned_rad: float = attrs.field(default=0.0, init=False)
    _passed_s: float = attrs.field(default=0.0, init=False)
    _last: tuple[int, float] | None = attrs.field(default=None, init=False)

    def add_samples(self, samples: Samples) -> None:
        """Add samples in the order of arrival."""
        cranks = samples[samples["kind"] == CRANK]
        for fault, number in zip(*np.unique(cranks["fault"], return_counts=True), strict=True):
            if fault != NO_FAULT:
                self._faults[FAULTS[int(fault)]] += int(number)
        sound = cranks[cranks["fault"] == NO_FAULT]
        if not len(sound):
            return
        self._sound += len(sound)
        stamps, angles = sound["stamp_ns"], sound["crank_angle_rad"]
        if self._last is not None:
            stamps, angles = np.append(self._last[0], stamps), np.append(self._last[1], angles)
        self._last = int(stamps[-1]), float(angles[-1])
        steps = np.diff(stamps.astype(float)) / 1e9
        ahead = (steps > 0.0) & (steps <= BRIDGE_LIMIT_S)
        with np.errstate(over="ignore", invalid="ignore"):  # an angle may be any finite number
            turned = (np.diff(angles)[ahead] + math.pi) % TURN - math.pi
        self._turned_rad += abs(float(np.nansum(turned)))
        self._passed_s += float(steps[ahead].sum())

    def add(self, cycle: CycleReport) -> None:
        """Add a gait cycle."""
        found = doubts(cycle, self.config)
        self.believable += not found
        self.doubtful += bool(found)
        self._doubts = self._doubts or found

    def missing(self) -> str:
        """Missing condition for one gait cycle that fits this leg; empty if there is one."""
        if self.believable:
            return ""
        if self.doubtful:
            return "; ".join(self._doubts)
        if not self._sound:
            faults = ", ".join(f"{number} {name}" for name, number in self._faults.items())
            return f"no crank sample can be used ({faults})" if faults else "no crank sample arrived"
        return self._why_none()

    def _why_none(self) -> str:
        """Reason why valid samples form no gait cycle."""
        gap, commanded = BRIDGE_LIMIT_S, self.config.cadence.commanded_rpm
        if not self._passed_s:
            return f"no two of {self._sound} crank samples follow each other within {gap:g} s"
        turns, rate = self._turned_rad / TURN, self._sound / self._passed_s
        rpm, needed = 60.0 * turns / self._passed_s, _SAMPLES_A_TURN * abs(commanded) / 60.0
        if rate < needed:
            return f"crank samples come at {rate:.3g} Hz, too few: {commanded:.3g} rpm need {needed:.3g} Hz"
        if turns < 2.0:
            short = "a whole gait cycle" if turns < 1.0 else "two turns, in which there is a whole gait cycle"
            return f"the crank turns {turns:.2f} times in {self._passed_s:.3g} s: less than {short}"
        if not _SLOWEST <= rpm / abs(commanded) <= _FASTEST:
            return f"the crank turns at {rpm:.3g} rpm; the commanded cadence is {abs(commanded):.3g} rpm"
        return f"the crank turns {turns:.3g} times, but the monitor cannot track a whole gait cycle"


# The gait cycles since the torque is not as predicted, and their explanation.


_LONGEST = 60  # gait cycles
_RISES = 2  # gait cycles of a new torque residual before it is found in the mean of the last cycles
_FIRST, _EVERY = (3, 5, 10), 20  # gait cycles after which they are explained, then each so many


class MismatchWindow:
    """Gait cycles whose torque is not as predicted.

    Attributes
    ----------
    cycles : tuple of CycleStatistics
        The last ones; while the torque is as predicted, the last few that were compared.
    explanation : TorqueExplanation or None
        As of the last time that one was found; kept while the alarm is latched.
    """

    def __init__(self) -> None:
        self.cycles: tuple[CycleStatistics, ...] = ()
        self.explanation: TorqueExplanation | None = None
        self._number, self._is_open = 0, False  # cycles in all; whether the alarm was present in the last one

    def add_cycle(
        self,
        statistics: CycleStatistics,
        alarm: Alarm,
        explain: Callable[[Sequence[CycleStatistics]], TorqueExplanation | None],
    ) -> None:
        """Add a gait cycle.

        Parameters
        ----------
        statistics : CycleStatistics
        alarm : Alarm
            ``torque_mismatch`` after that cycle.
        explain : callable
            Explanation of some gait cycles.
        """
        is_compared = statistics.not_compared is None
        if alarm.level is not Level.OK and alarm.present is Level.OK:
            self.cycles, self._number, self._is_open = (), _FIRST[0], False
        elif alarm.level is Level.OK and is_compared:
            self.cycles = (*self.cycles, statistics)[-_FIRST[0] :]
            self._number, self._is_open, self.explanation = self._number + 1, False, None
        elif alarm.level is not Level.OK and is_compared:
            if not self._is_open:  # the cycles in which the torque residual was found belong to it
                since = self._number if self._number < _FIRST[0] else _RISES - 1
                self.cycles = self.cycles[-since:] if since else ()
                self._number, self._is_open = len(self.cycles), True
            self.cycles, self._number = (*self.cycles, statistics)[-_LONGEST:], self._number + 1
            if self._number in _FIRST or self._number % _EVERY == 0:
                self.explanation = (
                    explain(self.cycles) or self.explanation
                )  # it stays if the rest becomes less


# Checks of the measured torque for an impossible bias or lag: bounds, values, causes.


_SURE = 3.0  # standard deviations


def torque_values(report: CycleReport, max_friction_nm: float) -> dict[str, float]:
    """Values of the alarms in their units, 0 unless significant (three sigma); NaN without a torque."""
    if not report.torque_samples:
        return dict.fromkeys(CAUSES_OF_ALARMS, math.nan)
    lag = NamedCause(Cause.LAG, report.torque_lag_s, report.torque_lag_sigma_s)
    return {BIAS: _surely(_bias(report, max_friction_nm)), LAG: _surely(lag)}


def torque_causes(raised: set[str], report: CycleReport, max_friction_nm: float) -> dict[str, NamedCause]:
    """Cause of each alarm of the torque that is raised."""
    causes = {BIAS: _bias(report, max_friction_nm), LAG: _timing(report)}
    return {name: one for name, one in causes.items() if name in raised}


def _surely(one: NamedCause) -> float:
    """Size of a value beyond its uncertainty, 0 if it is less; NaN (unknown) stays NaN."""
    beyond = abs(one.value) - _SURE * one.sigma
    return beyond if not beyond < 0.0 else 0.0


def _bias(report: CycleReport, max_friction_nm: float) -> NamedCause:
    return beyond_friction(report.friction_nm, report.friction_sigma_nm, max_friction_nm)


def _timing(report: CycleReport) -> NamedCause:
    """A lag, or an offset of the crank: at one speed they look alike."""
    speed = report.cadence_rpm * math.pi / 30.0
    return NamedCause(Cause.TIMING, -report.torque_lag_s * speed, report.torque_lag_sigma_s * abs(speed))


def offset_error_rad(report: CycleReport) -> float:
    """Error of crank.offset_rad [rad], if it causes all of the lag."""
    return -_timing(report).value
