"""The leg's own torque over a walk, and the phase of the crank that explains it."""

import math

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate import torque_fit
from leg_wear_monitor.estimate.joint_motion import Pair, Series, motion_of, paired, series
from leg_wear_monitor.estimate.torque_fit import Start
from leg_wear_monitor.estimate.torque_model import PHASE_ERROR_RAD, TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import Cadence
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import AVERAGE, NO_FAULT, Samples

# Turns of the crank that were walked at the commanded cadence, among the samples that wait.


MOST_TURNS = 16  # as many as a sensor that samples instants needs, see docs/appendix/commissioning.md
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
    sound = samples[(samples["fault"] == NO_FAULT) & (samples["stamp_ns"] > 0)]
    origin_ns = int(np.median(sound["stamp_ns"])) if len(sound) else 0
    longest_ns = int(_LONGEST * MOST_TURNS * 60.0e9 / abs(cadence.commanded_rpm))
    sound = sound[np.abs(sound["stamp_ns"] - origin_ns) <= longest_ns]  # stray stamps are left out
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
        f"the leg walks at {rpm:.3g} rpm; the commanded cadence is {cadence.commanded_rpm:.3g} ± "
        f"{cadence.tolerance_rpm:.2g} rpm"
    )


# The crank's zero from the phase of the drive torque, or why it cannot be found.


LEAST_TURNS = 3  # two were enough for sensors that average; the third shows the repeating residual
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
    other_rad, other_mismatch : float
        The runner-up; NaN if no other angle explains anything.
    """

    offset_rad: float
    sigma_rad: float
    turns: int
    mismatch: float
    other_rad: float = math.nan
    other_mismatch: float = math.nan


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
    other = rivals[0] if rivals else None
    return Zero(
        offset_rad=round(_angle(best), _DIGITS),
        sigma_rad=round(math.hypot(best.sigma["offset_rad"], PHASE_ERROR_RAD), _DIGITS),
        turns=walk.turns,
        mismatch=best.mismatch,
        other_rad=_angle(other) if other else math.nan,
        other_mismatch=other.mismatch if other else math.nan,
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
    """Why the best fit need not be the truth; empty if it is."""
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
            f"it is known to ± {best.sigma['offset_rad']:.2g} rad. Expected {_SURE_RAD:g} rad: the drive "
            "torque scatters"
        )
    return ""
