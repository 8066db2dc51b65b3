"""Health of the input over a time: rates, unused samples, lost time, stuck torque."""

import math

import attrs
import numpy as np

from leg_wear_monitor.twin.kinds import CRANK, KINDS
from leg_wear_monitor.twin.sample import FAULTS, MISSING_JOINT, NO_FAULT, Samples
from leg_wear_monitor.twin.statistics import Intake

_LEAST_TORQUES = 10


@attrs.frozen
class TorqueRange:
    """Torques without a fault: their number, extremes, and how many are at each extreme or saturated."""

    number: int = 0
    least_nm: float = math.inf
    largest_nm: float = -math.inf
    at_least: int = 0
    at_largest: int = 0
    saturated: int = 0

    @property
    def stuck_fraction(self) -> float:
        """Fraction of the torques that are saturated, or repeat an extreme; NaN while there are few."""
        if self.number < _LEAST_TORQUES:
            return math.nan
        repeated = max(count for count in (self.at_least, self.at_largest, 1))
        return max(repeated if repeated > 1 else 0, self.saturated) / self.number


def with_torques(before: TorqueRange, samples: Samples, saturation_nm: float) -> TorqueRange:
    """Range extended by the torques of more samples, including efforts in crank samples."""
    found = samples["torque_nm"][samples["fault"] == NO_FAULT]
    found = found[np.isfinite(found)]
    if not len(found):
        return before
    least, largest = min(before.least_nm, float(found.min())), max(before.largest_nm, float(found.max()))
    beyond = np.count_nonzero(np.abs(found) >= saturation_nm) if saturation_nm > 0.0 else 0
    return TorqueRange(
        before.number + len(found),
        least,
        largest,
        int(np.count_nonzero(found == least)) + (before.at_least if least == before.least_nm else 0),
        int(np.count_nonzero(found == largest)) + (before.at_largest if largest == before.largest_nm else 0),
        before.saturated + int(beyond),
    )


@attrs.frozen(kw_only=True)
class InputHealth:
    """Input statistics over a time; an unknown value is NaN.

    Attributes
    ----------
    duration_s : float
        Length of this time; NaN if it is unknown, or stamps did not advance.
    rate_hz : dict of str to float
        Used samples per second, by the names of `KINDS`.
    bad_fraction : float
        Fraction of the samples that were not used: faulty, repeated, late, with a stray stamp, or outliers.
        Messages of other joints do not count while the crank's come.
    lost_fraction : float
        Fraction of the time in which the leg was not followed.
    stuck_torque_fraction : float
        Fraction of the torque samples that are saturated or repeat the largest or the smallest one; 1 if all
        are equal.
    """

    duration_s: float
    rate_hz: dict[str, float]
    bad_fraction: float
    lost_fraction: float
    stuck_torque_fraction: float


def input_health(before: Intake, after: Intake, torque: TorqueRange, is_whole: bool = True) -> InputHealth:
    """Health of the input between two counts.

    Parameters
    ----------
    before, after : Intake
    torque : TorqueRange
        Range of the torques between the two counts.
    is_whole : bool
        Whether all received samples were counted; otherwise the values over time are unknown.
    """
    span_s = (after.newest_stamp_ns - before.newest_stamp_ns) * 1.0e-9
    is_known = is_whole and span_s > 0.0 and before.newest_stamp_ns > 0
    duration_s = span_s if is_known else math.nan
    monitored_s = after.moving_s - before.moving_s + after.standing_s - before.standing_s
    others = of_other_joints(before, after)
    received = after.received - before.received - others
    return InputHealth(
        duration_s=duration_s,
        rate_hz={name: (used - before.used[name]) / duration_s for name, used in after.used.items()},
        bad_fraction=(unused(after) - unused(before) - others) / received if received else math.nan,
        lost_fraction=min(1.0, max(0.0, 1.0 - monitored_s / duration_s)) if is_known else math.nan,
        stuck_torque_fraction=torque.stuck_fraction,
    )


def of_other_joints(before: Intake, after: Intake) -> int:
    """Number of messages without the crank between two counts, if the crank came from another publisher.

    Several drivers may publish joints of one robot on one topic.
    """
    crank, name = KINDS[CRANK].name, FAULTS[MISSING_JOINT]
    has_crank = after.used[crank] > before.used[crank]
    return after.faulty[name] - before.faulty[name] if has_crank else 0


def unused(counts: Intake) -> int:
    """Number of unused samples."""
    faulty = sum(counts.faulty.values())
    return faulty + counts.duplicates + counts.late + counts.stray_stamps + counts.outliers
