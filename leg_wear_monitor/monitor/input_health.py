"""The input, judged before any mechanical cause: rates, unused samples, and faults that no leg can have."""

import math
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


def stuck_fraction(samples: Samples) -> float:
    """Fraction of the torques that repeat the largest or the smallest one; NaN while there are few.

    Efforts in crank samples are torques as well.
    """
    torques = samples["torque_nm"][samples["fault"] == NO_FAULT]
    torques = torques[np.isfinite(torques)]
    if len(torques) < _LEAST_TORQUES:
        return math.nan
    repeated = max(np.count_nonzero(torques == end) for end in (torques.min(), torques.max()))
    return repeated / len(torques) if repeated > 1 else 0.0


def input_health(before: Intake, after: Intake, samples: Samples, is_whole: bool) -> dict[str, float]:
    """Health of the input between two counts; an unknown value is NaN.

    Parameters
    ----------
    before, after : Intake
    samples : (n,) array
        Samples between the two counts.
    is_whole : bool
        True if all received samples were counted; otherwise the values over time are unknown.

    Returns
    -------
    duration_s : float
        Length of this time; unknown if stamps did not advance.
    crank_rate_hz, drive_torque_rate_hz and so on : float
        Used samples per second, by the names of `KINDS`.
    bad_fraction : float
        Fraction of the samples that were not used: faulty, repeated, late, with a stray stamp, or outliers.
        Messages of other joints do not count while the crank's come.
    lost_fraction : float
        Fraction of the time in which the leg was not tracked.
    stuck_torque_fraction : float
        Of `stuck_fraction`. Unknown where the leg stood in this time: a torque at rest does not change.
    """
    span_s = (after.newest_stamp_ns - before.newest_stamp_ns) * 1.0e-9
    is_known = is_whole and span_s > 0.0 and before.newest_stamp_ns > 0
    duration_s = span_s if is_known else math.nan
    monitored_s = after.moving_s - before.moving_s + after.standing_s - before.standing_s
    others = of_other_joints(before, after)
    received = after.received - before.received - others
    stood = after.standing_s > before.standing_s
    return {
        "duration_s": duration_s,
        **{f"{name}_rate_hz": (used - before.used[name]) / duration_s for name, used in after.used.items()},
        "bad_fraction": sum(_unused(after, before, 0, others).values()) / received if received else math.nan,
        "lost_fraction": min(1.0, max(0.0, 1.0 - monitored_s / duration_s)) if is_known else math.nan,
        "stuck_torque_fraction": math.nan if stood else stuck_fraction(samples),
    }


def of_other_joints(before: Intake, after: Intake) -> int:
    """Number of messages without the crank between two counts, if the crank came from a different publisher.

    Several drivers may publish joints of one robot on one topic.
    """
    crank, name = KINDS[CRANK].name, FAULTS[MISSING_JOINT]
    has_crank = after.used[crank] > before.used[crank]
    return after.faulty[name] - before.faulty[name] if has_crank else 0


# Sentences on unused samples: how many of how many, the fault, and the remedy.


_WORTH_TELLING = 0.01  # fraction of the samples; smaller ones are visible in the counters only

_DROPPED = ("duplicates", "late", "stray_stamps", "outliers", "load_outliers")

_STREAMS = {CRANK: "the crank", TORQUE: "drive_torque", LOAD: "foot_load"}


def _not_finite(samples: Samples) -> str:
    """Streams of samples with a value that is NaN or infinite, and their numbers."""
    counts = []
    for kind, name in _STREAMS.items():
        own = samples[samples["kind"] == kind]
        finite = np.isfinite(own[KINDS[kind].value])
        is_odd = ~finite.all(axis=tuple(range(1, finite.ndim)))  # a force has two components
        is_odd &= (own["fault"] == NO_FAULT) & (own["stamp_ns"] > 0)
        number = np.count_nonzero(is_odd | (own["fault"] == NOT_FINITE))
        counts += [f"{number} of {name}"] if number else []
    return ", ".join(counts)


def causes(
    before: Intake, after: Intake, withheld: int, samples: Samples, crank: str, texts: Mapping[str, str]
) -> list[str]:
    """Sentences on the unused samples between two counts, the most frequent cause first.

    Parameters
    ----------
    before, after : Intake
    withheld : int
        Number of out-of-range samples that a different sentence reports.
    samples : (n,) array
        Samples between the two counts.
    crank : str
        Name of the crank.
    texts : mapping of str to str
        Sentences by cause.
    """
    others = of_other_joints(before, after)
    received = after.received - before.received - others
    lost = _unused(after, before, withheld, others)
    frequent = [name for name, count in lost.items() if count > _WORTH_TELLING * received]
    words = {"crank": crank, "where": _not_finite(samples)}
    sentences = [
        f"{lost[name]} of {received} samples {texts[name].format(**words)}"
        for name in sorted(frequent, key=lambda name: -lost[name])
    ]
    unused = sum(lost.values())
    # one cause of several; without the total, its number would be taken for the total
    if sentences and unused > max(lost.values()):
        sentences[0] = f"{unused} of {received} samples are not used; most frequent fault: {sentences[0]}"
    return sentences


def _unused(after: Intake, before: Intake, withheld: int, others: int) -> Mapping[str, int]:
    """Numbers of unused samples between two counts, by cause."""
    lost = {name: count - before.faulty[name] for name, count in after.faulty.items()}
    lost["out_of_range"] -= withheld
    lost[FAULTS[MISSING_JOINT]] -= others
    return lost | {name: getattr(after, name) - getattr(before, name) for name in _DROPPED}


# Faults of a stream that no leg can have, judged on about a gait cycle of samples.
#
# Each fault has a code, a predicate that gives the words of its sentence, and a rule of the verdict with the
# sentence and the remedy. The first predicate of a stream that holds is the fault. While it is present, the
# gait cycles of this stream say nothing of the leg: they raise no mechanical alarm, and no estimator uses
# them.


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


UNIT, HELD, JUMP = "CRANK_UNIT", "CRANK_HELD", "CRANK_JUMP"
SPIKES, NOT_OF_GAIT = "TORQUE_SPIKES", "TORQUE_NOT_OF_GAIT"
INPUT_FAULTS: Mapping[str, Callable[[Stretch], Words | None]] = {
    "CRANK_FROZEN": _frozen,
    UNIT: _unit,
    "CRANK_STAMPS": _stamps,
    HELD: lambda one: _held(one.angle, one.crank_ns, one.speed),
    JUMP: lambda _: None,
    SPIKES: _spikes,
    "TORQUE_SATURATED": _saturated,
    "TORQUE_CONSTANT": _constant,
    "TORQUE_HELD": lambda one: _held(one.torque, one.torque_ns, one.speed),
    NOT_OF_GAIT: lambda _: None,
}
"""Words of the sentence if a stretch has the fault, by its code, which begins with its stream.

They are in the order of precedence: faults of the crank come first, because torques are compared at its
angles. `InputJudge` finds jumps of the angle and torques that are not of the gait in a different way.
"""
_ALSO_AT_REST = ("CRANK_FROZEN", UNIT)


def kind_of(code: str) -> int:
    """Stream of a fault."""
    return CRANK if code.startswith("CRANK") else TORQUE


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
    def texts(self) -> dict[str, str]:
        """Words for sentence and remedy, with its begin."""
        return {**self.words, "since": time_words(self.since_ns)}


def judged(one: Stretch) -> dict[str, Words]:
    """Faults of a stretch by their codes: the first one of each stream."""
    found: dict[int, tuple[str, Words]] = {}
    is_moving = one.turned_rad > _MOVING_RAD
    numbers = {CRANK: len(one.angle), TORQUE: min(len(one.angle), len(one.torque))}
    for code, words_of in INPUT_FAULTS.items():
        kind = kind_of(code)
        if kind in found or numbers[kind] < _LEAST or not (is_moving or code in _ALSO_AT_REST):
            continue
        words = words_of(one)
        if words is not None:
            found[kind] = code, words
    return dict(found.values())


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


def correlation(one: Floats, other: Floats) -> float:
    """Correlation of two values (n,) without their means; 0 if one of them is constant."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0


def _likeness(one: Floats, other: Floats) -> float:
    """Largest size of the correlation, with the other moved by up to a twelfth of a turn, or reversed."""
    most = len(one) // 12
    return max(abs(correlation(one, np.roll(other, k))) for k in range(-most, most + 1))


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


class InputJudge:
    """Judges the samples of crank and drive torque before anything else looks at them.

    Parameters
    ----------
    config : MonitorConfig
    size_nm : float
        RMS of the predicted drive torque.

    Attributes
    ----------
    was_refused : bool
        True if the last gait cycle was refused.
    """

    def __init__(self, config: MonitorConfig, size_nm: float) -> None:
        self.config, self._size_nm = config, size_nm
        self._commanded = abs(config.cadence.commanded_rpm) * TURN / 60.0
        self._after_ns = round(_AFTER * 1.0e9 * TURN / self._commanded)
        self._pieces: tuple[Samples, ...] = ()  # samples of the last evaluation periods
        self._spikes: tuple[int, ...] = ()  # torque outliers up to the end of each
        self._now: tuple[Samples, ...] = ()  # samples of the present one
        self._faults: dict[str, InputFault] = {}  # by their codes
        self._last = np.zeros(0, GAIT_SAMPLE)  # last crank samples
        self._jumped_rad = 0.0  # sum of the jumps of the crank's angle, less whole turns
        self._before: Floats | None = None  # torque of the gait cycle before, in equal phases
        self._has_refused = False  # whether a gait cycle of this evaluation period was refused
        self.was_refused = False

    @property
    def faults(self) -> tuple[InputFault, ...]:
        """Faults that are present, in the order of their rules."""
        shown = (self._faults[code] for code in INPUT_FAULTS if code in self._faults)
        return tuple(one for one in shown if one.shown > _NOT_YET.get(one.code, 0))

    @property
    def trusted_before_ns(self) -> Mapping[int, int]:
        """Stamp until which a stream with a fault was in order, by its kind: some gait cycles before it."""
        begun: dict[int, int] = {}
        for one in self.faults:
            kinds = (CRANK, TORQUE) if kind_of(one.code) == CRANK else (TORQUE,)
            for kind in kinds:
                begun[kind] = min(one.since_ns - self._after_ns, begun.get(kind, one.since_ns))
        return begun

    def add_samples(self, piece: Samples) -> None:
        """Add samples in the order of arrival."""
        self._now = (*self._now, piece)

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
        has_refused, self._has_refused = self._has_refused, False
        joined = np.concatenate(self._now) if self._now else np.zeros(0, GAIT_SAMPLE)
        self._pieces = (*self._pieces, joined)[-_KEPT_PERIODS:]
        self._spikes = (*self._spikes, spikes)[-_KEPT_PERIODS - 1 :]
        self._now = ()
        cranks = of_crank(joined)
        self._look_for_jumps(cranks)
        if {UNIT, HELD} & self._faults.keys():  # the steps of such angles look like jumps, at the end as well
            self._jumped_rad = 0.0
            self._faults = {code: one for code, one in self._faults.items() if code != JUMP}
        if self._jumped_rad and len(cranks):
            words, stamps = {"size": amount(self._jumped_rad, "rad")}, cranks["stamp_ns"]
            self._note(JUMP, words, int(stamps[0]), int(stamps[-1]))
        last = np.concatenate(self._pieces[-_PERIODS:])
        kept = np.concatenate(self._pieces)
        found = spikes - self._spikes[0] + _without_number(kept)
        part = found / max(1, found + len(of_torque(kept)))
        most = _FEWER_SPIKES if SPIKES in self._faults else _SPIKES
        if found <= _LEAST_SPIKES or part <= most:
            part = 0.0
        self._take(Stretch.of(last, part, self._size_nm, self.config))
        if is_withheld:
            self._jumped_rad = 0.0
            self._faults = {code: one for code, one in self._faults.items() if kind_of(code) != CRANK}
        return has_refused

    def end_cycle(self, statistics: CycleStatistics) -> frozenset[int]:
        """Judge a gait cycle; returns the streams that contain no information about the leg in it."""
        samples = np.concatenate([*self._pieces, *self._now])
        end_ns = statistics.stamp_ns
        own = samples[(samples["stamp_ns"] >= statistics.begin_ns) & (samples["stamp_ns"] < end_ns)]
        self._take(Stretch.of(own, 0.0, self._size_nm, self.config))
        is_strange = self._is_strange(statistics.torque_profile)
        if is_strange:
            self._note(NOT_OF_GAIT, {}, statistics.begin_ns, end_ns)
        kinds = set(map(kind_of, self._faults))
        self.was_refused = bool(kinds)
        self._has_refused |= self.was_refused
        return frozenset(kinds | ({TORQUE} if CRANK in kinds else set()))

    def _is_strange(self, profile: TorqueProfile) -> bool:
        """True if a torque resembles neither the prediction nor the previous gait cycle."""
        means, before = _phase_means(profile), self._before
        self._before = None if means is None else means[0]
        if means is None:
            return False
        if _likeness(*means) >= _ALIKE:
            return False
        is_repeated = before is not None and len(before) == len(means[0])
        return not (is_repeated and before is not None and correlation(means[0], before) >= _ALIKE)

    def _take(self, one: Stretch) -> None:
        """Note the faults in a stretch, and forget faults that have not occurred for some gait cycles."""
        newest_ns = int(one.crank_ns[-1]) if len(one.crank_ns) else 0
        newest_ns = max(newest_ns, int(one.torque_ns[-1]) if len(one.torque_ns) else 0)
        first_ns = int(one.crank_ns[0]) if len(one.crank_ns) else newest_ns
        for code, words in judged(one).items():
            self._note(code, words, first_ns, newest_ns)
        kept = self._faults.values()
        self._faults = {
            one.code: one for one in kept if abs(newest_ns - one.last_ns) <= self._after_ns or not newest_ns
        }

    def _note(self, code: str, words: Words, since_ns: int, last_ns: int) -> None:
        known = self._faults.get(code)
        now = InputFault(code, since_ns, last_ns, words)
        if known is not None:
            now = attrs.evolve(now, since_ns=known.since_ns, shown=known.shown + 1)
        self._faults = {**self._faults, code: now}

    def _look_for_jumps(self, cranks: Samples) -> None:
        """Add up the steps of the crank's angle that no motion makes: outliers come back, a jump stays."""
        last = np.append(self._last, cranks)
        self._last = last[-_AMONG - 1 :]
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
        jumped_rad = (self._jumped_rad + jumps + math.pi) % TURN - math.pi
        self._jumped_rad = jumped_rad if abs(jumped_rad) > _JUMP_RAD else 0.0
