"""Withholds crank angles from the twin that no single leg can send: from two sources, or in another unit."""

import math

import numpy as np

from leg_wear_monitor.monitor.inputs import angle_check as check
from leg_wear_monitor.record import Record, Records, new_records, record_of
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples
from leg_wear_monitor.twin.settings import TrackerSettings

_ALONE_S = 1.0
_DEGREES, _NEAR = 180.0 / math.pi, 1.5  # factor by which a leg may be faster or slower than commanded


class InputGuard:
    """Checks crank samples before the twin follows them.

    An unusable sample gets the fault ``out_of_range``: it is counted, its time is unmonitored, and it adds no
    wear.

    Parameters
    ----------
    settings : TrackerSettings
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self._commanded = abs(settings.commanded_speed_radps)
        gap, speed = settings.bridge_limit_s, settings.commanded_speed_radps
        alone = max(_ALONE_S, gap)
        self._settings = new_records(1, check.SETTINGS)
        self._settings[0] = settings.gate_rad, settings.largest_speed, gap, alone, speed
        self._states = new_records(1, check.STATE)
        self._state: Record = record_of(self._states)

    def warm_up(self) -> None:
        """Compile, before the first sample."""
        self.checked(np.zeros(1, GAIT_SAMPLE))
        self.restore(new_records(1, check.STATE))

    def checked(self, samples: Samples) -> Samples:
        """The same samples; a copy with faults where some cannot be used."""
        fault = np.array(samples["fault"])
        stamp, kind, angle = (np.array(samples[name]) for name in ("stamp_ns", "kind", "crank_angle_rad"))
        check.check_angles(self._settings, self._states, stamp, kind, angle, fault)
        if np.array_equal(fault, samples["fault"]):
            return samples
        samples = samples.copy()
        samples["fault"] = fault
        return samples

    @property
    def stamp_ns(self) -> int:
        """Stamp of the last checked crank sample; 0 before the first."""
        return int(self._state.stamp[self._state.last])

    @property
    def sources(self) -> int:
        """Present number of series of crank angles: 2 if two different ones interleave."""
        return 1 + int(self._state.two)

    @property
    def conflicting(self) -> int:
        """Number of samples withheld because two sources sent them."""
        return int(self._state.conflicting)

    @property
    def implausible(self) -> int:
        """Number of samples withheld because their angle changes as that of no leg."""
        return int(self._state.implausible)

    @property
    def speed_ratio(self) -> float:
        """Speed of the angle over the commanded speed if no leg moves so fast; otherwise NaN."""
        if not self._state.other_unit:
            return math.nan
        return float(self._state.fast_speed) / self._commanded

    @property
    def cause(self) -> str:
        """Reason why crank samples are withheld at present, and what to do; empty if none are."""
        if self.sources > 1:
            return (
                "two series of crank angles interleave and disagree: two publishers of one crank, or an "
                "encoder that jumps; nothing is monitored until one is left"
            )
        ratio = self.speed_ratio
        if math.isnan(ratio):
            return ""
        text = f"the crank's angle runs {ratio:.2g} times as fast as commanded, nothing is monitored: "
        if _DEGREES / _NEAR < ratio < _DEGREES * _NEAR:
            return text + "it seems to be in degrees; radians are expected"
        return text + "check its unit (radians), crank.gear_ratio and cadence.commanded_rpm"

    def snapshot(self) -> Records:
        """A copy of the whole state."""
        return self._states.copy()

    def restore(self, snapshot: Records) -> None:
        """Restore a snapshot of a guard with the same settings."""
        self._states[:] = snapshot
