"""Possible explanations of a change of the torque's signature: a clearance, or other causes."""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import (
    SURE_LOG_ODDS,
    SURE_SIGMAS,
    Cause,
    Change,
    NamedCause,
)
from leg_wear_monitor.estimate.signature import Changes, SignatureModel
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# relative error of a clearance's effect for each doubling of the clearance, one at least, and of an opening:
# legs with masses 4 % off show 10 to 27 % less (2026-11-23); single joints in full coordinates leave 0.25 to
# 0.35 of the effect at 1 mm, 0.3 to 0.9 at 2 mm
MODEL_ERROR = 0.2
# relative error of two openings, over the geometric mean of their effects: the effects do not add up, because
# impacts of one joint relieve another joint. 30 pairs of 0.4 to 0.6 mm in full coordinates leave 0.4 to 1.0
# of the sum
_TOGETHER = 0.6

# error of a change's shape in the model, over its root mean square in units of the scatter of gait cycles:
# 0.27 to 0.6 where masses are 4 % off, 0.05 to 0.18 where they were identified (2026-11-26). Names are sure
# only of an identified leg; sizes are estimated of others as well
MODEL_NOISE, _NOISE_OF_NAMES = 0.3, 0.1

_APART = 2.0  # standard deviations within which likely sizes scatter about the best size
_SIZES = 24  # clearances of a joint that are tried; between them a parabola finds the best
_LEAST_FACTOR = 0.7  # least size over the modelled clearance
# factors that are tried, on the mass of a body and on the friction in the joints
_FACTORS = {Cause.MASS: np.geomspace(0.4, 2.0, 16), Cause.JOINT_FRICTION: np.geomspace(0.25, 4.0, 16)}
_CORNER = 1.0e200
# a different sensor has to leave less than this fraction of the mean square: the residual of a delay that is
# 2.5 ms off, a step of the search
_LEFT = 0.5
# The search for two open joints tries six sizes of each joint, then five about the best ones. A smaller
# opening may be an error of the model.
_LEAST_OPENING, _PAIR_SIZES, _PAIR_FINER = 1.0 + MODEL_ERROR, 6, 5
# largest mean square that noise alone explains: up to 1.4 for a healthy leg, also with a real motor's
# stick-slip. If two joints had opened, which no single joint explains, noise would explain most of it
# (2026-11-27)
_NOISE_ALONE = 2.0

# Mean square up to which a joint is sure by itself: right names have 0.6 to 1.9. Else it must be far better
# than the next cause: masses of 1 to 2.5 kg on a healthy leg looked like a joint with odds of e^91 at most.
_SURE_SQUARE, _SURE_BY = 2.0, 100.0
_ANYTHING_ELSE = "something else"

# An explanation does not explain if it leaves a larger mean square than this (docs/explanation/diagnosis.md),
# and more than this fraction of the mean square without it: a large opening is known less precisely.
POOREST, _PART = 4.0, 0.3
# values that linear columns can show and a leg can have
_POSSIBLE = {
    Cause.MASS: (-0.9, 0.95),  # not at the end of the tried factors, where a larger clearance may stay hidden
    Cause.LENGTH: (-0.1, 0.1),
    Cause.SCALE: (0.2, 2.0),
    Cause.TIMING: (-0.1, 0.1),
    Cause.LOAD_FRICTION: (-0.5, 0.5),
}
_COUNTED = {Cause.SCALE: 1.0}  # value of a leg as modelled; 0 for others


@attrs.frozen(eq=False)
class Nuisance:
    """A quantity other than a clearance that changes signatures.

    Attributes
    ----------
    cause : Cause
    subject : str
        The body, for a mass.
    column : (F,) array
        Change of the signature by a unit of the quantity.
    spread : float
        Standard deviation of its changes in a leg that is all right; 0 for a quantity that does not change by
        itself.
    """

    cause: Cause
    subject: str
    column: Floats
    spread: float


@attrs.frozen(eq=False)
class OtherSensor:
    """A torque sensor with a different delay, low-pass or noise.

    Attributes
    ----------
    cause : NamedCause
        Time by which slow changes of the torque are later than with the sensor in force, or the noise; the
        standard deviations are half of the step between the sensors that are tried.
    counted : float
        Value of the sensor in force.
    column : (F,) array
        Change of the signature.
    scatter : (F,) array
        Variance of a gait cycle's signature in addition.
    """

    cause: NamedCause
    counted: float
    column: Floats
    scatter: Floats


@attrs.frozen(eq=False)
class LeftOut:
    """Some commissioned gait cycles, compared with the other cycles.

    Attributes
    ----------
    covariance : (F, F) array
        Of a gait cycle, by the others.
    departures : (n, F) array
        From the mean of the others.
    others : int
        Their number.
    """

    covariance: Floats
    departures: Floats
    others: int


@attrs.frozen(eq=False)
class Baseline:
    """Difference between measured signatures and the model's signatures in a leg as modelled.

    Attributes
    ----------
    offset : (F,) array
        Mean difference in the commissioned leg; zeros before commissioning.
    covariance : (F, F) array
        Uncertainty of the offset.
    left_out : tuple of LeftOut
        Parts of the commissioned leg's gait cycles; none before.
    """

    offset: Floats
    covariance: Floats
    left_out: tuple[LeftOut, ...] = ()


@attrs.frozen(kw_only=True)
class Explanation(NamedCause):
    """A cause that explains a change, and how well.

    Attributes
    ----------
    counted : float
        As in `Change`.
    misfit : float
        Minus twice the logarithm of its likelihood, less a constant.
    square : float
        Mean square of its residual, in units of the covariance: about 1 if the cause is right.
    is_least : bool
        True if one of several joints is as little open as the search tries: an error of the model may explain
        as well.
    """

    counted: float
    misfit: float
    square: float
    is_least: bool = False

    def explains(self, without: float) -> bool:
        """True if a leg can have this cause and it explains the measured signature.

        Parameters
        ----------
        without : float
            `square` without any cause.
        """
        low, high = _POSSIBLE.get(self.cause, (-math.inf, math.inf))
        poorest = _NOISE_ALONE if self.cause is Cause.NOISE else max(POOREST, _PART * without)
        return self.square <= poorest and low <= self.value <= high


class _Seen(NamedTuple):
    """A mean signature (F,) of some cycles, and its expectation in a leg as modelled.

    Attributes
    ----------
    scatter : float
        Variance of the expectation, as a part of a gait cycle's variance; added to the covariance (F, F).
    """

    mean: Floats
    cycles: int
    expected: Floats
    covariance: Floats
    scatter: float

    @property
    def rest(self) -> Floats:
        """Residual (F,) of a leg as modelled."""
        return self.mean - self.expected

    @property
    def as_modelled(self) -> "Misfits":
        """How well a leg as modelled explains the signature."""
        return Misfits(self.rest[None], self.covariance)


class _Quantity(NamedTuple):
    """A quantity whose changes were simulated, with its modelled value."""

    cause: Cause
    subject: str
    changes: Changes
    number: int
    counted: float


class Explainer:
    """Compares causes of a change.

    Parameters
    ----------
    model : SignatureModel
    joints : sequence of str
    baseline : Baseline
    nuisances : sequence of Nuisance
    sensors : sequence of OtherSensor, optional
    fresh_m : (k,) array, optional
        Clearances of new parts, the least that a joint can have; by default the expected leg's.
    """

    def __init__(
        self,
        model: SignatureModel,
        joints: Sequence[str],
        baseline: Baseline,
        nuisances: Sequence[Nuisance],
        sensors: Sequence[OtherSensor] = (),
        fresh_m: Floats | None = None,
    ) -> None:
        self.model, self.joints, self.baseline = model, tuple(joints), baseline
        self.nuisances = tuple(nuisances)
        self.bodies = tuple(one.subject for one in nuisances if one.cause is Cause.MASS)
        self.sensors = tuple(sensors)
        self.fresh_m = model.joints.grid[:, 0] if fresh_m is None else fresh_m
        usual = (one.spread**2 * np.outer(one.column, one.column) for one in nuisances)
        self._constant = sum(usual, baseline.covariance)  # errors that averaging over cycles does not reduce
        # combinations of a signature's entries that are independent under both covariances: variances of 1 in
        # a gait cycle, and these variances in the constant part
        apart = np.linalg.inv(np.linalg.cholesky(model.covariance))
        self._stays, axes = np.linalg.eigh(apart @ self._constant @ apart.T)
        self._apart = axes.T @ apart
        self._log_size = -2.0 * float(np.linalg.slogdet(apart)[1])

    def covariance(self, cycles: int) -> Floats:
        """Covariance (F, F) of the mean of some cycles' signatures in a leg as modelled."""
        return np.asarray(self.model.covariance / cycles + self._constant)

    def error(self, change: Floats, noise: float = MODEL_NOISE) -> Floats:
        """Variance (n,) of the model's error for changes (n, F), as a part of a gait cycle's variance."""
        return np.asarray(noise**2 * np.square(self._apart @ change.T).mean(axis=0))

    def whitening(self, cycles: int, scatter: float) -> tuple[Floats, float]:
        """Matrix (F, F) that makes the mean of some cycles' signatures independent with variances of 1.

        ``scatter``: further variance, as a part of a gait cycle's variance. Also the logarithm of the
        determinant of the covariance.
        """
        variance = np.maximum(self._stays, 0.0) + 1.0 / cycles + scatter
        return self._apart / np.sqrt(variance)[:, None], self._log_size + float(np.log(variance).sum())

    def explanations(self, mean: Floats, cycles: int, modelled_m: Floats) -> list[Explanation]:
        """Single causes of a change, the best first.

        Parameters
        ----------
        mean : (F,) array
            Mean signature of the cycles since the change.
        cycles : int
        modelled_m : (k,) array
            Modelled clearances.
        """
        model = self.model
        expected, scatter = self.baseline.offset + model.at(modelled_m)[0], model.scatter_at(modelled_m)
        seen = _Seen(mean, cycles, expected, self.covariance(cycles), scatter)
        nothing = seen.as_modelled.explanation(0, NamedCause(Cause.UNKNOWN, 0.0, 0.0))
        found = [nothing]
        found += self._others(seen)
        found += self._of_sensor(seen)
        for k, counted in enumerate(modelled_m.tolist()):
            one = _Quantity(Cause.CLEARANCE, self.joints[k], model.joints, k, counted)
            least, widest = min(counted, self.fresh_m[k]), max(model.joints.grid[k, -1], counted)
            found.append(self._best(seen, one, np.geomspace(_LEAST_FACTOR * least, widest, _SIZES)))
        bodies, friction = range(len(model.masses.grid)), range(len(model.friction.grid))
        factors = [_Quantity(Cause.MASS, self.bodies[i], model.masses, i, 1.0) for i in bodies]
        factors += [_Quantity(Cause.JOINT_FRICTION, "", model.friction, i, 1.0) for i in friction]
        for one in factors:
            found += _changed_by(self._best(seen, one, _FACTORS[one.cause]), nothing.square)
        # without a baseline, a second opening would mostly explain the errors of the model
        if self.baseline.offset.any():
            pairs = itertools.combinations(range(len(modelled_m)), 2)
            found += [self._pair(seen, np.array(pair), modelled_m) for pair in pairs]
        return sorted(found, key=lambda one: one.misfit)

    def _pair(self, seen: _Seen, pair: Ints, modelled_m: Floats) -> Explanation:
        """Best explanation by two open joints."""
        counted_m = modelled_m[pair]
        least_m = _LEAST_OPENING * counted_m
        widest_m = np.maximum(self.model.joints.grid[pair, -1], least_m)
        tried = [np.geomspace(*ends, _PAIR_SIZES) for ends in zip(least_m, widest_m, strict=True)]
        for _ in range(2):
            sizes = np.stack(np.meshgrid(*tried), axis=-1).reshape(-1, 2)
            misfits = self._misfits(seen, self.model.joints, pair, sizes, counted_m)
            best, step = int(misfits.value.argmin()), (widest_m / least_m) ** (1.0 / (_PAIR_SIZES - 1))
            finer = step[:, None] ** np.linspace(-0.7, 0.7, _PAIR_FINER)
            tried = list(np.maximum(sizes[best][:, None] * finer, least_m[:, None]))
        square = float(misfits.square[best]) / len(seen.mean)
        likely = np.exp(-0.5 * (misfits.value - misfits.value[best]) / max(1.0, square))
        mean_m = likely @ sizes / likely.sum()
        own_m = np.sqrt(likely @ np.square(sizes - mean_m) / likely.sum())
        sigma_m = np.hypot(own_m, MODEL_ERROR * (mean_m - counted_m))
        names = [self.joints[k] for k in pair.tolist()]
        each = zip(mean_m.tolist(), sigma_m.tolist(), names, strict=True)
        joints = tuple(NamedCause(Cause.CLEARANCE, *one) for one in each)
        widest = max(joints, key=lambda one: one.value)
        return Explanation(
            cause=Cause.SEVERAL,
            subject=" and ".join(names),
            value=widest.value,
            sigma=widest.sigma,
            joints=joints,
            counted=float(modelled_m[self.joints.index(widest.subject)]),
            misfit=float(misfits.value[best]) + 2.0 * SURE_LOG_ODDS,  # the odds of a further cause
            square=square,
            is_least=bool((sizes[best] <= least_m).any()),
        )

    def _of_sensor(self, seen: _Seen) -> list[Explanation]:
        """The best of the other sensors; none where none explains.

        A sensor that changes much has a large error in each phase, and could seem to explain anything: it has
        to explain without that error.
        """
        if not self.sensors:
            return []
        change = np.array([one.column for one in self.sensors])
        scatter = np.array([one.scatter for one in self.sensors]) / seen.cycles
        own = seen.covariance + _diagonal(np.sqrt(scatter))
        possible = Misfits(seen.rest - change, own).square < _LEFT * seen.as_modelled.square
        if not possible.any():
            return []
        misfits = Misfits(seen.rest - change, own + _diagonal(MODEL_ERROR * change))
        best = int(np.where(possible, misfits.value, np.inf).argmin())
        return [misfits.explanation(best, self.sensors[best].cause, self.sensors[best].counted)]

    def _best(self, seen: _Seen, one: _Quantity, values: Floats) -> Explanation:
        """Best of some values (n,) of a quantity, all else as modelled."""
        which, counted = np.array([one.number]), np.array([one.counted])
        misfits = self._misfits(seen, one.changes, which, values[:, None], counted).value
        best = int(misfits.argmin())
        log_value, sigma = _vertex(np.log(values), misfits, best)
        value = float(np.exp(log_value))
        there = self._misfits(seen, one.changes, which, np.array([[value]]), counted)
        square = float(there.square[0]) / len(seen.mean)
        poor = max(1.0, square)  # the square of Birge's ratio
        # values far from the best one may fit almost as well: then the mean of all. Where none fits, the
        # model is off by as much in neighbouring phases, which then are few independent numbers
        likely = np.exp(-0.5 * (misfits - misfits[best]) / (poor * max(1.0, square / POOREST) ** 2))
        mean, own = float((likely @ values) / likely.sum()), math.sqrt(poor) * value * sigma
        apart = float(np.sqrt((likely @ np.square(values - mean)) / likely.sum()))
        if apart > _APART * own:
            value, own = mean, apart
        return Explanation(
            cause=one.cause,
            subject=one.subject,
            value=value,
            sigma=float(np.hypot(own, MODEL_ERROR * (value - one.counted))),
            counted=one.counted,
            misfit=float(misfits[best]),
            square=square,
        )

    def _misfits(
        self, seen: _Seen, changes: Changes, which: Ints, values: Floats, counted: Floats
    ) -> "Misfits":
        """Quality of the explanation by values (n, q) of one or two quantities (q,), all else as modelled."""
        tried, of = np.vstack([values, counted]), np.tile(which, len(values) + 1)
        at = changes.at(tried.ravel(), of)[0].reshape(*tried.shape, -1)
        variance = changes.scatter_at(tried.ravel(), of).reshape(tried.shape).sum(axis=1)
        change, scatter = at[:-1] - at[-1], seen.scatter + variance[:-1] - variance[-1]
        near, relative = _nearby(change), _relative_error(values, counted)
        error = np.square(relative[:, :, None] * near).sum(axis=1)
        if len(which) > 1:
            error += _TOGETHER**2 * near.prod(axis=1)
        # the shape is as uncertain as the size: otherwise a wide second opening explains where one is wrong
        shape = self.error(change.reshape(-1, change.shape[-1]), _NOISE_OF_NAMES).reshape(relative.shape)
        scatter = scatter + (shape * np.square(relative / MODEL_ERROR)).sum(axis=1)
        together = change.sum(axis=1)
        own = seen.covariance + scatter[:, None, None] * self.model.covariance
        return Misfits(seen.rest - together, own + _diagonal(np.sqrt(error)))

    def _others(self, seen: _Seen) -> list[Explanation]:
        """Best values of the nuisances, each with the spread by which it is most probable.

        A value within the usual spread is no more probable than a leg as modelled, which has this spread as
        well. Masses whose changes were simulated are left out: the ideal torque is only a part of their
        effect.
        """
        rest, covariance, has_masses = seen.rest, seen.covariance, len(self.model.masses.grid) > 0
        nuisances = [one for one in self.nuisances if not (has_masses and one.cause is Cause.MASS)]
        columns = np.array([one.column for one in nuisances]).reshape(-1, len(rest))
        spread = np.array([one.spread for one in nuisances])
        weighted = np.linalg.solve(covariance, columns.T).T
        information = (weighted * columns).sum(axis=1)
        values = weighted @ rest / information
        # Sherman-Morrison formula: removes the part of the nuisance itself from the covariance
        sigmas = np.sqrt(1.0 / information - spread**2)
        more = np.sqrt(np.maximum(0.0, values**2 - sigmas**2 - spread**2))[:, None] * columns
        error = _diagonal(MODEL_ERROR * values[:, None] * columns)
        misfits = Misfits(np.broadcast_to(rest, columns.shape), covariance + error, more)
        found = []
        for i, one in enumerate(nuisances):
            counted = _COUNTED.get(one.cause, 0.0)
            cause = NamedCause(one.cause, counted + values[i].item(), sigmas[i].item(), one.subject)
            found.append(misfits.explanation(i, cause, counted))
        return found


class Misfits:
    """How well normal distributions explain the residuals of several causes.

    Parameters
    ----------
    rest : (n, F) array
        Residuals.
    covariance : (F, F) or (n, F, F) array
    more : (n, F) array, optional
        Columns whose outer products belong to the covariance as well.

    Attributes
    ----------
    square : (n,) array
        Squares of the residuals, in units of their covariance: about F each if the cause is right.
    value : (n,) array
        Minus twice the logarithms of the densities, less a constant.
    """

    def __init__(self, rest: Floats, covariance: Floats, more: Floats | None = None) -> None:
        n, size = rest.shape
        bordered = np.zeros((n, size + 1, size + 1))
        bordered[:, :size, :size] = covariance
        if more is not None:
            bordered[:, :size, :size] += more[:, :, None] * more[:, None, :]
        diagonal = np.arange(size)
        # a further row of L is the solution of L z = rest; the corner, of no meaning, only has to be large
        bordered[:, size, :size], bordered[:, size, size] = rest, _CORNER
        root = np.linalg.cholesky(bordered)
        self.square = np.square(root[:, size, :size]).sum(axis=1)
        self.value = self.square + 2.0 * np.log(root[:, diagonal, diagonal]).sum(axis=1)
        self._size = size

    def explanation(self, i: int, one: NamedCause, counted: float = 0.0) -> Explanation:
        """Quality of the explanation by each cause (i,)."""
        return Explanation(
            **attrs.asdict(one, recurse=False),
            counted=counted,
            misfit=float(self.value[i]),
            square=float(self.square[i]) / self._size,
        )


def _diagonal(sigma: Floats) -> Floats:
    """Covariances (n, F, F) of independent errors with standard deviations (n, F)."""
    return np.asarray(np.eye(sigma.shape[1]) * np.square(sigma)[:, :, None])


def _relative_error(values: Floats, counted: Floats) -> Floats:
    """Relative errors of the changes from modelled values to others."""
    return np.asarray(MODEL_ERROR * np.maximum(1.0, np.abs(np.log2(values / counted))))


def _nearby(change: Floats) -> Floats:
    """Root mean squares of changes (..., F) over each phase and its two neighbours.

    Impacts of a leg that differs from the simulated leg come a bit earlier or later. A phase that has none
    here may have one there: G at 2 mm, where impacts move most, left 17 to 36, and now 7 to 9 (2026-11-27).
    """
    square = np.square(change).reshape(*change.shape[:-1], 2, -1)  # mean, roughness
    around = square + np.roll(square, 1, axis=-1) + np.roll(square, -1, axis=-1)
    return np.asarray(np.sqrt(around / 3.0).reshape(change.shape))


def opened(clearance_m: Floats, k: int, size: float) -> Floats:
    """Clearances (k,) [m] with one joint's clearance replaced."""
    changed = clearance_m.copy()
    changed[k] = size
    return changed


def _changed_by(factor: Explanation, without: float) -> list[Explanation]:
    """Converts an explanation by a factor to the fraction of a change; none if it explains nothing.

    A factor near 1 gives none, and friction with a large residual gives none either. A knee of 2 mm
    looked like 3.8 times the friction, and was to be watched, where the right cause leaves 0.6 to 2.1; and a
    foot 85 % heavier, which left 10 of 27, made the name of this knee unsure (2026-11-27).
    """
    change = attrs.evolve(factor, value=factor.value - 1.0, counted=0.0)
    is_poor = change.cause is Cause.JOINT_FRICTION and change.square > POOREST
    is_clear = abs(change.value) > SURE_SIGMAS * change.sigma
    return [change] if is_clear and change.explains(without) and not is_poor else []


def _vertex(x: Floats, y: Floats, best: int) -> tuple[float, float]:
    """Place of a parabola's vertex about the least of y, and the standard deviation that its width gives."""
    i = int(np.clip(best, 1, len(x) - 2))
    left, right = (y[i] - y[i - 1]) / (x[i] - x[i - 1]), (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    bend = (right - left) / (0.5 * (x[i + 1] - x[i - 1]))
    if not bend > 0.0:
        return float(x[best]), float(x[i + 1] - x[i - 1])
    place = x[i] - 0.5 * (left + right) / bend
    return float(np.clip(place, x[i - 1], x[i + 1])), float((2.0 / bend) ** 0.5)


def as_modelled(explanations: Sequence[Explanation]) -> Explanation:
    """Among all explanations, the explanation that nothing has changed."""
    return next(one for one in explanations if one.cause is Cause.UNKNOWN)


def change_of(explanations: Sequence[Explanation], since_ns: int) -> Change | None:
    """The change that follows from explanations, the best first; None if the leg may be as modelled.

    One of many causes always explains a bit more than none. If even the best cause explains badly, as for two
    joints that opened at once, it must be better than the next cause by the square of Birge's ratio.
    """
    best = explanations[0]
    nothing = as_modelled(explanations)
    log_odds = 0.5 * (nothing.misfit - best.misfit)
    if log_odds < SURE_LOG_ODDS or not best.explains(nothing.square):
        if nothing.square <= POOREST:
            return None
        return Change(
            cause=Cause.UNKNOWN, since_ns=since_ns, value=0.0, sigma=0.0, counted=0.0, log_odds=log_odds
        )
    second = next(one for one in explanations if _is_rival(one, best))
    runner_up = "as modelled" if second is nothing else f"{second.cause.value} {second.subject}".strip()
    runner_up_log_odds = 0.5 * (second.misfit - best.misfit) / max(1.0, best.square)
    if best.is_least:
        runner_up, runner_up_log_odds = _ANYTHING_ELSE, 0.0
    return Change(
        cause=best.cause,
        subject=best.subject,
        joints=best.joints,
        since_ns=since_ns,
        value=best.value,
        sigma=best.sigma,
        counted=best.counted,
        log_odds=log_odds,
        runner_up=runner_up,
        runner_up_log_odds=runner_up_log_odds,
    )


def _is_rival(one: Explanation, best: Explanation) -> bool:
    """True if an explanation contradicts the best one."""
    return (one.cause.fault_code, one.subject) != (best.cause.fault_code, best.subject)


def with_doubt(change: Change, explanations: Sequence[Explanation]) -> Change:
    """A change of a clearance, not sure where more is left over than an opening of its size leaves.

    However much better it explains than others: the true cause may not be among them, as a mass that changes
    the impacts, too, or several joints at once.
    """
    if change.cause is not Cause.CLEARANCE:
        return change
    if explanations[0].square <= _SURE_SQUARE or change.runner_up_log_odds >= _SURE_BY:
        return change
    return attrs.evolve(change, runner_up=_ANYTHING_ELSE, runner_up_log_odds=0.0)
