"""The crank's zero from the phase of the drive torque, or why it cannot be told."""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.torque_fit.fit import Fit, fit
from leg_wear_monitor.estimate.torque_fit.likeness import repeating, too_alike
from leg_wear_monitor.estimate.torque_fit.motion import motion_of
from leg_wear_monitor.estimate.torque_fit.pairing import Pair, paired
from leg_wear_monitor.estimate.torque_fit.regression import PHASES, Terms, explained_by_phase
from leg_wear_monitor.estimate.torque_fit.start import Start
from leg_wear_monitor.estimate.torque_fit.torque_model import PHASE_ERROR_RAD, TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.crank_zero.walk import Walk
from leg_wear_monitor.twin.settings import AVERAGE

LEAST_TURNS = 3  # two were enough for sensors that average; the third shows what repeats
_SURE_RAD = 0.015  # scatter that a found zero may have beside the error of the model
_LEAST_SAMPLES = 25  # torque samples in a turn: two and a half in a period of the tenth harmonic
_SCANNED = 100  # samples of a turn that are enough to find the phases that are worth a fit
_STARTS = 3  # phases that are fitted
_APART_RAD = 0.3  # two phases nearer than that are one
_UNLIKE = 0.7  # mismatch from which on less than half of the torque's energy is explained
_ANOTHER_LEG = 0.5  # rest that repeats from which on the torque is that of another leg
_DIGITS = 6  # of a zero [rad]: those beyond may depend on the library of linear algebra


@attrs.frozen
class Zero:
    """A zero that was found.

    Attributes
    ----------
    offset_rad, sigma_rad : float
        Crank angle at joint position 0, from -pi to pi, and its standard deviation.
    turns : int
        Turns of the crank that it was found from.
    mismatch : float
        RMS of the torque that is not explained, as a fraction of that of the measured torque.
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
    """The crank's zero from a walk of at least `LEAST_TURNS`; else why it cannot be told.

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
        return f"the drive torque has {found} samples in {walk.turns} turns, expected {_LEAST_SAMPLES} a turn"
    pair = paired(motion_of(walk.crank), walk.torque)
    if len(pair.torque) < _LEAST_SAMPLES or not float(pair.torque.std()) > 0.0:
        return "the drive torque does not change"
    fits = _fits(pair, walk.turns, model, 0.5 * pair.interval_s if sampling == AVERAGE else 0.0)
    if not fits:
        return "the drive torque is not that of this leg at any crank angle: see drive_torque.sign"
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


def _fits(pair: Pair, turns: int, model: TorqueModel, lag_s: float) -> list[Fit]:
    """Fits near the phases that explain most, with the configured sign, the best first."""
    start = Start(ratio=1.0, offset_rad=0.0, torque_sign=1, explained=0.0, recording=0, lag_s=lag_s)
    middle = float(np.median(pair.position_rad))
    terms = Terms(ratio=False, load=bool(model.load.any()))  # the foot may be on the ground
    few = pair.part(slice(None, None, max(1, len(pair.torque) // (_SCANNED * turns))))
    starts = [
        attrs.evolve(start, offset_rad=phase - middle)
        for phase in _peaks(explained_by_phase(few, model, start, middle))
    ]
    fits = [fit(pair, model, one, terms) for one in starts]
    fits = sorted((one for one in fits if one.gain > 0.0), key=lambda one: one.mismatch)
    return [fit(pair, model, one.refined, terms, with_errors=True) for one in fits[:1]] + fits[1:]


def _peaks(explained: Floats) -> list[float]:
    """Phases [rad] of the largest local maxima above 0."""
    is_peak = (explained > np.roll(explained, 1)) & (explained >= np.roll(explained, -1)) & (explained > 0.0)
    peaks = np.flatnonzero(is_peak)
    best = peaks[np.argsort(-explained[peaks], kind="stable")][:_STARTS]
    return [float(phase) for phase in best * (TURN / PHASES)]


def _angle(one: Fit) -> float:
    """Crank angle at joint position 0 [rad]."""
    return one.offset_rad[0]


def _doubt(best: Fit, rivals: list[Fit]) -> str:
    """Why the best fit need not be the truth; empty if it is."""
    if best.mismatch > _UNLIKE or repeating(best) > _ANOTHER_LEG:
        return (
            f"the drive torque is not that of this leg at any crank angle, {100.0 * best.mismatch:.0f} % of "
            "its RMS stay unexplained"
        )
    if rivals and too_alike(best, rivals[0]):
        return (
            f"{_angle(best):.2f} and {_angle(rivals[0]):.2f} rad explain the drive torque nearly alike "
            f"(mismatch {best.mismatch:.2f} and {rivals[0].mismatch:.2f})"
        )
    if best.sigma["offset_rad"] > _SURE_RAD:
        return (
            f"it is known to ± {best.sigma['offset_rad']:.2g} rad, expected {_SURE_RAD:g} rad: the drive "
            "torque scatters"
        )
    return ""
