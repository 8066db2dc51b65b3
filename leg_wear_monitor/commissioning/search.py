"""The search over joints, torques, directions and signs: where to start, candidates, the choice."""

import math
from collections.abc import Callable

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.commissioning.evidence import late_s
from leg_wear_monitor.estimate.joint_motion import JointMotion, Pair, Series, paired, steady_stretch
from leg_wear_monitor.estimate.torque_model import Fit, Start, TorqueModel, fit, repeating, too_alike
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import EFFORT, INTERFACE
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.series import JointName, TorqueSource

# Search of start values: every gear ratio, direction, offset and torque sign at once, by the leg's model.
#
# Over the joint's angle, the torque is periodic with the crank's turn. One spectrum holds its harmonics for
# every gear ratio; their correlation with the model's harmonics, over all offsets, is a further Fourier
# transform. Multiples and fractions of the true ratio have the wrong harmonics, and the model the wrong
# speed.


LEAST_TURNS = 5.0
_HARMONICS = 10
# steps of a ratio within a turn more or less: half a step of the highest harmonic's line
_FINE = 2 * _HARMONICS
_OFFSETS = 64
_LEAST_SAMPLES_PER_TURN = 2.5 * _HARMONICS
_FASTEST_RADPS = 60.0  # 570 rpm
_APART = 2 * _FINE  # two ratios nearer than two turns in the recording are one


def scan(pair: Pair, model: TorqueModel, count: int) -> list[Start]:
    """The best starts of each direction and torque sign, at most ``count`` each; none if there is too little.

    Parameters
    ----------
    pair : Pair
        A steady stretch.
    model : TorqueModel
    count : int
    """
    reach = float(np.ptp(pair.position_rad)) if len(pair.position_rad) else 0.0
    size = float(pair.torque.std()) if len(pair.torque) else 0.0
    if reach == 0.0 or not size > 0.0:
        return []
    speed = float(np.median(pair.speed_radps))
    lines = _lines(len(pair.torque), reach, abs(speed))
    if not len(lines):
        return []
    spectrum, origin = _spectrum(pair)
    ratio: Floats = TURN / (_FINE * reach) * lines.astype(np.float64)
    measured = spectrum[np.outer(lines, np.arange(1, _HARMONICS + 1))]
    starts = []
    for direction in (1, -1):
        wanted = _model_harmonics(model, direction * ratio * speed)
        both = wanted.conj() * measured if direction == 1 else (wanted * measured).conj()
        along = np.fft.fft(both, _OFFSETS, axis=1).real
        energy = (np.abs(wanted) ** 2).sum(axis=1)
        for sign in (1, -1):
            best = (sign * along).max(axis=1).clip(0.0)
            explained = 2.0 * best**2 / energy / size**2
            for peak in _peaks(explained, count):
                angle = TURN / _OFFSETS * float((sign * along[peak]).argmax())
                turned = direction * float(ratio[peak])
                offset = angle - turned * origin
                starts.append(Start(turned, offset, sign, float(explained[peak])))
    return starts


def _lines(samples: int, reach: float, speed: float) -> NDArray[np.int64]:
    """Indices in the spectrum of ratios with enough turns, enough samples per turn, and a credible speed."""
    fastest = _FASTEST_RADPS / speed * reach / TURN
    most = min(samples / _LEAST_SAMPLES_PER_TURN, fastest)
    return np.arange(int(np.ceil(LEAST_TURNS * _FINE)), int(most * _FINE) + 1)


def _spectrum(pair: Pair) -> tuple[NDArray[np.complex128], float]:
    """Fourier coefficients of the torque over the joint's angle, and the angle that they start from."""
    order = np.argsort(pair.position_rad, kind="stable")
    position = pair.position_rad[order]
    even = np.linspace(position[0], position[-1], len(position), endpoint=False)
    torque = np.interp(even, position, pair.torque[order] - pair.torque.mean())
    return np.fft.rfft(torque, _FINE * len(even)) / len(even), float(position[0])


def _model_harmonics(model: TorqueModel, speed: Floats) -> NDArray[np.complex128]:
    """Harmonics (n, _HARMONICS) of the model at speeds (n,) of the crank [rad/s]."""
    tables = np.fft.rfft(model.tables[:3], axis=1)[:, 1 : _HARMONICS + 1] / model.tables.shape[1]
    motion = np.stack([np.ones_like(speed), speed, speed * speed], axis=1)
    return np.asarray(motion @ tables)


def _peaks(value: Floats, count: int) -> list[int]:
    """Indices of the largest local maxima, at a minimum distance from larger maxima."""
    left, peaks = value.copy(), []
    for _ in range(count):
        peak = int(left.argmax())
        if left[peak] <= 0.0:
            break
        peaks.append(peak)
        left[max(0, peak - _APART) : peak + _APART + 1] = 0.0
    return peaks


# The fits of all joints, torques, directions and signs, and the fits that are as good as the best.


_PEAKS = 2  # ratios that are fitted, of each direction and sign
_HOPELESS = 0.3  # pairs below this fraction of the best result get only one fit
_LEAST_PAIRS = 4  # keep a second-best candidate
SAME_GEAR = 0.05


@attrs.frozen(eq=False)
class Candidate:
    """A joint as the crank, a torque as its drive torque, and the fit of both."""

    joint: JointName
    torque: TorqueSource
    fit: Fit


def candidates(
    joints: dict[JointName, JointMotion],
    torques: dict[TorqueSource, Series],
    model: TorqueModel,
    base: MonitorConfig,
) -> list[Candidate]:
    """Fits of all joints that turn with all torques, the best first; none if there is too little of them."""
    starts: list[tuple[JointName, TorqueSource, Pair, Pair, list[Start]]] = []
    for joint, motion in joints.items():
        for torque, series in torques.items():
            if torque.source == EFFORT and (torque.topic, torque.component) != (joint.topic, joint.joint):
                continue  # the monitor takes the crank's own effort
            if torque.source == INTERFACE and torque.component != joint.joint:
                continue
            pair = paired(motion, series, late_s(series, base))
            steady = steady_stretch(pair)
            found = sorted(scan(steady, model, _PEAKS), key=lambda start: -start.explained)
            if found:
                starts.append((joint, torque, pair, steady, found))
    best = max((each[-1][0].explained for each in starts), default=0.0)
    starts.sort(key=lambda each: -each[-1][0].explained)
    fitted: list[Candidate] = []
    for i, (joint, torque, pair, steady, found) in enumerate(starts):
        is_hopeless = found[0].explained < _HOPELESS * best
        if is_hopeless and i >= _LEAST_PAIRS:
            continue
        kept = found[:1] if is_hopeless else found
        fitted += [Candidate(joint, torque, _refined(pair, steady, model, start)) for start in kept]
    return sorted(fitted, key=lambda each: each.fit.mismatch)


def _refined(pair: Pair, steady: Pair, model: TorqueModel, start: Start) -> Fit:
    """Fit of the steady stretch, which makes the ratio exact enough for the fit of all."""
    near = fit(steady, model, start)
    return fit(pair, model, near.refined)


def same_gear(one: Fit, other: Fit) -> bool:
    """True if two fits have about the same gear ratio."""
    return abs(one.gear_ratio / other.gear_ratio - 1.0) < SAME_GEAR


# The best candidate, its rival in each respect, and whether the rival may be the truth.


_SAME_PHASE_RAD = 0.3  # two sensors of one torque differ only by their lags
_SIGNALS = ("crank_joint", "drive_torque.source")
_ANOTHER_LEG = 0.5  # repeating residual beyond which no known leg fits


@attrs.frozen(eq=False)
class Choice:
    """The best candidate, and the best one that differs in each respect, by the parameter that differs.

    Attributes
    ----------
    best : Candidate
    rivals : dict of str to Candidate
    doubts : tuple of str
        Why the choice is not sure; empty if it is.
    """

    best: Candidate
    rivals: dict[str, Candidate]
    doubts: tuple[str, ...]


def choose(found: list[Candidate]) -> Choice:
    """Choose among candidates, the best first; there is at least one."""
    best = found[0]
    of_pair = [each for each in found if (each.joint, each.torque) == (best.joint, best.torque)]
    respects: dict[str, tuple[list[Candidate], Callable[[Candidate], bool]]] = {
        "crank.sign": (of_pair, lambda each: each.fit.direction != best.fit.direction),
        "drive_torque.sign": (of_pair, lambda each: each.fit.torque_sign != best.fit.torque_sign),
        "crank.gear_ratio": (of_pair, lambda each: not same_gear(each.fit, best.fit)),
        "crank_joint": (found, lambda each: each.joint != best.joint),
        "drive_torque.source": (
            found,
            lambda each: each.joint == best.joint and each.torque != best.torque,
        ),
    }
    rivals, doubts = {}, []
    for name, (among, differs) in respects.items():
        rival = next(filter(differs, among), None)  # the best one
        if rival is None:
            continue
        rivals[name] = rival
        is_alike = too_alike(best.fit, rival.fit, other_signal=name in _SIGNALS)
        if is_alike and not (name == "drive_torque.source" and _is_same_torque(best, rival)):
            doubts.append(f"{name}: {_doubt(name, best, rival)}")
    rest = repeating(best.fit)
    if rest > _ANOTHER_LEG:
        doubts.append(
            f"a different leg: {100.0 * rest:.0f} % of the torque repeats with each turn and does not fit "
            "this mechanism at any crank angle"
        )
    return Choice(best, rivals, tuple(doubts))


def _is_same_torque(best: Candidate, rival: Candidate) -> bool:
    """True if a rival is a second sensor of the same torque."""
    apart = math.remainder(best.fit.offset_rad - rival.fit.offset_rad, TURN)
    is_same = best.fit.direction == rival.fit.direction and same_gear(best.fit, rival.fit)
    return is_same and abs(apart) < _SAME_PHASE_RAD


def _doubt(name: str, best: Candidate, rival: Candidate) -> str:
    less = f"mismatch {rival.fit.mismatch:.3f} beside {best.fit.mismatch:.3f}"
    if name == "crank_joint":
        return (
            f"{best.joint.joint} and {rival.joint.joint} both turn like this leg's crank ({less}); select "
            "one with --crank-joint"
        )
    if name == "drive_torque.source":
        return (
            f"{best.torque.label} and {rival.torque.label} both fit, but not with the same offset ({less}); "
            "select one with --drive-torque"
        )
    return (
        f"the torque of this leg looks nearly the same in the other direction ({less}); walk faster, so that "
        "inertia shapes the torque, or turn the crank by hand and look at the joint's position"
    )
