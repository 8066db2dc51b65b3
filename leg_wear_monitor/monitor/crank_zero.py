"""The zero of the crank's encoder, from the phase of the drive torque; samples wait until it is found.

An encoder on the motor's shaft starts at zero at each boot. Samples wait while the zero is looked for, and
follow it: no gait cycle is lost, as long as it is found among the samples that may wait. It is looked for at
the ends of evaluation periods, which do not depend on how samples are cut into blocks.
"""

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate import torque_fit
from leg_wear_monitor.estimate.joint_motion import Pair, Series, motion_of, paired, series
from leg_wear_monitor.estimate.torque_fit import Start
from leg_wear_monitor.estimate.torque_model import PHASE_ERROR_RAD, TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.alarms import CRANK_ZERO
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK, KINDS, TORQUE
from leg_wear_monitor.twin.sample import (
    AVERAGE,
    BRIDGE_LIMIT_S,
    GAIT_SAMPLE,
    GATE_RAD,
    Samples,
    TrackerSettings,
    is_valid,
    of_crank,
)

_A_CYCLE = 4  # evaluation periods of a gait cycle: the least between two attempts, which take 0.1 s each
_MOST_PERIODS = 80  # samples wait so long; enough for a slower cadence
_MOST_SAMPLES = 400_000  # 30 MB
_LONGEST_DOUBT = 2  # periods in which an angle that left its course may come back
_BACK_RAD = 0.25  # an angle that left its course is back if it is that near

_NONE: Samples = np.zeros(0, GAIT_SAMPLE)


@attrs.define
class CrankZeroState:
    """State of the search.

    Attributes
    ----------
    zero : Zero or None
        The present one.
    former : Zero or None
        The one before the angle left its course; None once it is sure that the encoder has restarted.
    doubts : int
        Evaluation periods since then.
    off_rad : float
        By how much the angle is off its former course.
    times_found : int
    turns : int
        Turns of the present walk.
    why : str
        Why no zero was found; empty while there was no attempt.
    rest : int
        Periods until the next attempt.
    waiting : tuple of Samples
        Samples that wait for the zero, by evaluation periods; the last one is not over.
    last_ns, last_rad : int, float
        Stamp and angle of the last crank sample; stamp 0 before the first.
    since_ns : int
        Stamp of the first crank sample of this search.
    has_passed : bool
        True if samples were passed on; the twin counts the time from then on.
    before_s : float
        Time before, of earlier searches and of samples that waited too long.
    """

    zero: "Zero | None" = None
    former: "Zero | None" = None
    doubts: int = 0
    off_rad: float = 0.0
    times_found: int = 0
    turns: int = 0
    why: str = ""
    rest: int = 0
    waiting: tuple[Samples, ...] = (_NONE,)
    last_ns: int = 0
    last_rad: float = 0.0
    since_ns: int = 0
    has_passed: bool = False
    before_s: float = 0.0


class CrankZero(Observer):
    """Finds the zero of the crank's encoder.

    Parameters
    ----------
    model : TorqueModel
    config : MonitorConfig
    tracker : TrackerSettings
    """

    def __init__(self, model: TorqueModel, config: MonitorConfig, tracker: TrackerSettings) -> None:
        self._model, self._config, self._tracker = model, config, tracker
        self.state = CrankZeroState()

    def passed(self, samples: Samples, ends_period: bool) -> Samples:
        """Samples to track now, with the zero: these samples, earlier ones that waited, or none.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
        ends_period : bool
            True if an evaluation period ends with them.
        """
        state, out, begin = self.state, [_NONE], 0
        for at, off_rad in self._breaks(samples):
            out.append(self._taken(samples[begin:at]))
            begin = at
            if state.former is None:
                self._begin(int(samples["stamp_ns"][at]))
            state.off_rad += off_rad
        out.append(self._taken(samples[begin:]))
        if ends_period and state.zero is None:
            out.append(self._end_period())
        return np.concatenate(out)

    def _breaks(self, samples: Samples) -> list[tuple[int, float]]:
        """Index of each crank sample that does not continue the one before, and its jump; NaN after a gap.

        The encoder may have restarted in a gap, unless the angle continues after it.
        """
        state, tracker = self.state, self._tracker
        is_possible = np.abs(samples["crank_angle_rad"]) <= KINDS[CRANK].largest
        at = np.flatnonzero((samples["kind"] == CRANK) & is_valid(samples) & is_possible)
        if not len(at):
            return []
        stamp_ns, angle = samples["stamp_ns"][at], samples["crank_angle_rad"][at]
        state.since_ns = state.since_ns or int(stamp_ns[0])
        before = (state.last_ns, state.last_rad) if state.last_ns else (stamp_ns[0], angle[0])
        state.last_ns, state.last_rad = int(stamp_ns[-1]), float(angle[-1])
        time_s = np.abs(1.0e-9 * np.diff(stamp_ns, prepend=before[0]))
        moved = (np.diff(angle, prepend=before[1]) + math.pi) % TURN - math.pi
        reach = tracker.largest_speed * time_s
        is_gap = time_s > BRIDGE_LIMIT_S
        is_break = np.where(is_gap, np.abs(angle) <= reach + TURN, np.abs(moved) > GATE_RAD + reach)
        jump = np.where(is_gap, math.nan, moved)
        return [(int(at[k]), float(jump[k])) for k in np.flatnonzero(is_break)]

    def _begin(self, stamp_ns: int) -> None:
        """Begin to look for the zero; samples that wait belong to a different one."""
        state = self.state
        if state.zero is None and not state.has_passed:
            state.before_s += max(0.0, 1.0e-9 * (stamp_ns - state.since_ns))
        state.former, state.zero, state.off_rad, state.doubts = state.zero, None, 0.0, 0
        state.waiting, state.since_ns = (_NONE,), stamp_ns
        state.turns, state.why, state.rest = 0, "", 0

    def _taken(self, samples: Samples) -> Samples:
        """Samples without a break: with the zero; none if they have to wait."""
        state = self.state
        if state.zero is None:
            *before, last = state.waiting
            state.waiting = (*before, np.concatenate([last, samples]))
            return _NONE
        state.has_passed |= len(samples) > 0
        samples = samples.copy()
        samples["crank_angle_rad"] += state.zero.offset_rad
        return samples

    def _end_period(self) -> Samples:
        """Look for the zero; returns the samples that need not wait any longer."""
        state = self.state
        if state.former and abs((state.off_rad + math.pi) % TURN - math.pi) < _BACK_RAD:
            return self._released(state.former)  # it was a glitch
        state.doubts += 1
        if state.doubts >= _LONGEST_DOUBT:
            state.former = None
        waiting = np.concatenate(state.waiting)
        walk = last_walk(waiting, self._config.cadence, BRIDGE_LIMIT_S)
        state.turns, state.rest = walk.turns, max(0, state.rest - 1)
        if walk.turns < LEAST_TURNS:
            state.why = walk.why
        elif not state.rest:
            found = self._found(walk)
            if isinstance(found, Zero):
                state.times_found += 1
                return self._released(found)
            state.why, state.rest = found, _A_CYCLE
        lengths = np.cumsum([len(part) for part in reversed(state.waiting)])
        kept = min(_MOST_PERIODS, int(np.count_nonzero(lengths <= _MOST_SAMPLES)))
        rest = state.waiting[-kept:]
        first_ns = of_crank(np.concatenate(rest))["stamp_ns"][:1]
        if kept < len(lengths) and len(first_ns):
            state.before_s += 0.0 if state.has_passed else max(0.0, 1.0e-9 * (first_ns[0] - state.since_ns))
            state.since_ns = int(first_ns[0])
        state.waiting = (*rest, _NONE)
        return _NONE

    def _found(self, walk: "Walk") -> "Zero | str":
        """The zero from the newest turns, else from all; else why it cannot be found."""
        sampling = self._config.drive_torque.sampling
        if walk.turns > LEAST_TURNS:
            # a fault of the torque that is over must not be waited out
            found = zero_of(walk.newest(LEAST_TURNS), self._model, sampling)
            if isinstance(found, Zero):
                return found
        return zero_of(walk, self._model, sampling)

    def _released(self, zero: "Zero") -> Samples:
        """All samples that wait, with the zero."""
        state = self.state
        waiting, state.waiting = np.concatenate(state.waiting), (_NONE,)
        state.zero, state.former, state.why = zero, None, ""
        return self._taken(waiting)

    @property
    def cause(self) -> str:
        """Why nothing is monitored at present; empty if the zero is known."""
        state = self.state
        if state.zero is not None:
            return ""
        turns = f"{min(state.turns, LEAST_TURNS)} of {LEAST_TURNS} turns"
        if state.turns > LEAST_TURNS:
            turns = f"{state.turns} turns were not enough"
        return f"searching for the crank's zero: {turns}" + (f", {state.why}" if state.why else "")

    @property
    def unmonitored_s(self) -> float:
        """Time [s] of samples that wait, or waited in vain, as far as the twin does not count it."""
        state = self.state
        waiting_s = 0.0 if state.zero else max(0.0, 1.0e-9 * (state.last_ns - state.since_ns))
        return state.before_s + waiting_s

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Why nothing is monitored at present."""
        return {CRANK_ZERO: (self.cause,)} if self.cause else {}

    @property
    def statuses(self) -> Sequence[Status]:
        """The zero of the crank's encoder, or why it is not known."""
        state, zero = self.state, self.state.zero
        values = {
            **{name: getattr(zero, name, math.nan) for name in ("offset_rad", "sigma_rad", "mismatch")},
            "turns": float(zero.turns if zero else state.turns),
            "least_turns": float(LEAST_TURNS),
            "times_found": float(state.times_found),
            "not_monitored_s": self.unmonitored_s,
        }
        if zero is None:
            return (Status("crank zero", Level.WARN, self.cause, values, CRANK_ZERO),)
        offset = estimate(zero.offset_rad, zero.sigma_rad, "rad")
        return (Status("crank zero", Level.OK, f"crank angle at joint position 0: {offset}", values),)


# Turns of the crank that were walked at the commanded cadence, among the samples that wait.


MOST_TURNS = 16  # number that a sensor of instantaneous values needs, see docs/appendix/commissioning.md
_STANDS = 0.1  # turns in the time of a gait cycle
_LONGEST = 1.5  # times the time of the commanded turns, for slower ones


@attrs.frozen(eq=False)
class Walk:
    """The last turns at the commanded cadence.

    Attributes
    ----------
    turns : int
        Number of turns, at most `MOST_TURNS`.
    why : str
        Why there are no turns; empty if there are some.
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
    sound = samples[is_valid(samples)]
    origin_ns = int(np.median(sound["stamp_ns"])) if len(sound) else 0
    longest_ns = int(_LONGEST * MOST_TURNS * 60.0e9 / abs(cadence.commanded_rpm))
    sound = sound[np.abs(sound["stamp_ns"] - origin_ns) <= longest_ns]  # stray stamps are left out
    crank = _series(of_crank(sound), "crank_angle_rad", origin_ns)
    crank = attrs.evolve(crank, value=np.asarray(np.unwrap(crank.value)))
    first, turns, why = _turns(crank, cadence, longest_gap_s)
    is_possible = np.abs(sound["torque_nm"]) <= KINDS[TORQUE].largest
    torque = _series(sound[is_possible], "torque_nm", origin_ns)
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
    """Why the last turn was not at the commanded cadence; empty if it was too short to decide."""
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
        f"the leg walks at {rpm:.3g} rpm; the commanded cadence is {cadence.commanded_rpm:.3g} ± "
        f"{cadence.tolerance_rpm:.2g} rpm"
    )


# The crank's zero from the phase of the drive torque, or why it cannot be found.


LEAST_TURNS = 3  # two turns are enough for averaging sensors; the third shows the repeating residual
_SURE_RAD = 0.015  # scatter that a found zero may have in addition to the error of the model
_LEAST_SAMPLES = 25  # torque samples in a turn: two and a half in a period of the tenth harmonic
_SCANNED = 100  # samples of a turn that are enough to find the phases that are worth a fit
_STARTS = 3  # phases that are fitted
_APART_RAD = 0.3  # two phases nearer than that are one
_UNLIKE = 0.7  # torque residual from which on less than half of the torque's energy is explained
_ANOTHER_LEG = 0.5  # repeating residual from which on the torque comes from a different leg
_DIGITS = 6  # digits of a zero [rad]: further digits may depend on the library of linear algebra


@attrs.frozen
class Zero:
    """A zero that was found.

    Attributes
    ----------
    offset_rad, sigma_rad : float
        Crank angle at joint position 0, from -pi to pi, and its standard deviation.
    turns : int
        Turns of the crank from which the zero was found.
    mismatch : float
        Torque residual: RMS of the unexplained torque over the RMS of the measured torque.
    """

    offset_rad: float
    sigma_rad: float
    turns: int
    mismatch: float


def zero_of(walk: Walk, model: TorqueModel, sampling: str) -> Zero | str:
    """The crank's zero from a walk of at least `LEAST_TURNS`; else why it cannot be found.

    Parameters
    ----------
    walk : Walk
    model : TorqueModel
    sampling : str
        Value of `drive_torque.sampling`.
    """
    found = len(walk.torque.value)
    if not found:
        return "there is no drive torque"
    if found < _LEAST_SAMPLES * walk.turns:
        return (
            f"the drive torque has {found} samples in {walk.turns} turns. Expected {_LEAST_SAMPLES} per turn"
        )
    pair = paired(motion_of(walk.crank), walk.torque)
    if len(pair.torque) < _LEAST_SAMPLES or not float(pair.torque.std()) > 0.0:
        return "the drive torque does not change"
    fits = _fits(pair, walk.turns, model, 0.5 * pair.interval_s if sampling == AVERAGE else 0.0)
    if not fits:
        return "the drive torque does not fit this leg at any crank angle: see drive_torque.sign"
    best = fits[0]
    apart = [abs(math.remainder(_angle(one) - _angle(best), TURN)) for one in fits]
    rivals = [one for one, angle in zip(fits, apart, strict=True) if angle > _APART_RAD]
    doubt = _doubt(best, rivals)
    if doubt:
        return doubt
    return Zero(
        offset_rad=round(_angle(best), _DIGITS),
        sigma_rad=round(math.hypot(best.sigma["offset_rad"], PHASE_ERROR_RAD), _DIGITS),
        turns=walk.turns,
        mismatch=best.mismatch,
    )


def _fits(pair: Pair, turns: int, model: TorqueModel, lag_s: float) -> list[torque_fit.Fit]:
    """Fits near the phases that explain most, with the configured sign, the best first."""
    start = Start(ratio=1.0, offset_rad=0.0, torque_sign=1, explained=0.0, recording=0, lag_s=lag_s)
    middle = float(np.median(pair.position_rad))
    terms = torque_fit.Terms(ratio=False, load=bool(model.load.any()))  # the foot may be on the ground
    few = pair.part(slice(None, None, max(1, len(pair.torque) // (_SCANNED * turns))))
    starts = [
        attrs.evolve(start, offset_rad=phase - middle)
        for phase in _peaks(torque_fit.explained_by_phase(few, model, start, middle))
    ]
    fits = [torque_fit.fit(pair, model, one, terms) for one in starts]
    fits = sorted((one for one in fits if one.gain > 0.0), key=lambda one: one.mismatch)
    return [torque_fit.fit(pair, model, one.refined, terms, with_errors=True) for one in fits[:1]] + fits[1:]


def _peaks(explained: Floats) -> list[float]:
    """Phases [rad] of the largest local maxima above 0."""
    is_peak = (explained > np.roll(explained, 1)) & (explained >= np.roll(explained, -1)) & (explained > 0.0)
    peaks = np.flatnonzero(is_peak)
    best = peaks[np.argsort(-explained[peaks], kind="stable")][:_STARTS]
    return [float(phase) for phase in best * (TURN / torque_fit.PHASES)]


def _angle(one: torque_fit.Fit) -> float:
    """Crank angle at joint position 0 [rad]."""
    return one.offset_rad[0]


def _doubt(best: torque_fit.Fit, rivals: list[torque_fit.Fit]) -> str:
    """Reason why the best fit may be wrong; empty if it is certain."""
    if best.mismatch > _UNLIKE or torque_fit.repeating(best) > _ANOTHER_LEG:
        return (
            f"the drive torque does not fit this leg at any crank angle, {100.0 * best.mismatch:.0f} % of "
            f"its RMS remain unexplained"
        )
    if rivals and torque_fit.too_alike(best, rivals[0]):
        return (
            f"{_angle(best):.2f} and {_angle(rivals[0]):.2f} rad explain "
            "the drive torque almost equally well "
            f"(mismatch {best.mismatch:.2f} and {rivals[0].mismatch:.2f})"
        )
    if best.sigma["offset_rad"] > _SURE_RAD:
        return (
            f"the drive torque scatters: the zero is uncertain by {best.sigma['offset_rad']:.2g} rad. "
            f"Expected {_SURE_RAD:g} rad"
        )
    return ""
