"""The zero of the crank's encoder, from the phase of the drive torque; samples wait until it is found.

An encoder on the motor's shaft starts at zero at each boot. Samples wait while the zero is looked for, and
follow it: no gait cycle is lost, as long as it is found among the samples that may wait. It is looked for at
the ends of evaluation periods, which do not depend on how samples are cut into blocks.
"""

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.joint_motion import Series, motion_of, paired, series
from leg_wear_monitor.estimate.torque_model import (
    PHASE_ERROR_RAD,
    PHASES,
    Start,
    Terms,
    TorqueModel,
    explained_by_phase,
    fit,
    repeating,
    too_alike,
)
from leg_wear_monitor.mechanism.arrays import Flags, Floats
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


class CrankZero(Observer):
    """Finds the zero of the crank's encoder.

    Parameters
    ----------
    model : TorqueModel
    config : MonitorConfig
    tracker : TrackerSettings

    Attributes
    ----------
    zero : Zero or None
        The present one.
    times_found : int
    waiting : tuple of Samples
        Samples that wait for the zero, by evaluation periods; the last one is not over.
    """

    def __init__(self, model: TorqueModel, config: MonitorConfig, tracker: TrackerSettings) -> None:
        self._model, self._config, self._tracker = model, config, tracker
        self.zero: Zero | None = None
        self.times_found = 0
        self.waiting: tuple[Samples, ...] = (_NONE,)
        # the zero before the angle left its course, by how much it is off, and evaluation periods since then;
        # None once it is sure that the encoder has restarted
        self._former: Zero | None = None
        self._off_rad, self._doubts = 0.0, 0
        # turns of the present walk, why no zero was found in them, and periods until the next attempt
        self._turns, self._why, self._rest = 0, "", 0
        self._last_ns, self._last_rad = 0, 0.0  # the last crank sample; stamp 0 before the first
        # stamp of the first crank sample of this search, and the time before it that was not monitored; the
        # twin counts the time once samples were passed on
        self._since_ns, self._before_s, self._has_passed = 0, 0.0, False

    def passed(self, samples: Samples, ends_period: bool) -> Samples:
        """Samples to track now, with the zero: these samples, earlier ones that waited, or none.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
        ends_period : bool
            True if an evaluation period ends with them.
        """
        out, begin = [_NONE], 0
        for at, off_rad in self._breaks(samples):
            out.append(self._taken(samples[begin:at]))
            begin = at
            if self._former is None:
                self._begin(int(samples["stamp_ns"][at]))
            self._off_rad += off_rad
        out.append(self._taken(samples[begin:]))
        if ends_period and self.zero is None:
            out.append(self._end_period())
        return np.concatenate(out)

    def _breaks(self, samples: Samples) -> list[tuple[int, float]]:
        """Index of each crank sample that does not continue the one before, and its jump; NaN after a gap.

        The encoder may have restarted in a gap, unless the angle continues after it.
        """
        tracker = self._tracker
        is_possible = np.abs(samples["crank_angle_rad"]) <= KINDS[CRANK].largest
        at = np.flatnonzero((samples["kind"] == CRANK) & is_valid(samples) & is_possible)
        if not len(at):
            return []
        stamp_ns, angle = samples["stamp_ns"][at], samples["crank_angle_rad"][at]
        self._since_ns = self._since_ns or int(stamp_ns[0])
        before = (self._last_ns, self._last_rad) if self._last_ns else (stamp_ns[0], angle[0])
        self._last_ns, self._last_rad = int(stamp_ns[-1]), float(angle[-1])
        time_s = np.abs(1.0e-9 * np.diff(stamp_ns, prepend=before[0]))
        moved = (np.diff(angle, prepend=before[1]) + math.pi) % TURN - math.pi
        reach = tracker.largest_speed * time_s
        is_gap = time_s > BRIDGE_LIMIT_S
        is_break = np.where(is_gap, np.abs(angle) <= reach + TURN, np.abs(moved) > GATE_RAD + reach)
        jump = np.where(is_gap, math.nan, moved)
        return [(int(at[k]), float(jump[k])) for k in np.flatnonzero(is_break)]

    def _begin(self, stamp_ns: int) -> None:
        """Begin to look for the zero; samples that wait belong to a different one."""
        if self.zero is None:
            self._drop_until(stamp_ns)
        self._former, self.zero, self._off_rad, self._doubts = self.zero, None, 0.0, 0
        self.waiting, self._since_ns = (_NONE,), stamp_ns
        self._turns, self._why, self._rest = 0, "", 0

    def _drop_until(self, stamp_ns: int) -> None:
        """Count the time until a stamp as not monitored."""
        if not self._has_passed:
            self._before_s += max(0.0, 1.0e-9 * (stamp_ns - self._since_ns))
        self._since_ns = stamp_ns

    def _taken(self, samples: Samples) -> Samples:
        """Samples without a break: with the zero; none if they have to wait."""
        if self.zero is None:
            *before, last = self.waiting
            self.waiting = (*before, np.concatenate([last, samples]))
            return _NONE
        self._has_passed |= len(samples) > 0
        samples = samples.copy()
        samples["crank_angle_rad"] += self.zero.offset_rad
        return samples

    def _end_period(self) -> Samples:
        """Look for the zero; returns the samples that need not wait any longer."""
        if self._former and abs(math.remainder(self._off_rad, TURN)) < _BACK_RAD:
            return self._released(self._former)  # it was a glitch
        self._doubts += 1
        if self._doubts >= _LONGEST_DOUBT:
            self._former = None
        self._rest = max(0, self._rest - 1)
        found = self._found(np.concatenate(self.waiting))
        if isinstance(found, Zero):
            self.times_found += 1
            return self._released(found)
        self._why = found
        lengths = np.cumsum([len(part) for part in reversed(self.waiting)])
        kept = self.waiting[-min(_MOST_PERIODS, int(np.count_nonzero(lengths <= _MOST_SAMPLES))) :]
        first_ns = of_crank(np.concatenate(kept))["stamp_ns"][:1]
        if len(kept) < len(lengths) and len(first_ns):
            self._drop_until(int(first_ns[0]))
        self.waiting = (*kept, _NONE)
        return _NONE

    def _found(self, samples: Samples) -> "Zero | str":
        """The zero from the newest turns, else from all; else why it is not found."""
        sound = samples[is_valid(samples)]
        cadence = self._config.cadence
        origin_ns = int(np.median(sound["stamp_ns"])) if len(sound) else 0
        longest_ns = int(_LONGEST * MOST_TURNS * 60.0e9 / abs(cadence.commanded_rpm))
        sound = sound[np.abs(sound["stamp_ns"] - origin_ns) <= longest_ns]  # stray stamps are left out
        crank = _series(of_crank(sound), "crank_angle_rad", origin_ns)
        if not len(crank.value):
            self._turns = 0
            return "no crank sample can be used"
        crank = attrs.evolve(crank, value=np.asarray(np.unwrap(crank.value)))
        begins = _turns(crank, cadence)
        self._turns = len(begins) - 1
        if self._turns < LEAST_TURNS:
            return "" if self._turns else _why_none(crank, cadence)
        if self._rest:
            return self._why
        self._rest = _A_CYCLE
        torque = _series(sound[np.abs(sound["torque_nm"]) <= KINDS[TORQUE].largest], "torque_nm", origin_ns)
        found: Zero | str = ""
        # a fault of the torque that is over must not be waited out
        for turns in sorted({LEAST_TURNS, self._turns}):
            begin_s = crank.time_s[begins[turns]]
            walked = (torque.time_s >= begin_s) & (torque.time_s <= crank.time_s[-1])
            parts = _part(crank, crank.time_s >= begin_s), _part(torque, walked)
            found = zero_of(*parts, turns, self._model, self._config.drive_torque.sampling)
            if isinstance(found, Zero):
                break
        return found

    def _released(self, zero: "Zero") -> Samples:
        """All samples that wait, with the zero."""
        waiting, self.waiting = np.concatenate(self.waiting), (_NONE,)
        self.zero, self._former, self._why = zero, None, ""
        return self._taken(waiting)

    @property
    def cause(self) -> str:
        """Why nothing is monitored at present; empty if the zero is known."""
        if self.zero is not None:
            return ""
        turns = f"{min(self._turns, LEAST_TURNS)} of {LEAST_TURNS} turns"
        if self._turns > LEAST_TURNS:
            turns = f"{self._turns} turns were not enough"
        return f"searching for the crank's zero: {turns}" + (f", {self._why}" if self._why else "")

    @property
    def unmonitored_s(self) -> float:
        """Time [s] of samples that wait, or waited in vain, as far as the twin does not count it."""
        waiting_s = 0.0 if self.zero else max(0.0, 1.0e-9 * (self._last_ns - self._since_ns))
        return self._before_s + waiting_s

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Why nothing is monitored at present."""
        return {CRANK_ZERO: (self.cause,)} if self.cause else {}

    @property
    def statuses(self) -> Sequence[Status]:
        """The zero of the crank's encoder, or why it is not known."""
        zero = self.zero
        values = {
            **{name: getattr(zero, name, math.nan) for name in ("offset_rad", "sigma_rad", "mismatch")},
            "turns": float(zero.turns if zero else self._turns),
            "least_turns": float(LEAST_TURNS),
            "times_found": float(self.times_found),
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


def _series(samples: Samples, name: str, origin_ns: int) -> Series:
    return series(samples["stamp_ns"], samples[name], np.zeros(len(samples), np.int64), origin_ns)


def _part(whole: Series, which: Flags) -> Series:
    return Series(whole.time_s[which], whole.value[which], whole.recording[which])


def _turns(crank: Series, cadence: Cadence) -> list[int]:
    """Index of the last sample, and of the first one of each of the last turns at the commanded cadence."""
    commanded, time_s = cadence.commanded_rpm, crank.time_s
    back: Floats = np.sign(commanded) * (crank.value[-1] - crank.value) / TURN  # turns until now
    is_gap, begins = np.diff(time_s, append=time_s[-1]) > BRIDGE_LIMIT_S, [len(time_s) - 1]
    while len(begins) <= MOST_TURNS:
        end, before = begins[-1], np.flatnonzero(back[: begins[-1] + 1] >= len(begins))
        if not len(before) or is_gap[before[-1] : end].any():
            break
        rpm = math.copysign(60.0, commanded) / float(time_s[end] - time_s[before[-1]])
        if abs(rpm - commanded) > cadence.tolerance_rpm:
            break
        begins.append(int(before[-1]))
    return begins


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


def zero_of(crank: Series, torque: Series, turns: int, model: TorqueModel, sampling: str) -> Zero | str:
    """The crank's zero from some turns at the commanded cadence; else why it cannot be found.

    Parameters
    ----------
    crank, torque : Series
        Crank angle up to the unknown zero, counted on over turns [rad], and drive torque [N m] meanwhile.
    turns : int
    model : TorqueModel
    sampling : str
        Value of `drive_torque.sampling`.
    """
    found = len(torque.value)
    if not found:
        return "there is no drive torque"
    if found < _LEAST_SAMPLES * turns:
        return f"the drive torque has {found} samples in {turns} turns. Expected {_LEAST_SAMPLES} per turn"
    pair = paired(motion_of(crank), torque)
    if len(pair.torque) < _LEAST_SAMPLES or not float(pair.torque.std()) > 0.0:
        return "the drive torque does not change"
    # phases that explain most, with the configured sign
    lag_s = 0.5 * pair.interval_s if sampling == AVERAGE else 0.0
    start = Start(1.0, 0.0, torque_sign=1, explained=0.0, recording=0, lag_s=lag_s)
    middle = float(np.median(pair.position_rad))
    few = pair.part(slice(None, None, max(1, len(pair.torque) // (_SCANNED * turns))))
    explained = explained_by_phase(few, model, start, middle)
    is_peak = (explained > np.roll(explained, 1)) & (explained >= np.roll(explained, -1)) & (explained > 0.0)
    peaks = np.flatnonzero(is_peak)
    peaks = peaks[np.argsort(-explained[peaks], kind="stable")][:_STARTS]
    # fits near these phases, the best first; the foot may be on the ground
    terms = Terms(ratio=False, load=bool(model.load.any()))
    starts = [attrs.evolve(start, offset_rad=float(at) * TURN / PHASES - middle) for at in peaks]
    fits = [fit(pair, model, one, terms) for one in starts]
    fits = sorted((one for one in fits if one.gain > 0.0), key=lambda one: one.mismatch)
    if not fits:
        return "the drive torque does not fit this leg at any crank angle: see drive_torque.sign"
    best = fit(pair, model, fits[0].refined, terms, with_errors=True)
    offset_rad, sigma_rad = best.offset_rad[0], best.sigma["offset_rad"]
    # reasons why the best fit may be wrong
    if best.mismatch > _UNLIKE or repeating(best) > _ANOTHER_LEG:
        return (
            f"the drive torque does not fit this leg at any crank angle, {100.0 * best.mismatch:.0f} % of "
            f"its RMS remain unexplained"
        )
    rivals = (one for one in fits if abs(math.remainder(one.offset_rad[0] - offset_rad, TURN)) > _APART_RAD)
    rival = next(rivals, None)
    if rival and too_alike(best, rival):
        return (
            f"{offset_rad:.2f} and {rival.offset_rad[0]:.2f} rad explain the drive torque almost equally "
            f"well (mismatch {best.mismatch:.2f} and {rival.mismatch:.2f})"
        )
    if sigma_rad > _SURE_RAD:
        return (
            f"the drive torque scatters: the zero is uncertain by {sigma_rad:.2g} rad. "
            f"Expected {_SURE_RAD:g} rad"
        )
    sigma_rad = math.hypot(sigma_rad, PHASE_ERROR_RAD)
    return Zero(round(offset_rad, _DIGITS), round(sigma_rad, _DIGITS), turns, best.mismatch)
