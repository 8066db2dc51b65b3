"""Health of the input over a time: rates, unused samples and why, lost time, stuck torque; pauses."""

import math
from collections import Counter
from collections.abc import Mapping

import attrs
import numpy as np

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin import CRANK, KINDS, LOAD, TORQUE
from leg_wear_monitor.twin.sample import FAULTS, MISSING_JOINT, NO_FAULT, NOT_FINITE, Samples
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
        are equal. Unknown where the leg stood in this time: a torque at rest does not change.
    """

    duration_s: float
    rate_hz: dict[str, float]
    bad_fraction: float
    lost_fraction: float
    stuck_torque_fraction: float


def input_health(before: Intake, after: Intake, torque: TorqueRange, is_whole: bool) -> InputHealth:
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
    stood = after.standing_s > before.standing_s
    return InputHealth(
        duration_s=duration_s,
        rate_hz={name: (used - before.used[name]) / duration_s for name, used in after.used.items()},
        bad_fraction=(unused(after) - unused(before) - others) / received if received else math.nan,
        lost_fraction=min(1.0, max(0.0, 1.0 - monitored_s / duration_s)) if is_known else math.nan,
        stuck_torque_fraction=math.nan if stood else torque.stuck_fraction,
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
    return faulty + sum(int(getattr(counts, name)) for name in _DROPPED)


# Sentences on unused samples: how many of how many, the fault, and what to do.


_WORTH_TELLING = 0.01  # fraction of the samples; smaller ones are visible in the counters only

_DROPPED = ("duplicates", "late", "stray_stamps", "outliers", "load_outliers")

_SENTENCES = {
    "zero_stamp": "have a zero stamp: set header.stamp",
    "missing_joint": "do not name the crank {crank!r}: set crank_joint to its name in joint_states",
    "empty": "have no name or no position",
    "wrong_length": "have another number of positions, velocities or efforts than of names",
    "not_finite": "have a value that is NaN or infinite ({where})",
    "undecodable": "cannot be decoded: another type or another encoding",
    "wrong_type": "are of a type that is not read",
    "out_of_range": "have an impossible value: angles are in radians, torques in N m",
    "duplicates": "repeat a stamp: two publishers, or a header.stamp that is not renewed",
    "late": "arrive more than tracker.reorder_window_s after newer ones",
    "stray_stamps": "have a stamp far from the others: see the clock of the sender",
    "outliers": "have an angle far from the motion of the others",
    "load_outliers": "have a foot load far from the samples before and after: see the cable of the sensor",
}

_STREAMS = {CRANK: "the crank", TORQUE: "drive_torque", LOAD: "foot_load"}


def with_not_finite(before: Mapping[str, int], samples: Samples) -> Mapping[str, int]:
    """Numbers of samples by stream that have a value that is NaN or infinite, with those of more samples."""
    counts = Counter(before)
    for kind, name in _STREAMS.items():
        own = samples[samples["kind"] == kind]
        finite = np.isfinite(own[KINDS[kind].value])
        is_odd = ~finite.all(axis=tuple(range(1, finite.ndim)))  # a force has two components
        is_odd &= (own["fault"] == NO_FAULT) & (own["stamp_ns"] > 0)
        counts[name] += int(np.count_nonzero(is_odd | (own["fault"] == NOT_FINITE)))
    return counts


def causes(
    before: Intake, after: Intake, withheld: int, config: MonitorConfig, not_finite: Mapping[str, int]
) -> list[str]:
    """Sentences on the unused samples between two counts, the most frequent cause first.

    Parameters
    ----------
    before, after : Intake
    withheld : int
        Number of out-of-range samples that another sentence reports.
    config : MonitorConfig
        Gives the name of the crank.
    not_finite : mapping of str to int
        Of `with_not_finite`, between the two counts.
    """
    others = of_other_joints(before, after)
    received = after.received - before.received - others
    lost = _unused(after, before, withheld, others)
    frequent = [name for name, count in lost.items() if count > _WORTH_TELLING * received]
    where = ", ".join(f"{number} of {stream}" for stream, number in not_finite.items() if number)
    sentences = [
        f"{lost[name]} of {received} samples {_SENTENCES[name].format(crank=config.crank_joint, where=where)}"
        for name in sorted(frequent, key=lambda name: -lost[name])
    ]
    unused = sum(lost.values())
    if sentences and unused > max(lost.values()):  # one cause of several: else its number is taken for all
        sentences[0] = f"{unused} of {received} samples are not used, {sentences[0]}"
    return sentences


def _unused(after: Intake, before: Intake, withheld: int, others: int) -> Mapping[str, int]:
    lost = {name: count - before.faulty[name] for name, count in after.faulty.items()}
    lost["out_of_range"] -= withheld
    lost[FAULTS[MISSING_JOINT]] -= others
    return lost | {name: getattr(after, name) - getattr(before, name) for name in _DROPPED}


# Pauses in a stream of samples: times without a recording, as opposed to faults of the input.


@attrs.frozen
class Pauses:
    """Pauses between recordings.

    Attributes
    ----------
    number : int
    total_s : float
    passed_before_s : float
        Part of the pauses before the last one that the twin's unmonitored time includes.
    last_s : float
        Length of the last pause.
    unmonitored_s : float
        The twin's unmonitored time when the last pause began; it includes the pause once the leg is followed
        again.
    """

    number: int = 0
    total_s: float = 0.0
    passed_before_s: float = 0.0
    last_s: float = 0.0
    unmonitored_s: float = 0.0

    def passed_s(self, unmonitored_s: float) -> float:
        """Part of the pauses that the twin's unmonitored time includes [s]."""
        return self.passed_before_s + min(self.last_s, max(0.0, unmonitored_s - self.unmonitored_s))

    def with_pause(self, pause_s: float, unmonitored_s: float) -> "Pauses":
        """Pauses with one more, at a value of the twin's unmonitored time [s]."""
        return Pauses(
            self.number + 1, self.total_s + pause_s, self.passed_s(unmonitored_s), pause_s, unmonitored_s
        )
