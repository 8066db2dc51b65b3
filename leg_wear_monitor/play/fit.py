"""Play of a joint from a recording at rest: plateaus, the fit to them, clearances."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.files import json_text
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.angle_reference import PHASES, AngleModel, angle_model

# Results of a play measurement: plays, and the clearances that they come from.


SCHEMA_VERSION = 1


@attrs.frozen(kw_only=True)
class Play:
    """Play of a joint in one posture.

    Attributes
    ----------
    joint : str
        Name of the angle.
    load : str
        Signal that gave the side; empty if the angle itself did.
    play_rad : float
        Distance between the plateaus on both sides of the load's reversals.
    sigma_rad : float
        Standard uncertainty of the play, from the scatter of the repeats and the encoder's count.
    count_rad : float
        Count of the encoder.
    noise_rad : float
        Standard deviation of the angle within a plateau.
    scatter_rad : float
        Standard deviation between the plateaus of a side.
    drift_rad : float
        Range of the drift that was removed.
    plateaus : tuple of int
        Plateaus that count, on either side.
    moving : int
        Pushes left out because the angle still moved at their end.
    short : int
        Pushes left out because the angle stopped short of the others.
    outside : int
        Pushes left out because the angle went beyond the others.
    sprung : int
        Pushes that the load signal held, while the joint had sprung back; their outermost rest counts.
    findings : tuple of str
        What makes the result doubtful, and the remedy.
    notes : tuple of str
        Further information.
    recording : str
        What was measured from; empty for arrays.
    crank_angle_rad : float, optional
        Crank angle of the posture; null if it was not given.
    """

    joint: str
    load: str
    play_rad: float
    sigma_rad: float
    count_rad: float
    noise_rad: float
    scatter_rad: float
    drift_rad: float
    plateaus: tuple[int, int]
    moving: int = 0
    short: int = 0
    outside: int = 0
    sprung: int = 0
    findings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    recording: str = ""
    crank_angle_rad: float | None = None


@attrs.frozen(kw_only=True)
class JointClearance:
    """Clearance of a joint as plays show it.

    Attributes
    ----------
    joint : str
        Name of the joint in the mechanism.
    rad_per_m : tuple of float
        Play that a meter of radial clearance gives, in each posture.
    clearance_m : float, optional
        Mean radial clearance; null if the plays do not tell it from others.
    sigma_m : float, optional
        Its standard deviation.
    most_m : float, optional
        Largest clearance that the plays allow; null if the joint has no effect on the encoder.
    """

    joint: str
    rad_per_m: tuple[float, ...]
    clearance_m: float | None = None
    sigma_m: float | None = None
    most_m: float | None = None


@attrs.frozen(kw_only=True)
class Clearances:
    """Clearances of the clearance joints.

    Attributes
    ----------
    joints : tuple of JointClearance
        The clearance joints, one by one.
    findings : tuple of str
        What does not fit.
    """

    joints: tuple[JointClearance, ...]
    findings: tuple[str, ...] = ()

    @property
    def not_told_apart(self) -> tuple[str, ...]:
        """Joints with an effect whose clearances are not told apart."""
        return tuple(one.joint for one in self.joints if one.most_m is not None and one.clearance_m is None)


@attrs.frozen(kw_only=True)
class PlayMeasurement:
    """Plays of a joint in one or several postures, and the clearances that they come from.

    Attributes
    ----------
    plays : tuple of Play
        The plays, one a recording.
    clearances : Clearances, optional
        Where they come from; null without a mechanism.
    """

    plays: tuple[Play, ...]
    clearances: Clearances | None = None

    @property
    def is_sure(self) -> bool:
        """Whether nothing is doubtful, and all clearances that have an effect are told apart."""
        found = self.clearances
        is_separated = found is None or not (found.findings or found.not_told_apart)
        return is_separated and not any(play.findings for play in self.plays)

    def to_dict(self) -> dict[str, Any]:
        """Plain object for JSON."""
        plain: dict[str, Any] = {"schema_version": SCHEMA_VERSION, "is_sure": self.is_sure}
        plain["plays"] = [attrs.asdict(play) for play in self.plays]
        plain["clearances"] = None
        if self.clearances is not None:
            joints = {"not_told_apart": self.clearances.not_told_apart}
            plain["clearances"] = {**attrs.asdict(self.clearances), **joints}
        return plain

    def to_json(self) -> str:
        """Text of `to_dict`: what ``play --json`` writes."""
        return json_text(self.to_dict())


# Plateaus: what an angle comes to rest at between two reversals of the load.


_LEAST_SAMPLES = 3  # of a push: two show that the angle is at rest
_SHORT = 8  # samples of a push: below, its second half may be the joint on its way
_BRIEF = 0.25  # of the usual push: less is a signal that crosses its middle slowly
_ENDS = (5.0, 95.0)  # percentiles: ends of a signal, without its outliers
_RARE = (0.5, 99.5)  # percentiles: ends of a signal that is at rest for most of the time
_MANY_TIMES = 3.0  # the range, if the pushes are rare
_SURE = 3.0  # standard deviations
_ROUNDED = 1.0 + 1.0e-6  # a count as a difference of two angles
NORMAL_MAD = 1.4826  # standard deviations per median absolute deviation


@attrs.frozen(eq=False)
class Plateaus:
    """Plateaus of an angle, one per push.

    Attributes
    ----------
    time_s, angle_rad : (m,) arrays
        Mean time and angle of each.
    side : (m,) array
        1.0 and -1.0, on the two sides of the reversals.
    noise_rad : float
        Standard deviation of the samples within a plateau, median of all.
    samples : float
        Samples of a plateau, median of all.
    moving : int
        Pushes without a rest of the angle; they are not among the plateaus.
    brief : int
        Pushes of too few samples; they are not, either.
    sprung : int
        Pushes that the signal held, while the joint had sprung back from its end.
    """

    time_s: Floats
    angle_rad: Floats
    side: Floats
    noise_rad: float
    samples: float
    moving: int
    brief: int = 0
    sprung: int = 0


@attrs.frozen(eq=False)
class _Rest:
    """Part of a push: mean time and angle, its side, noise, samples, and the step between its halves."""

    time_s: float
    angle_rad: float
    side: float
    noise_rad: float
    samples: int
    step_rad: float


@attrs.frozen(eq=False)
class Sides:
    """Side of each sample of a signal that reverses.

    Attributes
    ----------
    side : (n,) array
        1 or -1, 0 before the first push. A sample near the middle keeps the side of the one before, so that
        noise and released pushes are no reversals.
    is_held : (n,) array of bool
        Whether the signal is beyond the middle half of its range, so that it presses the joint to its end.
    """

    side: NDArray[np.int8]
    is_held: NDArray[np.bool_]


def sides(signal: Floats) -> Sides:
    """Sides of a signal that reverses.

    Raises
    ------
    LegWearError
        If the signal does not change.
    """
    low, high = np.percentile(signal, _ENDS)
    least, most = np.percentile(signal, _RARE)
    if most - least > _MANY_TIMES * (high - low):
        low, high = least, most
    if not high > low:
        raise LegWearError("does not reverse: push the joint to and fro, and hold each push")
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    state = np.where(signal > middle + quarter, 1, np.where(signal < middle - quarter, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), 0))
    return Sides(np.asarray(state[last], np.int8), np.asarray(state != 0))


def plateaus(time_s: Floats, angle: Floats, sides: Sides, count_rad: float) -> Plateaus:
    """Plateaus of an angle (n,) [rad] between the reversals of its sides.

    A push counts by the outermost place at which the joint rests. That is where it rests at the end of a push
    that presses all the time. If the signal is a command, the joint follows it late; if it keeps its value
    after the push, the joint springs back: then the place is another one, and it is beyond that by more than
    count and noise.
    """
    edges = np.flatnonzero(np.diff(sides.side)) + 1
    bounds = np.concatenate([[0], edges, [len(sides.side)]])
    spans = [
        (begin + np.flatnonzero(sides.is_held[begin:end]), end)
        for begin, end in pairwise(bounds.tolist())
        if sides.side[begin]
    ]
    n = _LEAST_SAMPLES
    usual = _BRIEF * float(np.median([len(held) for held, _ in spans])) if spans else 0.0
    # the joint may follow a signal late, by the length of a push
    pushes = [
        (held, np.arange(held[0], min(end, held[-1] + 1 + len(held))))
        for held, end in spans
        if len(held) >= max(n, usual)
    ]
    last = [_rest(time_s, angle, sides, held[_end(len(held))]) for held, _ in pushes]
    noise = _median(
        [
            own.noise_rad
            if len(held) >= _SHORT
            else min(float(np.std(angle[window[k : k + n]])) for k in range(len(window) - n + 1))
            for own, (held, window) in zip(last, pushes, strict=True)
        ]
    )
    # of second differences: a joint that swings has none, and no rest where it turns back
    trembles = NORMAL_MAD * _median(np.abs(np.diff(angle[sides.is_held], 2)).tolist()) / np.sqrt(6.0)
    outward = _outward(last)
    rests, sprung = [], 0
    for own, (held, window) in zip(last, pushes, strict=True):
        best = own if _is_still(own, noise, count_rad) else None
        for part in _parts(angle[window] * outward * own.side, max(n, len(held) // 8)):
            each = _rest(time_s, angle, sides, window[part])
            least = _ROUNDED * count_rad + _SURE * noise / np.sqrt(each.samples)
            if best is not None and outward * own.side * (each.angle_rad - best.angle_rad) <= least:
                break
            if _is_still(each, noise, count_rad) and each.noise_rad <= count_rad + _SURE * trembles:
                best = each
                break
        if best is not None:
            rests.append(best)
            sprung += best is not own and best.time_s < own.time_s
    return Plateaus(
        np.array([each.time_s for each in rests]),
        np.array([each.angle_rad for each in rests]),
        np.array([each.side for each in rests]),
        _median([each.noise_rad for each in rests]),
        _median([float(each.samples) for each in rests]),
        len(pushes) - len(rests),
        sum(0 < len(held) < n for held, _ in spans),
        sprung,
    )


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else 0.0


def _end(samples: int) -> slice:
    """Rest of a push at its end: its second half, without the end, where the next push may have begun."""
    return slice(samples // 2, samples - samples // 8)


def _outward(rests: list[_Rest]) -> float:
    """Whether the angle grows (1.0) or falls (-1.0) towards the side 1.0, by the medians of both sides."""
    each = [[one.angle_rad for one in rests if one.side == side] for side in (1.0, -1.0)]
    return 1.0 if _median(each[0]) >= _median(each[1]) else -1.0


def _parts(outward: Floats, samples: int) -> Iterator[slice]:
    """Parts of a push of so many samples, overlapping by half, the outermost first."""
    begins = np.arange(0, len(outward) - samples + 1, max(1, samples // 2))
    total = np.concatenate([[0.0], np.cumsum(outward)])
    for begin in begins[np.argsort(total[begins] - total[begins + samples], kind="stable")].tolist():
        yield slice(begin, begin + samples)


def _rest(time_s: Floats, angle: Floats, sides: Sides, part: NDArray[np.int64]) -> _Rest:
    time_s, angle, side = time_s[part], angle[part], float(sides.side[part[0]])
    half = len(angle) // 2
    step = _middle_mean(angle[half:]) - _middle_mean(angle[:half])
    noise = float(np.std(angle))
    return _Rest(float(time_s.mean()), _middle_mean(angle), side, noise, len(angle), step)


def _middle_mean(values: Floats) -> float:
    """Mean of the middle half of values: single outliers have no effect."""
    ordered, cut = np.sort(values), len(values) // 4
    return float(ordered[cut : len(ordered) - cut].mean())


def _is_still(rest: _Rest, noise: float, count_rad: float) -> bool:
    """Whether the two halves of a plateau agree within noise and one count."""
    scatter = noise * np.sqrt(2.0 / (rest.samples / 2.0))
    return bool(abs(rest.step_rad) <= count_rad * _ROUNDED + _SURE * scatter)


# Fit of the play and of a slow drift to plateaus, robust against pushes that stop short.


_MOST_DEGREE = 3  # of the drift: a slow change with at most two turning points
_A_DEGREE = 4  # plateaus for each further degree
_ROUNDS = 20
_FAR = 3.5  # standard deviations from which a plateau is left out
MANY = 0.25  # fraction of the pushes
_NEAR = 0.25  # of the play: pushes as near to the others differ, none of them is an outlier


@attrs.frozen(eq=False)
class Fit:
    """Play and drift of plateaus.

    Attributes
    ----------
    play_rad, sigma_rad : float
        Signed play: angle on the side 1.0 minus angle on the side -1.0. Its standard deviation from the
        scatter of the plateaus, with Student's few degrees of freedom.
    scatter_rad : float
        Standard deviation of a plateau about the fit.
    drift : (n,) array
        Coefficients of Legendre polynomials over the time of the plateaus.
    used : (m,) array of bool
        Plateaus that count.
    short : int
        Plateaus left out because the angle stopped short of the others.
    """

    play_rad: float
    sigma_rad: float
    scatter_rad: float
    drift: Floats
    begin_s: float
    end_s: float
    used: NDArray[np.bool_]
    short: int

    def drift_at(self, time_s: Floats) -> Floats:
        """Drift [rad] at times within those of the plateaus; constant before and after."""
        return np.asarray(
            np.polynomial.legendre.legval(_scaled(time_s, self.begin_s, self.end_s), self.drift)
        )


def fit_play(found: Plateaus, least_rad: float) -> Fit:
    """Fit play and drift.

    Parameters
    ----------
    found : Plateaus
    least_rad : float
        Standard deviation of a plateau from count and noise: no plateau is left out for less.
    """
    m = len(found.side)
    degree = int(np.clip((m - _A_DEGREE) // _A_DEGREE, 1, _MOST_DEGREE))
    begin, end = float(found.time_s[0]), float(found.time_s[-1])
    basis = np.polynomial.legendre.legvander(_scaled(found.time_s, begin, end), degree)
    columns = np.column_stack([0.5 * found.side, basis])
    used, solution = _robust(columns, found.angle_rad, least_rad)
    residual = found.angle_rad - columns @ solution
    if np.count_nonzero(~used) > MANY * m:
        # two ends on one side, none of which is the rare one
        used = used | (np.abs(residual) < _NEAR * abs(solution[0]))
        solution = _solved(columns[used], found.angle_rad[used], np.ones(int(used.sum())))
        residual = found.angle_rad - columns @ solution
    outward = residual * found.side * np.sign(solution[0])
    x, rest = columns[used], int(used.sum()) - columns.shape[1]
    scatter = float(np.sqrt(np.sum(np.square(residual[used])) / max(rest, 1)))
    # a mean of few values scatters as Student's t: variance rest / (rest - 2)
    few = np.sqrt(rest / (rest - 2.0)) if rest > 2 else np.inf
    unit = float(np.sqrt(np.linalg.pinv(x.T @ x)[0, 0]))
    return Fit(
        float(solution[0]),
        float(few * scatter * unit) if scatter else 0.0,
        scatter,
        solution[1:],
        begin,
        end,
        used,
        int(np.count_nonzero(~used & (outward < 0.0))),
    )


def _robust(columns: Floats, y: Floats, least: float) -> tuple[NDArray[np.bool_], Floats]:
    """Plateaus that count, and the least-squares solution of these; begins with least absolute values."""
    weight = np.ones(len(y))
    solution = np.zeros(columns.shape[1])
    for _ in range(_ROUNDS):
        solution = _solved(columns, y, np.sqrt(weight))
        weight = 1.0 / np.maximum(np.abs(y - columns @ solution), 0.1 * least)
    used = np.ones(len(y), bool)
    for _ in range(_ROUNDS):
        residual = np.abs(y - columns @ solution)
        near = residual <= _FAR * max(NORMAL_MAD * float(np.median(residual)), least)
        solution = _solved(columns[near], y[near], np.ones(int(near.sum())))
        if (near == used).all():
            break
        used = near
    return used, solution


def _solved(columns: Floats, y: Floats, root: Floats) -> Floats:
    return np.asarray(np.linalg.lstsq(columns * root[:, None], y * root, rcond=None)[0])


def _scaled(time_s: Floats, begin: float, end: float) -> Floats:
    return np.asarray(np.clip(2.0 * (time_s - begin) / max(end - begin, 1.0e-9) - 1.0, -1.0, 1.0))


# From plays of an encoder to clearances of a mechanism's joints: the linear model of `joint_angles`.
#
# A push that turns the encoder's joint presses each journal to the end that turns it most. Between two
# pushes, the angle moves by the sum over the joints of 2 |S_phi| c.


_SURE_CLEARANCE = 2.0  # standard deviations
_SAME = 1.0e-9  # of the largest singular value: below, two joints have the same effect
_NO_FIT = 3.0  # standard deviations of a play that the clearances cannot explain


def clearances_of(
    mechanism: Mechanism,
    encoder: str,
    crank_angles: Sequence[float],
    play_rad: Sequence[float],
    sigma_rad: Sequence[float],
) -> Clearances:
    """Clearances of a mechanism's clearance joints from plays of an encoder in several postures.

    Parameters
    ----------
    mechanism : Mechanism
        Its other joints count as ideal.
    encoder : str
        Joint with the encoder.
    crank_angles, play_rad, sigma_rad : sequences of float
        Crank angle [rad], play and its standard deviation, of each posture.
    """
    effect = effects(angle_model(mechanism, [encoder]), np.asarray(crank_angles, float))
    return solved(mechanism.clearance_joints, effect, np.asarray(play_rad), np.asarray(sigma_rad))


def effects(model: AngleModel, crank_angle: Floats) -> Floats:
    """Play (r, k) that a meter of radial clearance of each joint gives at crank angles (r,) [rad/m]."""
    middle = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    tables = model.by_e[:, 0].reshape(PHASES, -1).T
    by_e = np.stack([np.interp(crank_angle, middle, one, period=TURN) for one in tables], axis=1)
    return np.asarray(2.0 * np.linalg.norm(by_e.reshape(len(crank_angle), -1, 2), axis=2))


def solved(names: Sequence[str], effect: Floats, play: Floats, sigma: Floats) -> Clearances:
    """Clearances by weighted least squares, for joints with effects (r, k) on plays (r,) [rad].

    A clearance is known if its standard deviation is below half of what the plays allow at most, so that the
    result says more than this bound.
    """
    shown = np.asarray(effect.any(axis=0))
    if not shown.any():
        raise LegWearError("no clearance joint of the mechanism has an effect on this encoder")
    with np.errstate(divide="ignore"):
        most = np.asarray(np.min((play + _SURE_CLEARANCE * sigma)[:, None] / effect, axis=0))
    # in fractions of these largest clearances, a standard deviation of half of one says nothing new
    a = effect[:, shown] * most[shown] / sigma[:, None]
    value, deviation = np.full((2, len(names)), np.nan)
    value[shown] = np.linalg.lstsq(a, play / sigma, rcond=_SAME)[0]
    deviation[shown] = _deviations(a)
    joints = [
        _joint(name, effect[:, k], float(most[k]), float(value[k]), float(deviation[k]))
        for k, name in enumerate(names)
    ]
    residual = a @ value[shown] - play / sigma
    return Clearances(joints=tuple(joints), findings=tuple(_findings(joints, residual, a)))


def _deviations(a: Floats) -> Floats:
    """Standard deviations of the solution for rows a (r, k) of unit variance; infinite if not determined."""
    _, values, vt = np.linalg.svd(a, full_matrices=True)
    values = np.pad(values, (0, len(vt) - len(values)))
    weak = values <= _SAME * values[0]
    variance = np.square(vt[~weak].T) @ np.square(1.0 / values[~weak])
    blind = np.square(vt[weak]).sum(axis=0) > _SAME
    return np.asarray(np.where(blind, np.inf, np.sqrt(variance)))


def _joint(name: str, effect: Floats, most: float, fraction: float, deviation: float) -> JointClearance:
    """Clearance of a joint from its fraction of the largest one."""
    one = JointClearance(joint=name, rad_per_m=tuple(effect.tolist()))
    if not effect.any():
        return one
    one = attrs.evolve(one, most_m=most)
    if not _SURE_CLEARANCE * deviation < 1.0:
        return one
    return attrs.evolve(one, clearance_m=fraction * most, sigma_m=deviation * most)


def _findings(joints: Sequence[JointClearance], residual: Floats, a: Floats) -> list[str]:
    found = [
        f"the clearance of {one.joint} would be {1e3 * one.clearance_m:.3g} mm: mechanism, crank angle or "
        "direction of the pushes does not fit"
        for one in joints
        if one.clearance_m is not None and one.sigma_m is not None
        if one.clearance_m < -_SURE_CLEARANCE * one.sigma_m
    ]
    rest = len(residual) - int(np.linalg.matrix_rank(a))
    if rest > 0 and math.sqrt(float(residual @ residual) / rest) > _NO_FIT:
        found.append("no clearances explain all plays: mechanism, crank angles or pushes do not fit")
    return found
