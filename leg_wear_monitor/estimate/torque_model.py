"""Drive torque with ideal joints at any motion of the crank, and its fit to a measured torque.

The torque is T = S + w D + w^2 H + a J. S, D, H and J are tables over the crank angle, w is the crank's speed
and a its acceleration. The derivatives of the tables by masses and lengths are here as well.
"""

import functools
import math

import attrs
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.joint_motion import Pair
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton, jackknife, solved
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.constraints import applied_forces_at, closures_at
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    build_linkage,
    drive_column,
    gammas,
    jacobians,
    one_cycle,
)
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import load_shape, load_signatures
from leg_wear_monitor.twin.reference import LegParameters

PHASE_ERROR_RAD = 0.02
"""Standard deviation by which clearances of 0.3 mm in five joints shift the torque's phase."""


def at_angles(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (..., n) of periodic tables (..., points) at angles (n,), and their slopes by the angle."""
    points = tables.shape[-1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[..., left]
    step = tables[..., (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)


# Standard deviations of the effects of clearances that are not in the model, of six legs in full coordinates
# behind 18 drives, 30 to 85 rpm: of a factor on the torque, of the constant friction as a fraction of the
# torque's RMS, and of the load friction.
SCALE_ERROR, FRICTION_ERROR, LOAD_FRICTION_ERROR = 0.035, 0.012, 0.025


@attrs.frozen(eq=False)
class TorqueModel:
    """Tables over the crank angle, from 0 in equal steps.

    Attributes
    ----------
    tables : (4, points) array
        Static torque [N m], and by speed [N m s], squared speed [N m s^2], acceleration [kg m^2].
    load : (points,) array
        Torque by a foot load of one newton up [N m/N]; zeros for a mechanism without a toe.
    """

    tables: Floats
    load: Floats

    def torque(self, angle: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Torque [N m] and its derivative by the angle [N m/rad], each (n,)."""
        values, slopes = at_angles(self.tables, angle)
        motion = np.stack([np.ones_like(speed), speed, speed * speed, acceleration])
        return np.asarray((values * motion).sum(axis=0)), np.asarray((slopes * motion).sum(axis=0))

    def load_torque(self, angle: Floats) -> Floats:
        """Torque by a foot load of one newton up (n,) [N m/N]."""
        return np.asarray(at_angles(self.load, angle)[0])


def torque_model(mechanism: Mechanism) -> TorqueModel:
    """Tables of a mechanism.

    Raises
    ------
    AssemblyError
        If the linkage does not close, or the crank does not turn through.
    """
    linkage = build_linkage(mechanism)
    tables = torque_coefficients(linkage, one_cycle(linkage, POINTS, 1.0).q)[0]
    (load,) = load_signatures(linkage, [load_shape(linkage)])
    return TorqueModel(tables, load)


# Coefficients of the torque, and their derivatives with respect to masses and lengths.


_POINTS = 240  # points per gait cycle: three in each of 80 phases
_LONGER = 0.002  # step of the difference by a body's length
_NEWTON_ROUNDS = 4  # rounds of Newton's method: from lengths that are 0.2 % off, the third is at rounding


@attrs.frozen(eq=False)
class BodyTorques:
    """Coefficients of the drive torque at equal steps of the crank angle from 0.

    The torque is their sum, weighted with 1, the crank's speed, its square, and its acceleration.

    Attributes
    ----------
    own : (4, points) array
        Coefficients of the whole leg.
    mass, length : (bodies, 4, points) arrays
        Derivatives with respect to factors on bodies, in the order of the mechanism's file; a mass with its
        inertia.
    """

    own: Floats
    mass: Floats
    length: Floats

    def at(self, speed: float) -> tuple[Floats, Floats]:
        """Derivatives (bodies, points) by masses and by lengths [N m], at a crank speed [rad/s]."""
        return at_speed(self.mass, speed), at_speed(self.length, speed)


def at_speed(coefficients: Floats, speed: float) -> Floats:
    """Torques (..., points) [N m] of coefficients (..., 4, points), at a constant crank speed [rad/s]."""
    return np.asarray(np.array([1.0, speed, speed**2, 0.0]) @ coefficients)


def body_torques(mechanism: Mechanism) -> BodyTorques:
    """Drive torque of a mechanism and its derivatives; computed once for each mechanism."""
    return _computed(_Same(mechanism, id(mechanism)))


@attrs.frozen
class _Same:
    """A mechanism as a cache key: equal for the same object."""

    mechanism: Mechanism = attrs.field(eq=False)
    number: int


@functools.lru_cache(maxsize=2)
def _computed(same: _Same) -> BodyTorques:
    mechanism = same.mechanism
    linkage, whole = build_linkage(mechanism), LegParameters.none(mechanism)
    q = one_cycle(linkage, _POINTS, 1.0).q
    own, mass = torque_coefficients(linkage, q)
    length = []
    for one in np.eye(len(whole.length)):
        longer = build_linkage(attrs.evolve(whole, length=whole.length + _LONGER * one).applied(mechanism))
        length.append((torque_coefficients(longer, _closed(longer, q))[0] - own) / _LONGER)
    return BodyTorques(own, mass, np.array(length))


def _closed(linkage: Linkage, near: Floats) -> Floats:
    """Coordinates q (points, n, 3) that close a linkage at equal steps of the crank angle, near others."""
    q, rows = near.copy(), linkage.rows
    m, n = len(rows.body), q.shape[1]
    phi, still = np.empty((len(q), m)), np.zeros((n, 3))
    cs, blocks, gamma = np.empty((n, 2)), np.zeros((m, 2, 3)), np.empty(m)
    for _ in range(_NEWTON_ROUNDS):
        for i, here in enumerate(q):
            drive = np.array([i * TURN / len(q), 0.0, 0.0])
            closures_at(linkage.arrays, rows, here, still, drive, cs, phi[i], blocks, gamma)
        q[:, 1:] -= np.linalg.solve(jacobians(linkage, q), phi[:, :, None]).reshape(len(q), -1, 3)
    return q


def torque_coefficients(linkage: Linkage, q: Floats) -> tuple[Floats, Floats]:
    """Coefficients (4, points) of the drive torque, and the part of each body's mass (bodies, 4, points).

    The power of the drive is the power of inertia minus the power of all applied forces; v and a are velocity
    and acceleration at unit speed.

    Parameters
    ----------
    linkage : Linkage
    q : (points, n, 3) array
        Coordinates that close the linkage.
    """
    arrays, jacobian = linkage.arrays, jacobians(linkage, q)
    v, a, work = np.zeros_like(q), np.zeros_like(q), np.empty((q.shape[1], 2))
    v[:, 1:] = np.linalg.solve(jacobian, drive_column(linkage)[None, :, None]).reshape(len(q), -1, 3)
    a[:, 1:] = np.linalg.solve(jacobian, gammas(linkage, q, v, 0.0)[:, :, None]).reshape(len(q), -1, 3)
    resting, moving = np.empty_like(q), np.empty_like(q)
    applied_forces_at(arrays, q, np.zeros_like(q), work, resting)
    applied_forces_at(arrays, q, v, work, moving)
    inertia, reduced = (arrays.mass * a * v).sum(axis=2).T, (arrays.mass * v * v).sum(axis=2).T
    weight = (arrays.mass[:, :2] * arrays.gravity * v[:, :, :2]).sum(axis=2).T
    power = np.stack([-resting * v, (resting - moving) * v]).sum(axis=(2, 3))
    mass = np.stack([-weight, np.zeros_like(weight), inertia, reduced], axis=1)
    return np.vstack([power, inertia.sum(axis=0), reduced.sum(axis=0)]), mass[1:]


# Fit of phase, scale, friction and offset of a measured torque to the torque of a leg.


# Start values of a fit.


@attrs.frozen
class Start:
    """Start value of the conversion from joint to crank: ratio * position + offset.

    Attributes
    ----------
    ratio : float
        Turns of the crank per turn of the joint, negative if it turns against it.
    offset_rad : float
        Crank angle at joint position 0.
    torque_sign : int
    explained : float
        Fraction of the torque's variance that the model explains.
    """

    ratio: float
    offset_rad: float
    torque_sign: int
    explained: float


# Means over a twelfth of a turn: impacts of joints with clearance average out, the leg's torque stays.
#
# With 0.3 mm in five joints, single torque samples differ from the ideal leg's by as much as that torque
# itself; such means by a tenth of it or less.


BINS = 48  # bins per turn
# A flight and the impact after it cancel within a twelfth of a turn; with fewer bins or sharp edges, impacts
# at the same angle in every turn would turn up as a slow torque
_WEIGHTS = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]) / 16.0


@attrs.frozen(eq=False)
class Blocks:
    """Runs of samples in an equal part of a turn of the crank.

    Attributes
    ----------
    first : (m,) array of int
        Index of each run's first sample.
    length : (m,) array of int
    kept : (m,) array of bool
        True if a run is long enough to be used.
    part : (m,) array of int
        Part of a turn, counted on over turns.
    """

    first: NDArray[np.int64]
    length: NDArray[np.int64]
    kept: NDArray[np.bool_]
    part: NDArray[np.int64]

    def mean(self, values: Floats) -> Floats:
        """Means (..., kept runs) of values (..., n), low-passed over their neighbours.

        Both sides of an equation are averaged alike, so it does no harm where neighbours are not next to each
        other.
        """
        means = (np.add.reduceat(values, self.first, axis=-1) / self.length)[..., self.kept]
        reach = len(_WEIGHTS) // 2
        ends = [means[..., :1]] * reach, [means[..., -1:]] * reach
        padded = np.concatenate([*ends[0], means, *ends[1]], axis=-1)
        return np.asarray(sliding_window_view(padded, len(_WEIGHTS), axis=-1) @ _WEIGHTS)

    @property
    def bin(self) -> NDArray[np.int64]:
        """Part of the turn of each kept run, from 0 to BINS - 1."""
        return np.asarray(self.part[self.kept] % BINS)

    @property
    def turn(self) -> NDArray[np.int64]:
        """Turn of each kept run, counted from 0."""
        turns = self.part[self.kept] // BINS
        changes = np.abs(np.diff(turns)) > 0
        return np.concatenate([[0], np.cumsum(changes)]) if len(turns) else turns


def blocks_of(pair: Pair, ratio: float) -> Blocks:
    """Blocks of a pair, with the ratio of the crank's angle to the joint's."""
    part = np.floor(ratio * pair.position_rad * (BINS / TURN)).astype(np.int64)
    first = np.concatenate([[0], 1 + np.flatnonzero(np.diff(part) != 0)])
    length = np.diff(np.concatenate([first, [len(part)]]))
    return Blocks(first, length, length >= 0.5 * np.median(length), part[first])


# Regression of measured on predicted torque.


@attrs.frozen
class Terms:
    """Terms of the regression besides gain, friction and offset."""

    ratio: bool = True
    load: bool = False
    load_friction: bool = False

    @property
    def linear(self) -> tuple[str, ...]:
        """Names of the linear terms."""
        further = ("load", "load_friction")
        return ("gain", "friction", *(name for name in further if getattr(self, name)))


def columns(
    pair: Pair, model: TorqueModel, phase: float, ratio: float, terms: Terms, blocks: Blocks
) -> tuple[Floats, Floats]:
    """Columns of the linear terms, and at unit gain of small changes of phase and ratio, by block.

    ``phase``: crank angle at the middle position of the joint.
    """
    turned, speed = pair.position_rad - _middle(pair), ratio * pair.speed_radps
    angle = ratio * turned + phase
    torque, slope = model.torque(angle, speed, ratio * pair.acceleration_radps2)
    linear = [torque, np.sign(speed)]
    if terms.load:
        linear.append(model.load_torque(angle))
    if terms.load_friction:
        linear.append(np.abs(torque) * np.sign(speed))
    moving = [slope, slope * turned] if terms.ratio else [slope]
    return blocks.mean(np.array(linear)), blocks.mean(np.array(moving))


def _middle(pair: Pair) -> float:
    """Position [rad] in the middle of a joint's way: there, ratio and phase do not depend on each other."""
    return float(np.median(pair.position_rad))


# Least squares (Gauss-Newton) of gear ratio, offset, scale, friction and foot load.


_LONGEST_STEP_RAD = 0.2  # largest change of the phase per step: half a radian of the torque's third harmonic
_DONE_RAD = 1.0e-3  # a twentieth of the phase shift that clearances cause
_EXACT_RAD = 1.0e-6
_CHUNKS = 12  # number of time segments, each left out once
_NO_TERMS = Terms()


@attrs.frozen(eq=False)
class Fit:
    """The best fit near a start.

    Attributes
    ----------
    ratio : float
        Turns of the crank per turn of the joint, negative if it turns against it.
    offset_rad : float
        Crank angle at joint position 0, from -pi to pi.
    linear : dict of str to float
        By name: ``gain`` (measured torque per torque on the crank, negative for a negative sign),
        ``friction`` (constant along the motion) in the sensor's unit, ``load`` (``gain`` times the foot load
        [N]).
    sigma : dict of str to float
        Standard deviations of ``ratio``, ``offset_rad`` and the linear terms; empty if not asked for.
    measured, predicted, rest : (m,) arrays
        Torques of the blocks, in the sensor's unit; the prediction is the torque of the leg alone.
    """

    ratio: float
    offset_rad: float
    linear: dict[str, float]
    sigma: dict[str, float]
    measured: Floats
    predicted: Floats
    rest: Floats
    blocks: Blocks
    pair: Pair
    start: Start

    @property
    def gain(self) -> float:
        """Ratio of measured torque to torque on the crank."""
        return self.linear["gain"]

    @property
    def refined(self) -> Start:
        """Start of a further fit."""
        return attrs.evolve(self.start, ratio=self.ratio, offset_rad=self.offset_rad)

    @property
    def mismatch(self) -> float:
        """RMS of the rest as a fraction of the RMS of the measured torque about its mean."""
        return float(np.sqrt(np.mean(self.rest**2)) / self.measured.std())

    @property
    def direction(self) -> int:
        """1 if the joint turns in the direction of the crank angle, else -1."""
        return 1 if self.ratio > 0.0 else -1

    @property
    def torque_sign(self) -> int:
        """1 if a positive torque drives the crank in its positive direction, else -1."""
        return 1 if self.gain > 0.0 else -1

    @property
    def gear_ratio(self) -> float:
        """Turns of the joint per turn of the crank."""
        return 1.0 / abs(self.ratio)

    @property
    def turns(self) -> float:
        """Turns of the crank from the first to the last sample, the longest way round."""
        return abs(self.ratio) * float(np.ptp(self.pair.position_rad)) / TURN

    def crank(self) -> tuple[Floats, Floats, Floats]:
        """Angle, speed and acceleration of the crank when the torque was made, for each sample."""
        pair, ratio = self.pair, self.ratio
        angle = ratio * pair.position_rad + self.offset_rad
        return angle, ratio * pair.speed_radps, ratio * pair.acceleration_radps2


@attrs.frozen(eq=False)
class _Columns(Point):
    """Phase and ratio during the iteration; columns (k, m) and coefficients (k,) of linear terms; motion."""

    x: Floats
    by_linear: Floats
    linear: Floats
    by_motion: Floats


def fit(
    pair: Pair, model: TorqueModel, start: Start, terms: Terms = _NO_TERMS, with_errors: bool = False
) -> Fit:
    """Best fit near a start; standard deviations and last digits only on request, because they take long."""
    blocks = blocks_of(pair, start.ratio)
    measured = blocks.mean(pair.torque)
    middle, sign = _middle(pair), 0.0
    begun = np.array([start.ratio * middle + start.offset_rad, start.ratio])[: 1 + terms.ratio]

    def at(x: Floats) -> _Columns:
        """Motion (k,) with the best linear terms, which go with it, and a gain of the sign at the start."""
        nonlocal sign
        ratio = float(x[1]) if terms.ratio else start.ratio
        by_linear, by_motion = columns(pair, model, float(x[0]), ratio, terms, blocks)
        linear = solved(by_linear.T, measured)
        by_motion *= linear[0]
        sign = sign or float(np.sign(linear[0]))
        return _Columns(
            linear @ by_linear - measured if linear[0] * sign > 0.0 else np.full(len(measured), np.inf),
            lambda: by_motion.T - by_linear.T @ solved(by_linear.T, by_motion.T),
            x,
            by_linear,
            linear,
            by_motion,
        )

    scale = np.array([1.0, 2.0 / float(np.ptp(pair.position_rad))])[: 1 + terms.ratio]
    done = scale * (_EXACT_RAD if with_errors else _DONE_RAD)
    best = gauss_newton(at, begun, longest=scale * _LONGEST_STEP_RAD, done=done).point
    ratio, linear, rest = float(best.x[1]) if terms.ratio else start.ratio, best.linear, -best.rest
    by = np.concatenate([best.by_linear, best.by_motion])
    return Fit(
        ratio=ratio,
        offset_rad=(float(best.x[0]) - ratio * middle + math.pi) % TURN - math.pi,
        linear=dict(zip(terms.linear, linear.tolist(), strict=True)),
        sigma=_errors(by, rest, middle, terms) if with_errors else {},
        measured=measured,
        predicted=linear[0] * best.by_linear[0],
        rest=rest,
        blocks=blocks,
        pair=pair,
        start=start,
    )


def _errors(by: Floats, rest: Floats, middle: float, terms: Terms) -> dict[str, float]:
    """Standard deviations by the names of the parameters."""
    names = (*terms.linear, "offset_rad", *["ratio"] * terms.ratio)
    found = jackknife(lambda some: solved(by[:, some].T, rest[some]), len(rest), _CHUNKS)
    sigma = {"ratio": 0.0} | dict(zip(names, found.tolist(), strict=True))
    sigma["offset_rad"] = math.hypot(sigma["offset_rad"], sigma["ratio"] * abs(middle))
    return sigma


# How much of a torque repeats and does not fit, and whether a rival fits nearly as well.


_WORSE_CHUNKS = 11  # chunks in which a rival has to be worse; if two are alike, in 3 of 1000 recordings
_LEAST_STEP = 0.02  # fraction of the torque's variance
# The best fit's repeating rest is the model's error; a rival nearer than twice its energy may be the truth
_MODEL_ERROR = 2.0


def repeating(one: Fit) -> float:
    """RMS of the rest that repeats from turn to turn, as a fraction of the measured torque's RMS.

    Computed from the product of the means of even and odd turns: the rest that does not repeat averages out.
    """
    even, odd = (_folded(one, one.blocks.turn % 2 == remainder) for remainder in (0, 1))
    both = np.isfinite(even) & np.isfinite(odd)
    energy = float(np.mean(even[both] * odd[both])) if both.any() else 0.0
    return math.sqrt(max(energy, 0.0)) / float(one.measured.std())


def _folded(one: Fit, which: Floats) -> Floats:
    """Means of the residual over some turns, by part of the turn; NaN for parts without samples."""
    bins = one.blocks.bin[which]
    number = np.bincount(bins, minlength=int(one.blocks.bin.max()) + 1)
    total = np.bincount(bins, one.rest[which], minlength=len(number))
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def too_alike(best: Fit, rival: Fit, other_signal: bool = False) -> bool:
    """True if a rival is so close to the best fit that the best fit need not be the truth.

    With another signal, the model errs in the same way for both; else its error may favour the wrong fit.
    """
    steps = _by_time(rival) - _by_time(best)
    error = 0.0 if other_signal else _MODEL_ERROR * repeating(best) ** 2
    is_always_worse = np.count_nonzero(steps > 0.0) >= _WORSE_CHUNKS
    return float(steps.mean()) < max(_LEAST_STEP, error) or not is_always_worse


def _by_time(one: Fit) -> Floats:
    """Energy of the rest in twelve stretches of time, as a fraction of the torque's variance."""
    chunks = np.array_split(one.rest**2, _CHUNKS)
    return np.array([chunk.mean() for chunk in chunks]) / float(one.measured.var())
