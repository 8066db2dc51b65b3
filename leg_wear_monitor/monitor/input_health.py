"""The input, judged before any mechanical cause: rates, unused samples, and faults that no leg can have."""

import math
from collections import Counter
from collections.abc import Callable, Mapping

import attrs
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.alarms import amount, time_words
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin import CRANK, KINDS, LOAD, TORQUE
from leg_wear_monitor.twin.sample import (
    FAULTS,
    GAIT_SAMPLE,
    MISSING_JOINT,
    NO_FAULT,
    NOT_FINITE,
    Samples,
    has_value_of,
    is_valid,
    of_crank,
    within,
)
from leg_wear_monitor.twin.statistics import CycleStatistics, Intake, TorqueProfile

_LEAST_TORQUES = 10


@attrs.frozen
class TorqueRange:
    """Torques without a fault: their number, extremes, and how many are at each extreme or saturated."""

    number: int = 0
    least_nm: float = math.inf
    largest_nm: float = -math.inf
    at_least: int = 0
    at_largest: int = 0

    @property
    def stuck_fraction(self) -> float:
        """Fraction of the torques that repeat an extreme; NaN while there are few."""
        if self.number < _LEAST_TORQUES:
            return math.nan
        repeated = max(self.at_least, self.at_largest)
        return repeated / self.number if repeated > 1 else 0.0


def with_torques(before: TorqueRange, samples: Samples) -> TorqueRange:
    """Range extended by the torques of more samples, including efforts in crank samples."""
    found = samples["torque_nm"][samples["fault"] == NO_FAULT]
    found = found[np.isfinite(found)]
    if not len(found):
        return before
    least, largest = min(before.least_nm, float(found.min())), max(before.largest_nm, float(found.max()))
    return TorqueRange(
        before.number + len(found),
        least,
        largest,
        int(np.count_nonzero(found == least)) + (before.at_least if least == before.least_nm else 0),
        int(np.count_nonzero(found == largest)) + (before.at_largest if largest == before.largest_nm else 0),
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
        Fraction of the time in which the leg was not tracked.
    stuck_torque_fraction : float
        Fraction of the torque samples that repeat the largest or the smallest one; 1 if all
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
        True if all received samples were counted; otherwise the values over time are unknown.
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
    """Number of messages without the crank between two counts, if the crank came from a different publisher.

    Several drivers may publish joints of one robot on one topic.
    """
    crank, name = KINDS[CRANK].name, FAULTS[MISSING_JOINT]
    has_crank = after.used[crank] > before.used[crank]
    return after.faulty[name] - before.faulty[name] if has_crank else 0


def unused(counts: Intake) -> int:
    """Number of unused samples."""
    faulty = sum(counts.faulty.values())
    return faulty + sum(int(getattr(counts, name)) for name in _DROPPED)


# Sentences on unused samples: their number, the fault, and the remedy.


_WORTH_TELLING = 0.01  # fraction of the samples; smaller ones are visible in the counters only

_DROPPED = ("duplicates", "late", "stray_stamps", "outliers", "load_outliers")

_SENTENCES = {
    "zero_stamp": "have a zero stamp: set header.stamp",
    "missing_joint": "do not name the crank {crank!r} exactly once: set crank_joint to its name in "
    "joint_states",
    "empty": "have no name or no position",
    "wrong_length": "have different numbers of positions, velocities or efforts and names",
    "not_finite": "have a value that is NaN or infinite ({where})",
    "undecodable": "cannot be decoded: wrong type or encoding",
    "wrong_type": "are of a type that is not read",
    "out_of_range": "have an impossible value or a torque far from the other torques (units are rad and N m)",
    "duplicates": "repeat a stamp: two publishers, or a header.stamp that is not renewed",
    "late": "arrive more than 20 ms after newer ones",
    "stray_stamps": "have a stamp far from the other stamps: check the clock of the sender",
    "outliers": "have an angle far from the motion of the crank",
    "load_outliers": "have a foot load far from the samples before and after: check the cable of the sensor",
}

_STREAMS = {CRANK: "the crank", TORQUE: "drive_torque", LOAD: "foot_load"}


def with_not_finite(before: Mapping[str, int], samples: Samples) -> Mapping[str, int]:
    """Number of samples per stream with a NaN or infinite value, after adding the given samples."""
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
        Number of out-of-range samples that a different sentence reports.
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
    # one cause of several; without the total, its number would be taken for the total
    if sentences and unused > max(lost.values()):
        sentences[0] = f"{unused} of {received} samples are not used; most frequent fault: {sentences[0]}"
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
        The twin's unmonitored time when the last pause began; it includes the pause once the leg is tracked
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


# Faults of a stream that no leg can have, judged on about a gait cycle of samples.
#
# Each fault has a rule: its code, its stream, a predicate that gives the words of its sentence, the sentence,
# and the remedy. The first rule of a stream that holds is the fault. While it is present, the gait cycles of
# this stream say nothing of the leg: they raise no mechanical alarm, and no estimator uses them.


@attrs.frozen(eq=False)
class Stretch:
    """Samples of about one gait cycle, in the order of their stamps.

    Attributes
    ----------
    crank_ns, angle : (n,) arrays
        Stamps, and crank angles that count on over turns [rad].
    torque_ns, torque : (m,) arrays
        Stamps, and drive torques on the crank [N m].
    repeated : float
        Fraction of the crank samples that repeat a stamp with a different angle.
    spikes : float
        Fraction of the torques that are outliers or no numbers; 0 if they are few.
    size_nm : float
        RMS of the predicted drive torque.
    config : MonitorConfig
    """

    crank_ns: Ints
    angle: Floats
    torque_ns: Ints
    torque: Floats
    repeated: float
    spikes: float
    size_nm: float
    config: MonitorConfig

    @classmethod
    def of(cls, samples: Samples, spikes: float, size_nm: float, config: MonitorConfig) -> "Stretch":
        """Statistics of some samples in any order."""
        cranks, torques = (within(part, 1, 2**63 - 1) for part in (of_crank(samples), of_torque(samples)))
        angle = np.unwrap(cranks["crank_angle_rad"], period=TURN)
        every = of_crank(samples)
        different = np.unique(every[["stamp_ns", "crank_angle_rad"]])  # with two publishers, all are equal
        repeated = 1.0 - len(cranks) / max(1, len(different))
        return cls(
            crank_ns=cranks["stamp_ns"],
            angle=angle,
            torque_ns=torques["stamp_ns"],
            torque=torques["torque_nm"],
            repeated=repeated,
            spikes=spikes,
            size_nm=size_nm,
            config=config,
        )

    @property
    def turned_rad(self) -> float:
        """Angle by which the crank turned."""
        return float(abs(self.angle[-1] - self.angle[0])) if len(self.angle) else 0.0

    @property
    def period_s(self) -> float:
        """Mean time between two crank samples."""
        return 1.0e-9 * float(self.crank_ns[-1] - self.crank_ns[0]) / max(1, len(self.crank_ns) - 1)

    @property
    def speed(self) -> float:
        """Mean size of the crank's speed [rad/s]."""
        return self.turned_rad / (self.period_s * (len(self.crank_ns) - 1))

    @property
    def commanded(self) -> float:
        """Commanded size of the crank's speed [rad/s]."""
        return abs(self.config.cadence.commanded_rpm) * TURN / 60.0


def of_torque(samples: Samples) -> Samples:
    """Samples with a possible drive torque."""
    is_possible = np.abs(samples["torque_nm"]) <= KINDS[TORQUE].largest
    known: Samples = samples[is_valid(samples) & has_value_of(samples, TORQUE) & is_possible]
    return known


def _without_number(samples: Samples) -> int:
    """Number of drive torques that are NaN or infinite, in their own stream or among the efforts."""
    is_known = np.isin(samples["fault"], (NO_FAULT, NOT_FINITE))
    is_number = np.isfinite(samples["torque_nm"]) & (samples["fault"] == NO_FAULT)
    own = np.count_nonzero(is_known & (samples["kind"] == TORQUE) & ~is_number)
    has_effort = np.isfinite(samples["torque_nm"][is_known & (samples["kind"] == CRANK)])
    return int(own) + (int(np.count_nonzero(~has_effort)) if has_effort.any() else 0)


_LEAST = 20  # samples of a stretch: fewer say nothing of its stamps and its values
_MOVING_RAD, _STILL_RAD = 0.5, 1.0e-3  # turned in a stretch: the crank turns, it stands
_SCATTERED, _SCATTERED_RAD = 0.12, 3.0e-3  # scatter of stamps: over the period, and times the crank's speed
_COARSE = 0.2  # fraction of crank samples that repeat a stamp, by a coarse clock
_HELD, _HELD_RAD = 2.5, 0.05  # samples that repeat a value, and the angle that the crank turns meanwhile
_NO_VARIATION, _SWINGS = 1.0e-3, 0.5  # standard deviation of a torque, as a fraction of the predicted RMS
_FROZEN = 0.2  # fraction of a gait cycle in which a torque that freezes has the same value
_STEADY = 0.5  # largest relative difference of the speeds in two halves of a stretch
_IN_TURNS = 0.1  # largest relative difference from the commanded speed, if in turns instead of radians
_AT_END, _BESIDE = 0.05, 4  # fraction of torques at the ends of a range; times as often as the next value
# fraction of torque samples that are outliers or no numbers: fewer are counted and left out, so many are a
# fault until they are far fewer, because the time over which the next torque is a mean is not known
_SPIKES, _FEWER_SPIKES = 0.05, 0.02
_LEAST_SPIKES = 10  # a smaller number may coincide by chance
_ALIKE = 0.5  # correlation of torques over the crank angle
_PHASES = (32, 16)  # phases of a gait cycle in which torques are compared
_LEAST_A_PHASE = 2.0  # samples in each, on average

Words = Mapping[str, str]


def _unit(one: Stretch) -> Words | None:
    """An angle in turns, continuous or wrapped to a turn."""
    turns, middle = np.unwrap(one.angle, period=1.0), len(one.angle) // 2
    passed_s = 1.0e-9 * np.diff(one.crank_ns[[0, middle, -1]])
    if not (passed_s > 0.0).all():
        return None
    halves = np.abs(np.diff(turns[[0, middle, -1]])) / passed_s / one.commanded
    ratio = float(np.mean(halves))
    # a leg that starts or stops has this speed on average at times, but never in both halves
    if abs(ratio * TURN - 1.0) > _IN_TURNS or np.ptp(halves) > _STEADY * ratio:
        return None
    return {"size": f"{ratio:.3g}", "ratio": f"{one.config.crank.gear_ratio / TURN:.6g}"}


def _stamps(one: Stretch) -> Words | None:
    """Compare how smooth the angle is over the stamps with how smooth it is from sample to sample.

    Stamps of the measurement may be irregular: the angle is then smooth over them. Stamps of the arrival do
    not belong to the angles, which are smooth from sample to sample.
    """
    if one.repeated > _COARSE:  # the stamps of several samples are rounded to one
        scatter_s, percent = one.period_s / math.sqrt(12.0), 100.0 / math.sqrt(12.0) / (1.0 - one.repeated)
        return {"size": amount(scatter_s, "s"), "percent": f"{percent:.0f}"}
    steps = np.diff(one.crank_ns) * 1.0e-9
    if np.mean(np.abs(steps / one.period_s - 1.0)) < _SCATTERED:
        return None
    before, here, after = one.angle[:-2], one.angle[1:-1], one.angle[2:]
    by_stamp = here - before - (after - before) * steps[:-1] / (steps[:-1] + steps[1:])
    by_number = here - 0.5 * (before + after)
    scatter_s = float(np.sqrt(np.mean(by_stamp**2) / 1.5)) / one.speed
    # medians, because a few stamps may be out of order
    is_of_arrival = np.median(by_number**2) < 0.25 * np.median(by_stamp**2)
    if not is_of_arrival or scatter_s < max(_SCATTERED * one.period_s, _SCATTERED_RAD / one.commanded):
        return None
    return {"size": amount(scatter_s, "s"), "percent": f"{100.0 * scatter_s / one.period_s:.0f}"}


def _held(values: Floats, stamp_ns: Ints, speed: float) -> Words | None:
    """Values that repeat, each for the same number of samples."""
    runs = 1 + int(np.count_nonzero(np.diff(values)))
    held_s = 1.0e-9 * float(stamp_ns[-1] - stamp_ns[0]) / runs
    if runs < 2 or len(values) < _HELD * runs or len(np.unique(values)) < 0.6 * runs:
        return None
    if held_s * speed < _HELD_RAD:
        return None
    return {"size": f"{len(values) / runs:.2g}", "rate": f"{1.0 / held_s:.3g}"}


def _frozen(one: Stretch) -> Words | None:
    enough = len(one.torque) >= _LEAST and np.std(one.torque) > _SWINGS * one.size_nm
    return {} if enough and np.ptp(one.angle) < _STILL_RAD else None


def _frozen_runs(torque: Floats) -> tuple[Ints, NDArray[np.bool_]]:
    """Ends of the runs of equal torques, and which of them last as long as those of a frozen sensor."""
    ends = np.flatnonzero(np.append(np.diff(torque), 1.0)) + 1
    return ends, np.diff(ends, prepend=0) >= max(_LEAST, _FROZEN * len(torque))


def _constant(one: Stretch) -> Words | None:
    """All torques, or a contiguous part of them."""
    ends, is_frozen = _frozen_runs(one.torque)
    if is_frozen.any():
        return {"size": amount(float(one.torque[ends[is_frozen.argmax()] - 1]), "N m")}
    is_still = np.std(one.torque) <= _NO_VARIATION * one.size_nm
    return {"size": amount(float(np.mean(one.torque)), "N m")} if is_still else None


def _saturated(one: Stretch) -> Words | None:
    # a long run at the start or the end means that the sensor was frozen before, or freezes
    ends, is_frozen = _frozen_runs(one.torque)
    first, last = is_frozen[0] * ends[0], ends[-2] if is_frozen[-1] and len(ends) > 1 else ends[-1]
    torque = one.torque[first:last]
    if len(torque) < _LEAST or np.std(torque) <= _NO_VARIATION * one.size_nm:
        return None
    most = float(np.max(np.abs(torque)))
    number = np.unique(torque, return_counts=True)[1]
    # a torque of few digits repeats its extremes as well, but not so much more often than the next values
    at_ends = [
        int(end)
        for end, beside in ((number[0], number[1]), (number[-1], number[-2]))
        if end >= _BESIDE * beside
    ]
    part = sum(at_ends) / len(one.torque)
    if part < _AT_END:
        return None
    return {"size": amount(most, "N m"), "percent": f"{100.0 * part:.0f}"}


def _spikes(one: Stretch) -> Words | None:
    return {"percent": f"{100.0 * one.spikes:.1f}"} if one.spikes else None


@attrs.frozen(kw_only=True)
class InputRule:
    """A fault of a stream.

    Attributes
    ----------
    code : str
    kind : int
        `CRANK` or `TORQUE`, the stream.
    words : callable or None
        Words of the sentence if a stretch has this fault; None if a different part of `InputJudge` finds it.
    why, do : str
        Sentence and remedy, with words in braces.
    needs_motion : bool
        True if it can only be seen while the crank turns.
    """

    code: str
    kind: int
    words: Callable[[Stretch], Words | None] | None
    why: str
    do: str
    needs_motion: bool = True


UNIT, HELD, JUMP = "CRANK_UNIT", "CRANK_HELD", "CRANK_JUMP"
SPIKES, NOT_OF_GAIT = "TORQUE_SPIKES", "TORQUE_NOT_OF_GAIT"
_NO_JOINT = "; no joint is observed"
INPUT_RULES = (
    InputRule(
        code="CRANK_FROZEN",
        kind=CRANK,
        words=_frozen,
        needs_motion=False,
        why="the crank has not moved since {since}, but the drive torque changes",
        do="check the crank's encoder and its driver; if the leg stands under a changing load, let it walk",
    ),
    InputRule(
        code=UNIT,
        kind=CRANK,
        words=_unit,
        needs_motion=False,
        why="the crank angle advances at {size} of the commanded cadence: its unit seems to be turns",
        do="publish radians, or set table.units.crank_angle of a table; for a continuous position in turns, "
        "set crank.gear_ratio to {ratio}",
    ),
    InputRule(
        code="CRANK_STAMPS",
        kind=CRANK,
        words=_stamps,
        why="the stamps of the crank scatter by {size} ({percent} % of the sampling period), and its angle "
        "does not: the samples are stamped on arrival",
        do="let the driver stamp each sample when it is measured (header.stamp)",
    ),
    InputRule(
        code=HELD,
        kind=CRANK,
        words=lambda one: _held(one.angle, one.crank_ns, one.speed),
        why=(
            "the crank angle changes only with every {size}th sample, at {rate} Hz: it is repeated in between"
        ),
        do="publish each angle once, with the stamp of its measurement; in a table, delete the repeated rows",
    ),
    InputRule(
        code=JUMP,
        kind=CRANK,
        words=None,
        why="the crank angle jumped by {size} at {since} and did not return: its zero is no longer known",
        do="check the encoder for an overflow or lost counts, set crank.offset_rad again, and restart the "
        "monitor",
    ),
    InputRule(
        code=SPIKES,
        kind=TORQUE,
        words=_spikes,
        why="{percent} % of the drive torques are spikes or NaN since {since}" + _NO_JOINT,
        do="check the cable of the torque sensor and its supply; publish a torque with each measurement only",
    ),
    InputRule(
        code="TORQUE_SATURATED",
        kind=TORQUE,
        words=_saturated,
        why="{percent} % of the drive torques are at the end of the sensor's range since {since} ({size})"
        + _NO_JOINT,
        do="use a torque sensor with a wider range, or raise the limit of the driver",
    ),
    InputRule(
        code="TORQUE_CONSTANT",
        kind=TORQUE,
        words=_constant,
        why="the drive torque has not changed since {since}: it stays at {size}" + _NO_JOINT,
        do="check drive_torque.source, its topic or axis, and the sensor; until then, rock the joints by "
        "hand regularly",
    ),
    InputRule(
        code="TORQUE_HELD",
        kind=TORQUE,
        words=lambda one: (
            _held(one.torque, one.torque_ns, one.speed) if one.turned_rad > _MOVING_RAD else None
        ),
        why="the drive torque changes only with every {size}th sample, at {rate} Hz: samples are repeated"
        + _NO_JOINT,
        do="publish each torque once, with the stamp of its measurement; in a table, delete repeated values",
    ),
    InputRule(
        code=NOT_OF_GAIT,
        kind=TORQUE,
        words=None,
        why="the drive torque has not followed the gait since {since}: it resembles neither the "
        "prediction nor the previous step" + _NO_JOINT,
        do="check topic, unit and source of the drive torque; until then, rock the joints by hand regularly",
    ),
)
"""In the order of precedence: faults of the crank come first, because torques are compared at its angles."""


@attrs.frozen
class InputFault:
    """A fault that is present.

    Attributes
    ----------
    code : str
    since_ns, last_ns : int
        Stamps of its begin, and of the last sample that showed it.
    words : mapping of str to str
        For the sentence and the remedy of its rule.
    shown : int
        In how many judgements in a row it was found.
    """

    code: str
    since_ns: int
    last_ns: int
    words: Words
    shown: int = 1

    @property
    def rule(self) -> InputRule:
        """Its rule."""
        return next(rule for rule in INPUT_RULES if rule.code == self.code)

    @property
    def texts(self) -> dict[str, str]:
        """Words for sentence and remedy, with its begin."""
        return {**self.words, "since": time_words(self.since_ns)}

    @property
    def sentence(self) -> str:
        """The fault, and the remedy."""
        return f"{self.rule.why}. {self.rule.do[0].upper()}{self.rule.do[1:]}".format(**self.texts)


def judged(one: Stretch) -> dict[str, Words]:
    """Faults of a stretch by their codes: the first one of each stream."""
    found: dict[str, Words] = {}
    is_moving = one.turned_rad > _MOVING_RAD
    for kind, number in ((CRANK, len(one.angle)), (TORQUE, min(len(one.angle), len(one.torque)))):
        for rule in INPUT_RULES:
            if rule.kind != kind or rule.words is None or number < _LEAST:
                continue
            words = rule.words(one) if is_moving or not rule.needs_motion else None
            if words is not None:
                found[rule.code] = words
                break
    return found


def _phase_means(profile: TorqueProfile) -> tuple[Floats, Floats] | None:
    """Measured and predicted torque of a gait cycle in equal phases, less their means; None if too few."""
    phases = next((n for n in _PHASES if profile.number.sum() >= _LEAST_A_PHASE * n), 0)
    if not phases:
        return None
    number, measured, predicted = (
        part.reshape(phases, -1).sum(axis=1)
        for part in (profile.number, profile.measured_nm, profile.predicted_nm)
    )
    if not (number > 0.0).all():
        return None
    means = np.stack([measured, predicted]) / number
    means -= means.mean(axis=1, keepdims=True)
    return means[0], means[1]


def _correlation(one: Floats, other: Floats) -> float:
    """Correlation of two torques (n,) without their means; 0 if one of them is constant."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0


def _likeness(one: Floats, other: Floats) -> float:
    """Largest size of the correlation, with the other moved by up to a twelfth of a turn, or reversed."""
    most = len(one) // 12
    return max(abs(_correlation(one, np.roll(other, k))) for k in range(-most, most + 1))


_JUMP_RAD = 0.3  # deviation of an angle from a steady motion
_JUMP_STEP_RAD = 0.2  # largest step of a crank between two samples over which a jump is known
_AMONG = 5  # samples; two of them may be outliers
_PERIODS = 4  # evaluation periods per stretch
# number of periods whose samples are kept, because a gait cycle may be slower than commanded
_KEPT_PERIODS = 12
_AFTER = 3  # commanded gait cycles without a fault, after which it is over
# Judgements before the fault has a name: outliers may come back, and an angle that is held or in a wrong unit
# looks like a jump for a gait cycle; one strange step is no fault.
_NOT_YET = {JUMP: 5, NOT_OF_GAIT: 1}


@attrs.define
class JudgeState:
    """State of an `InputJudge`; every value is immutable.

    Attributes
    ----------
    pieces : tuple of Samples
        Samples of the last evaluation periods.
    spikes : tuple of int
        Torque outliers up to the end of each.
    now : tuple of Samples
        Samples of the present one.
    faults : mapping of str to InputFault
        By their codes.
    last : Samples
        Last crank samples.
    jumped_rad : float
        Sum of the jumps of the crank's angle, less whole turns.
    before : (n,) array or None
        Torque of the gait cycle before, in equal phases.
    has_refused : bool
        True if a gait cycle of this evaluation period was refused.
    was_refused : bool
        True if the last gait cycle was refused.
    """

    pieces: tuple[Samples, ...] = ()
    spikes: tuple[int, ...] = ()
    now: tuple[Samples, ...] = ()
    faults: Mapping[str, InputFault] = attrs.field(factory=dict)
    last: Samples = attrs.field(factory=lambda: np.zeros(0, GAIT_SAMPLE))
    jumped_rad: float = 0.0
    before: Floats | None = None
    has_refused: bool = False
    was_refused: bool = False


class InputJudge:
    """Judges the samples of crank and drive torque before anything else looks at them.

    Parameters
    ----------
    config : MonitorConfig
    size_nm : float
        RMS of the predicted drive torque.
    """

    def __init__(self, config: MonitorConfig, size_nm: float) -> None:
        self.config, self._size_nm = config, size_nm
        self._commanded = abs(config.cadence.commanded_rpm) * TURN / 60.0
        self._after_ns = round(_AFTER * 1.0e9 * TURN / self._commanded)
        self.state = JudgeState()

    @property
    def faults(self) -> tuple[InputFault, ...]:
        """Faults that are present, in the order of their rules."""
        found = self.state.faults
        shown = (found[rule.code] for rule in INPUT_RULES if rule.code in found)
        return tuple(one for one in shown if one.shown > _NOT_YET.get(one.code, 0))

    @property
    def trusted_before_ns(self) -> Mapping[int, int]:
        """Stamp until which a stream with a fault was in order, by its kind: some gait cycles before it."""
        begun: dict[int, int] = {}
        for one in self.faults:
            kinds = (CRANK, TORQUE) if one.rule.kind == CRANK else (TORQUE,)
            for kind in kinds:
                begun[kind] = min(one.since_ns - self._after_ns, begun.get(kind, one.since_ns))
        return begun

    def add_samples(self, piece: Samples) -> None:
        """Add samples in the order of arrival."""
        self.state.now = (*self.state.now, piece)

    def end_period(self, spikes: int, is_withheld: bool) -> bool:
        """Judge the last samples at the end of an evaluation period.

        Parameters
        ----------
        spikes : int
            Outliers of the torque so far.
        is_withheld : bool
            True if the guard withholds samples of the crank: then it names their fault.

        Returns
        -------
        bool
            True if a gait cycle was refused in this period.
        """
        state = self.state
        has_refused, state.has_refused = state.has_refused, False
        joined = np.concatenate(state.now) if state.now else np.zeros(0, GAIT_SAMPLE)
        state.pieces = (*state.pieces, joined)[-_KEPT_PERIODS:]
        state.spikes = (*state.spikes, spikes)[-_KEPT_PERIODS - 1 :]
        state.now = ()
        cranks = of_crank(joined)
        self._look_for_jumps(cranks)
        if {UNIT, HELD} & state.faults.keys():  # the steps of such angles look like jumps, at the end as well
            state.jumped_rad = 0.0
            state.faults = {code: one for code, one in state.faults.items() if code != JUMP}
        if state.jumped_rad and len(cranks):
            words, stamps = {"size": amount(state.jumped_rad, "rad")}, cranks["stamp_ns"]
            self._note(JUMP, words, int(stamps[0]), int(stamps[-1]))
        last = np.concatenate(state.pieces[-_PERIODS:])
        kept = np.concatenate(state.pieces)
        found = spikes - state.spikes[0] + _without_number(kept)
        part = found / max(1, found + len(of_torque(kept)))
        most = _FEWER_SPIKES if SPIKES in state.faults else _SPIKES
        if found <= _LEAST_SPIKES or part <= most:
            part = 0.0
        self._take(Stretch.of(last, part, self._size_nm, self.config))
        if is_withheld:
            state.jumped_rad = 0.0
            state.faults = {code: one for code, one in state.faults.items() if one.rule.kind != CRANK}
        return has_refused

    def end_cycle(self, statistics: CycleStatistics) -> frozenset[int]:
        """Judge a gait cycle; returns the streams that contain no information about the leg in it."""
        state = self.state
        samples = np.concatenate([*state.pieces, *state.now])
        end_ns = statistics.stamp_ns
        own = samples[(samples["stamp_ns"] >= statistics.begin_ns) & (samples["stamp_ns"] < end_ns)]
        self._take(Stretch.of(own, 0.0, self._size_nm, self.config))
        is_strange = self._is_strange(statistics.torque_profile)
        if is_strange:
            self._note(NOT_OF_GAIT, {}, statistics.begin_ns, end_ns)
        kinds = {one.rule.kind for one in state.faults.values()}
        state.was_refused = bool(kinds)
        state.has_refused |= state.was_refused
        return frozenset(kinds | ({TORQUE} if CRANK in kinds else set()))

    def _is_strange(self, profile: TorqueProfile) -> bool:
        """True if a torque resembles neither the prediction nor the previous gait cycle."""
        means, before = _phase_means(profile), self.state.before
        self.state.before = None if means is None else means[0]
        if means is None:
            return False
        if _likeness(*means) >= _ALIKE:
            return False
        is_repeated = before is not None and len(before) == len(means[0])
        return not (is_repeated and before is not None and _correlation(means[0], before) >= _ALIKE)

    def _take(self, one: Stretch) -> None:
        """Note the faults in a stretch, and forget faults that have not occurred for some gait cycles."""
        newest_ns = int(one.crank_ns[-1]) if len(one.crank_ns) else 0
        newest_ns = max(newest_ns, int(one.torque_ns[-1]) if len(one.torque_ns) else 0)
        first_ns = int(one.crank_ns[0]) if len(one.crank_ns) else newest_ns
        for code, words in judged(one).items():
            self._note(code, words, first_ns, newest_ns)
        kept = self.state.faults.values()
        self.state.faults = {
            one.code: one for one in kept if abs(newest_ns - one.last_ns) <= self._after_ns or not newest_ns
        }

    def _note(self, code: str, words: Words, since_ns: int, last_ns: int) -> None:
        known = self.state.faults.get(code)
        now = InputFault(code, since_ns, last_ns, words)
        if known is not None:
            now = attrs.evolve(now, since_ns=known.since_ns, shown=known.shown + 1)
        self.state.faults = {**self.state.faults, code: now}

    def _look_for_jumps(self, cranks: Samples) -> None:
        """Add up the steps of the crank's angle that no motion makes: outliers come back, a jump stays."""
        last = np.append(self.state.last, cranks)
        self.state.last = last[-_AMONG - 1 :]
        step = (np.diff(last["crank_angle_rad"]) + math.pi) % TURN - math.pi
        passed_s = 1.0e-9 * np.diff(last["stamp_ns"])
        known = (passed_s > 0.0) & (passed_s * self._commanded <= _JUMP_STEP_RAD)
        if len(step) <= _AMONG or not known.any():
            return
        # a median of neighbours leaves outliers out; next to a gap, only one of their two steps is known
        off = np.cumsum(np.where(known, step - np.median(step[known]), 0.0))
        change = np.diff(np.median(sliding_window_view(off, _AMONG), axis=1))
        change = (change + math.pi) % TURN - math.pi
        is_known = sliding_window_view(known, _AMONG + 1).all(axis=1)
        jumps = float(change[is_known & (np.abs(change) > _JUMP_RAD)].sum())
        jumped_rad = (self.state.jumped_rad + jumps + math.pi) % TURN - math.pi
        self.state.jumped_rad = jumped_rad if abs(jumped_rad) > _JUMP_RAD else 0.0
