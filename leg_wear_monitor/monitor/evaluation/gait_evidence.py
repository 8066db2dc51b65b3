"""Evidence that the followed motion is a gait of this leg; without one such cycle, forces are meaningless."""

import math
from collections import Counter

import attrs
import numpy as np

from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT, Samples
from leg_wear_monitor.twin.statistics import LONGEST

_SLOWEST, _FASTEST = 0.5, 2.0  # cadence over the commanded one
_UNLIKE = 0.8  # unexplained torque over the predicted one
_FLAT = 0.05  # measured torque over the predicted one
_STEEP = 20.0  # likewise; 1/_FLAT, and far beyond what any load or wear adds
_SAMPLES_A_TURN = 12


def _unit_words(measured: float, predicted: float) -> str:
    """What to look at if the torque is in another unit; empty if it is not."""
    if not any(1.0 / 3.0 < factor * measured / predicted < 3.0 for factor in (1.0e-3, 1.0e3)):
        return ""
    return (
        "; that is a factor of 1000: check its unit (of a table input.units.drive_torque, "
        "else drive_torque.scale)"
    )


def _difference(cycle: CycleReport) -> float:
    """Difference of measured and predicted torque, as a fraction of the predicted one."""
    if math.isnan(cycle.torque_mismatch):  # as in the first gait cycles: with load, friction and lag
        return cycle.residual_torque_rms_nm / cycle.predicted_torque_rms_nm
    return cycle.torque_mismatch


def doubts(cycle: CycleReport, config: MonitorConfig) -> list[str]:
    """Reasons why a gait cycle is unlikely to be one of this leg; empty if there are none.

    Parameters
    ----------
    cycle : CycleReport
    config : MonitorConfig
        Gives the commanded cadence.
    """
    commanded, found = config.cadence.commanded_rpm, []
    # in a gait cycle in which the leg stood, it stopped and started, too
    stood = cycle.stamp_ns - cycle.begin_ns > LONGEST * 1.0e9 * cycle.moving_s
    if not (stood or _SLOWEST <= cycle.cadence_rpm / commanded <= _FASTEST):
        found.append(
            f"the crank turns at {cycle.cadence_rpm:.3g} rpm, the commanded cadence is {commanded:.3g} rpm"
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
                "the drive torque does not resemble the predicted one: they differ by "
                f"{differs:.2g} times the predicted torque"
            )
    return found


@attrs.define
class GaitEvidence:
    """Counts gait cycles that fit this leg, and reports what is missing.

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
        ahead = (steps > 0.0) & (steps <= self.config.tracker.gap_limit_s)
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
        """What is missing for one gait cycle that fits this leg; empty if there is one."""
        if self.believable:
            return ""
        if self.doubtful:
            return "; ".join(self._doubts)
        if not self._sound:
            faults = ", ".join(f"{number} {name}" for name, number in self._faults.items())
            return f"no crank sample can be used ({faults})" if faults else "there is no crank sample"
        return self._why_none()

    def _why_none(self) -> str:
        """Reason why valid samples form no gait cycle."""
        gap, commanded = self.config.tracker.gap_limit_s, self.config.cadence.commanded_rpm
        if not self._passed_s:
            return f"no two of {self._sound} crank samples follow each other within {gap:g} s"
        turns, rate = self._turned_rad / TURN, self._sound / self._passed_s
        rpm, needed = 60.0 * turns / self._passed_s, _SAMPLES_A_TURN * abs(commanded) / 60.0
        if rate < needed:
            return f"crank samples come at {rate:.3g} Hz, too few: {commanded:.3g} rpm need {needed:.3g} Hz"
        if turns < 2.0:
            return (
                f"the crank turns {turns:.2g} times in {self._passed_s:.3g} s: less than a whole gait cycle"
            )
        if not _SLOWEST <= rpm / abs(commanded) <= _FASTEST:
            return f"the crank turns at {rpm:.3g} rpm, the commanded cadence is {abs(commanded):.3g} rpm"
        return f"the crank turns {turns:.3g} times, but its motion cannot be followed over a whole gait cycle"
