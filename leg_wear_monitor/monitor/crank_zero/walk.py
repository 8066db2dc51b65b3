"""Turns of the crank that were walked at the commanded cadence, among the samples that wait."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate.torque_fit.series import Series, series
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

MOST_TURNS = 16  # as many as a sensor that samples instants needs, see docs/appendix/commissioning.md
_STANDS = 0.1  # of a turn in the time of a gait cycle
_LONGEST = 1.5  # times the time of the commanded turns, for slower ones


@attrs.frozen(eq=False)
class Walk:
    """The last turns at the commanded cadence.

    Attributes
    ----------
    turns : int
        Their number, at most `MOST_TURNS`.
    why : str
        Why there are none; empty if there are some.
    crank, torque : Series
        Crank angle up to the unknown zero, counted on over turns [rad], and drive torque [N m] meanwhile.
    """

    turns: int
    why: str
    crank: Series
    torque: Series

    def newest(self, turns: int) -> "Walk":
        """Its newest turns."""
        to_go = np.abs(self.crank.value[-1] - self.crank.value) / TURN
        first = int(np.flatnonzero(to_go >= turns)[-1])
        return _from(self.crank.time_s[first], turns, self.crank, self.torque)


def last_walk(samples: Samples, cadence: Cadence, longest_gap_s: float) -> Walk:
    """The last walk among samples in any order.

    Parameters
    ----------
    samples : (n,) array of GAIT_SAMPLE
    cadence : Cadence
    longest_gap_s : float
        Between crank samples of a turn.
    """
    sound = samples[(samples["fault"] == NO_FAULT) & (samples["stamp_ns"] > 0)]
    origin_ns = int(np.median(sound["stamp_ns"])) if len(sound) else 0
    longest_ns = int(_LONGEST * MOST_TURNS * 60.0e9 / abs(cadence.commanded_rpm))
    sound = sound[np.abs(sound["stamp_ns"] - origin_ns) <= longest_ns]  # and no stray stamps
    crank = _series(sound[sound["kind"] == CRANK], "crank_angle_rad", origin_ns)
    crank = attrs.evolve(crank, value=np.asarray(np.unwrap(crank.value)))
    first, turns, why = _turns(crank, cadence, longest_gap_s)
    torque = _series(sound, "torque_nm", origin_ns)
    return _from(crank.time_s[first], turns, crank, torque) if turns else Walk(0, why, crank, torque)


def _from(begin_s: float, turns: int, crank: Series, torque: Series) -> Walk:
    walked = (torque.time_s >= begin_s) & (torque.time_s <= crank.time_s[-1])
    return Walk(turns, "", _part(crank, crank.time_s >= begin_s), _part(torque, walked))


def _series(samples: Samples, name: str, origin_ns: int) -> Series:
    return series(samples["stamp_ns"], samples[name], np.zeros(len(samples), np.int64), origin_ns)


def _part(whole: Series, which: NDArray[np.bool_]) -> Series:
    return Series(whole.time_s[which], whole.value[which], whole.recording[which])


def _turns(crank: Series, cadence: Cadence, longest_gap_s: float) -> tuple[int, int, str]:
    """Index of the first sample of the last turns, their number, and why there are none."""
    if not len(crank.value):
        return 0, 0, "no crank sample can be used"
    time_s, commanded = crank.time_s, cadence.commanded_rpm
    back: Floats = np.sign(commanded) * (crank.value[-1] - crank.value) / TURN  # turns until now
    is_gap = np.diff(time_s, append=time_s[-1]) > longest_gap_s
    end, turns = len(time_s) - 1, 0
    while turns < MOST_TURNS:
        before = np.flatnonzero(back[: end + 1] >= turns + 1.0)
        if not len(before) or is_gap[before[-1] : end].any():
            break
        rpm = float(np.sign(commanded)) * 60.0 / float(time_s[end] - time_s[before[-1]])
        if abs(rpm - commanded) > cadence.tolerance_rpm:
            break
        end, turns = int(before[-1]), turns + 1
    return end, turns, "" if turns else _why_none(crank, cadence)


def _why_none(crank: Series, cadence: Cadence) -> str:
    """Why the last turn was not walked at the commanded cadence; empty if it was not long enough."""
    cycle_s = 60.0 / abs(cadence.commanded_rpm)
    before = np.flatnonzero(crank.time_s <= crank.time_s[-1] - cycle_s)
    if not len(before):
        return ""
    passed_s = float(crank.time_s[-1] - crank.time_s[before[-1]])
    turned = float(crank.value[-1] - crank.value[before[-1]]) / TURN
    if abs(turned) < _STANDS:
        return "the leg stands"
    rpm = 60.0 * turned / passed_s
    if abs(rpm - cadence.commanded_rpm) <= cadence.tolerance_rpm:
        return ""
    return (
        f"the leg walks at {rpm:.3g} rpm, the commanded cadence is {cadence.commanded_rpm:.3g} ± "
        f"{cadence.tolerance_rpm:.2g} rpm"
    )
