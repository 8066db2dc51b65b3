"""Growth of the clearances: measured over gait cycles, its error, and its law over a life."""

import math
import reprlib
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.files import read_json, share_directory
from leg_wear_monitor.life.result import SCHEMA_VERSION
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import GROUND_LOAD, heavier_person, with_toe_force
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import fingerprint
from leg_wear_monitor.twin.reference import MASS_TOLERANCE

# Mean growth over gait cycles: single cycles of a chaotic motion scatter.


GROWTH_CYCLES = 30  # over which the reported growth is averaged
LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # fraction of the mean: beyond it, the mean says nothing

_BATCHES = 5  # batches of six cycles in a window of thirty: longer than the correlation of neighbours
# five means leave four degrees of freedom: Student's t, not a normal distribution. With this factor, a normal
# distribution has the same interval from p10 to p90 as t: 1.533 standard errors, not 1.282
_WIDER = 1.533 / 1.282


@attrs.frozen(eq=False)
class GrowthWindow:
    """The last gait cycles of one joint.

    Attributes
    ----------
    growth_m : (n,) array
        Of the mean clearance in each cycle.
    moving_s : (n,) array
        Time in motion of each.
    """

    growth_m: Floats = attrs.field(factory=lambda: np.zeros(0))
    moving_s: Floats = attrs.field(factory=lambda: np.zeros(0))

    def last(self, cycles: int) -> "GrowthWindow":
        """The last ones of these gait cycles."""
        return GrowthWindow(self.growth_m[-cycles:], self.moving_s[-cycles:])

    def extended(self, growth_m: float, moving_s: float, cycles: int) -> "GrowthWindow":
        """Window of at most so many cycles with one more."""
        return GrowthWindow(np.append(self.growth_m, growth_m), np.append(self.moving_s, moving_s)).last(
            cycles
        )


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, sampling_m : float
        A gait cycle, and the uncertainty of this mean because single cycles scatter.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    sampling_m: float
    per_second_m: float

    def error_m(self, model_error: float) -> float:
        """Uncertainty of a gait cycle's growth in this leg: of the mean, and of the model.

        As of a normal distribution: 80 % lie within 1.28 of it either way.

        Parameters
        ----------
        model_error : float
            Standard deviation of the relative growth (`ModelError`).
        """
        return math.hypot(self.sampling_m, model_error * self.per_cycle_m)


def growth_rate(window: GrowthWindow) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and means add up. Neighbouring cycles of a chaotic
    motion are correlated, so the scatter is computed from the means of batches.
    """
    n = len(window.growth_m)
    if n < LEAST_CYCLES:
        return None
    mean = float(window.growth_m.mean())
    sampling = _WIDER * _standard_error(window.growth_m)
    if not sampling <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, sampling, float(window.growth_m.sum() / window.moving_s.sum()))


def _standard_error(values: Floats) -> float:
    size = len(values) // _BATCHES
    means = values[len(values) - _BATCHES * size :].reshape(_BATCHES, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(_BATCHES))


# Error of the modelled growth of a real leg, because of its masses and its load.
#
# Wear grows with force times sliding. The part from the ideal motion follows from its reactions, and so does
# its sensitivity to each body's mass: this needs no simulation, and a fraction of a second for any mechanism.
# Impacts cause the rest.


# squared sensitivity of the impacts' part: by regression over the joints of sixteen legs as built
# (`benchmarks/growth_coverage.py --quick --legs 16`)
_OF_IMPACTS = 1.6
# effect of a load on the impacts' part of the growth, over its effect on the other part: least squares over
# five joints under 300 and 600 N (docs/appendix/forecast.md, lives under a load of the ground)
_LOAD_OF_IMPACTS = 0.3
_POINTS = 160  # points per gait cycle
_MASS_STEP = 0.01


@attrs.frozen(eq=False)
class ModelError:
    """Error of the modelled growth of each clearance joint.

    Attributes
    ----------
    ideal_m : (k,) array
        Growth per gait cycle from the ideal motion.
    sensitivity : (k,) array
        Sensitivity of its logarithm to the logarithms of all masses, root sum of squares; the person's mass
        is known less well.
    load : (k,) array
        Change of its logarithm by the standard deviation of the load's size.
    """

    ideal_m: Floats
    sensitivity: Floats
    load: Floats

    def relative(self, k: int, growth_m: float) -> float:
        """Standard deviation of a joint's growth a gait cycle, as a fraction of it.

        Impacts depend on masses, lengths and ripple in a rugged way, not by sensitivities: their fraction of
        the growth adds to the variance in proportion.
        """
        masses = MASS_TOLERANCE * math.sqrt(
            self.sensitivity[k] ** 2 + _OF_IMPACTS * self._impacts(k, growth_m)
        )
        return math.hypot(masses, self.by_load(k, growth_m))

    def by_load(self, k: int, growth_m: float) -> float:
        """Standard deviation of it by the load alone."""
        return float(self.load[k]) * (1.0 - (1.0 - _LOAD_OF_IMPACTS) * self._impacts(k, growth_m))

    def _impacts(self, k: int, growth_m: float) -> float:
        """Fraction of a joint's growth that impacts make."""
        return min(1.0, abs(1.0 - self.ideal_m[k] / growth_m)) if growth_m > 0.0 else 0.0


def model_error(
    mechanism: Mechanism, speed_radps: float, wear_acceleration: float = 1.0, load_sigma: float = 0.0
) -> ModelError:
    """Model error of a leg on paper.

    Parameters
    ----------
    mechanism : Mechanism
        The masses of its bodies are independent of each other, and inertias follow them.
    speed_radps : float
        Of its crank.
    wear_acceleration : float
        Factor on all wear.
    load_sigma : float
        Standard deviation of the size of the ground's force on its toe, as a fraction of it.
    """
    sliding = _force_times_sliding(mechanism, speed_radps)
    square = np.zeros_like(sliding)
    for name, body in mechanism.bodies.items():
        factor = 1.0 + _MASS_STEP
        heavier = attrs.evolve(body, mass=factor * body.mass, inertia=factor * body.inertia)
        changed = attrs.evolve(mechanism, bodies={**mechanism.bodies, name: heavier})
        square += np.square((_force_times_sliding(changed, speed_radps) - sliding) / _MASS_STEP)
    if mechanism.person_kg:
        more = _force_times_sliding(heavier_person(mechanism), speed_radps) - sliding
        square += np.square(more / MASS_TOLERANCE)
    load = np.zeros_like(sliding)
    if load_sigma:
        force = (1.0 + load_sigma) * np.array(mechanism.loads[GROUND_LOAD].force)
        load = np.abs(_force_times_sliding(with_toe_force(mechanism, force), speed_radps) - sliding)
    # a joint without load in the ideal leg: impacts cause all of its growth
    sensitivity, load = (
        np.divide(change, sliding, out=np.zeros_like(sliding), where=sliding > 0.0)
        for change in (np.sqrt(square), load)
    )
    parts = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    # Archard's law, spread over the contact's area: both surfaces open the clearance (wear.py)
    per_joule = [sum(part.wear_coefficient) / (TURN * part.bushing_radius * part.width) for part in parts]
    return ModelError(wear_acceleration * np.array(per_joule) * sliding, sensitivity, load)


def _force_times_sliding(mechanism: Mechanism, speed_radps: float) -> Floats:
    """Force times sliding distance [J] over a gait cycle in each clearance joint, all joints ideal (k,)."""
    motion = one_cycle(build_linkage(mechanism), _POINTS, speed_radps)
    names, joints, found = body_names(mechanism), list(mechanism.joints), []
    for name in mechanism.clearance_joints:
        bushing, journal = (names.index(body) for body in mechanism.sides(name))
        turning = np.abs(motion.v[:, journal, 2] - motion.v[:, bushing, 2])
        force = np.linalg.norm(motion.joint_force[:, joints.index(name)], axis=1)
        radius = mechanism.clearances[name].bushing_radius
        found.append(radius * (force * turning).mean() * TURN / abs(speed_radps))
    return np.array(found)


# How the growth of each joint's clearance depends on all joints' clearances, fitted to simulated lives.
#
#     ln(growth_k / x_k) = a_k + sum over j of B_kj ln(c_j / c_j0)
#
# with x_k the factor on joint k's wear coefficient, c_j the mean clearances and c_j0 the clearances when new:
# a power law. The deviation of lives from a law that does not know them is its sigma.


PRIOR_SIGMA = 1.0  # prior of B: growth may double or halve if a clearance doubles
_SCATTER = 0.1  # scatter of ln growth, which weighs the prior against the lives
LEAST_LIVES = 4  # lives with different coefficients, for an error of the law
_STEPS = 12  # steps from new to the limit


@attrs.frozen(eq=False)
class SimulatedLife:
    """A life as the law needs it; p points, k joints.

    Attributes
    ----------
    factor : (k,) array
        On the joints' wear coefficients.
    cycles : (p,) array
    clearance_m, growth_m_per_cycle : (p, k) arrays
    """

    factor: Floats
    cycles: Floats
    clearance_m: Floats
    growth_m_per_cycle: Floats


@attrs.frozen(eq=False)
class GrowthLaw:
    """Growth of each joint as a function of all clearances, relative to that at `fresh_m`.

    Attributes
    ----------
    coupling : (k, k) array
        B: of ln growth of the row's joint over ln clearance of the column's.
    fresh_m, widest_m : (k,) arrays
        Clearances when new, and the largest of the fitted lives: a clearance outside counts as the nearest.
    sigma : (k,) array
        Standard deviation of the error of ln growth, up to `widest_m`.
    lives : int
        Number of simulated lives that it was fitted to.
    """

    coupling: Floats
    fresh_m: Floats
    widest_m: Floats
    sigma: Floats
    lives: int = 0

    def log_growth(self, clearance_m: Floats) -> Floats:
        """Logarithm of growth (k, n) at clearances (k, n) over that at `fresh_m`: without a_k."""
        in_range = np.clip(clearance_m, self.fresh_m[:, None], self.widest_m[:, None])
        return np.asarray(self.coupling @ np.log(in_range / self.fresh_m[:, None]))

    def sigma_to(self, limit_m: Floats, unknown: float) -> Floats:
        """Standard deviation (k,) of the error of ln growth on the way to limits (k,).

        Beyond `widest_m` growth is assumed constant, as it is everywhere without lives. That is off by
        ``unknown`` (`forecast.model_sigma`) from new to the limit; its variance counts by the part of this
        way, in ln clearance, that no life has gone.
        """
        way = np.log(limit_m / self.fresh_m, where=limit_m > self.widest_m, out=np.ones_like(limit_m))
        part = np.log(limit_m / np.minimum(self.widest_m, limit_m)) / way
        return np.asarray(np.hypot(self.sigma, part * np.sqrt(np.maximum(unknown**2 - self.sigma**2, 0.0))))


def no_law(fresh_m: Floats, sigma: float) -> GrowthLaw:
    """Constant growth, with a standard deviation of its logarithm."""
    k = len(fresh_m)
    return GrowthLaw(np.zeros((k, k)), fresh_m, np.full(k, np.inf), np.full(k, sigma))


def fitted_law(lives: Sequence[SimulatedLife], sigma: float) -> GrowthLaw:
    """The law of simulated lives that all begin with the same clearances.

    Parameters
    ----------
    lives : sequence of SimulatedLife
    sigma : float
        Standard deviation of ln growth where there are too few lives to estimate it.
    """
    fresh = lives[0].clearance_m[0]
    coupling, _ = _coefficients(lives, fresh)
    widest = np.max([life.clearance_m.max(axis=0) for life in lives], axis=0)
    return GrowthLaw(coupling, fresh, widest, _sigma(lives, sigma), len(lives))


def _sigma(lives: Sequence[SimulatedLife], unknown: float) -> Floats:
    """Deviation of lives from the law per joint; ``unknown`` with too few lives or no opening."""
    if len(lives) < LEAST_LIVES:
        return np.full(len(lives[0].factor), unknown)
    off = left_over(lives)
    is_known = np.isfinite(off)
    square = np.square(off, where=is_known, out=np.zeros_like(off)).sum(axis=0)
    return np.where(is_known.any(axis=0), np.sqrt(square / np.maximum(is_known.sum(axis=0), 1)), unknown)


def left_over(lives: Sequence[SimulatedLife]) -> Floats:
    """Logarithm (n, k) of the cycles each life took to its end, over those by the law of all the others.

    NaN where a joint has not opened.
    """
    fresh, off = lives[0].clearance_m[0], []
    for i, life in enumerate(lives):
        coupling, level = _coefficients([*lives[:i], *lives[i + 1 :]], fresh)
        law = GrowthLaw(coupling, fresh, np.full(len(fresh), np.inf), np.zeros(len(fresh)))
        base = life.factor * np.exp(level)
        expected = cycles_to(law, fresh[:, None], base[:, None], life.clearance_m[-1])
        opened = np.isfinite(expected[:, 0]) & (expected[:, 0] > 0.0)
        off.append(np.log(np.where(opened, life.cycles[-1] / np.where(opened, expected[:, 0], 1.0), np.nan)))
    return np.array(off)


def _coefficients(lives: Sequence[SimulatedLife], fresh_m: Floats) -> tuple[Floats, Floats]:
    """B (k, k) and a (k,), of ridge regression."""
    x = np.log(np.concatenate([life.clearance_m for life in lives]) / fresh_m)
    growth = np.concatenate([life.growth_m_per_cycle / life.factor for life in lives])
    prior = (_SCATTER / PRIOR_SIGMA) ** 2 * np.eye(x.shape[1])
    coupling, level = np.zeros((x.shape[1],) * 2), np.zeros(x.shape[1])
    for k in range(x.shape[1]):
        grows = growth[:, k] > 0.0
        if not grows.any():
            level[k] = -np.inf
            continue
        y, own = np.log(growth[grows, k]), x[grows]
        centred = own - own.mean(axis=0)
        coupling[k] = np.linalg.solve(centred.T @ centred + prior, centred.T @ (y - y.mean()))
        level[k] = y.mean() - own.mean(axis=0) @ coupling[k]
    return coupling, level


def cycles_to(law: GrowthLaw, clearance_m: Floats, base_m: Floats, limit_m: Floats) -> Floats:
    """Gait cycles until each joint reaches its limit, all joints growing together.

    A joint that is at its limit stays there: its part is replaced before it opens further.

    Parameters
    ----------
    law : GrowthLaw
    clearance_m : (k, n) array
        Of n legs.
    base_m : (k, n) array
        exp(a) x: growth a cycle when all is new.
    limit_m : (k,) array

    Returns
    -------
    (k, n) array
        Infinite where a clearance does not grow; 0 where it is at its limit.
    """
    limit = limit_m[:, None]
    step = np.maximum(limit - law.fresh_m[:, None], 1.0e-3 * limit) / _STEPS
    clearance = np.minimum(clearance_m, limit)
    ends = np.where(clearance_m >= limit, 0.0, np.inf)
    going, spent = (clearance_m < limit) & (base_m > 0.0), np.zeros(clearance_m.shape[1])
    base = np.where(going, base_m, 0.0)
    while going.any():
        # Heun's method; the joint that goes fastest says how far
        first = base * np.exp(law.log_growth(clearance))
        fastest = (first / step).max(axis=0)
        cycles = np.divide(1.0, fastest, out=np.zeros_like(fastest), where=fastest > 0.0)
        ahead = np.minimum(clearance + cycles * first, limit)
        growth = 0.5 * (first + base * np.exp(law.log_growth(ahead)))
        opened = clearance + cycles * growth
        reached = going & (opened >= limit)
        within = np.divide(limit - clearance, growth, out=np.zeros_like(growth), where=reached)
        ends = np.where(reached, spent + within, ends)
        clearance, spent = np.minimum(opened, limit), spent + cycles
        going &= ~reached
        base = np.where(going, base, 0.0)
    return ends


# Lives from files of ``leg-wear-monitor life --json``, each bound to the leg it was simulated for.


def law_of(mechanism: Mechanism, path: str, sigma: float) -> GrowthLaw:
    """Law of growth of a leg.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    path : str
        A file of its lives. If empty, the file of the package for this leg; without such a file, growth is
        assumed constant.
    sigma : float
        Standard deviation of ln growth, if lives do not show it.

    Raises
    ------
    ConfigError
        If the file cannot be read, or describes a different leg.
    """
    lives = read_lives(path, mechanism) if path else _shipped_lives(mechanism)
    if not lives:
        fresh = [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        return no_law(np.array(fresh), sigma)
    return fitted_law(lives, sigma)


def life_doubts(config: MonitorConfig, leg: Mechanism) -> tuple[Doubt, ...]:
    """Simulated lives that end before the limit of a clearance.

    Raises
    ------
    ConfigError
        If the file of lives cannot be used.
    """
    given = config.forecast.growth_law_file
    ends_m = float(law_of(leg, given, config.forecast.model_sigma).widest_m.max(initial=0.0))
    joints = leg.clearance_joints
    limits = dict(zip(joints, config.limits.of_clearances(len(joints))[1], strict=True))
    joint = max(joints, key=lambda name: limits[name])
    if limits[joint] <= ends_m:
        return ()
    lives = f"the lives of {given}" if given else "the lives of this leg that come with the package"
    text = (
        f"{lives} end at {1e3 * ends_m:.3g} mm, below the limit of joint {joint}, "
        f"{1e3 * limits[joint]:g} mm; beyond, the forecast assumes constant growth. Expected lives from "
        f"`leg-wear-monitor life --limit-m {limits[joint]:g}`"
    )
    return (Doubt("forecast.growth_law_file", text),)


def read_lives(path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives of a leg from their file, its joints in the mechanism's order.

    Raises
    ------
    ConfigError
        If the file cannot be read, or describes a different leg.
    """
    document = _document(path)
    own = fingerprint(mechanism)
    if document.get("fingerprint") != own:
        raise ConfigError(
            path,
            "fingerprint",
            f"{document.get('fingerprint')!r} belongs to a different leg than this one, {own!r} (bodies, "
            f"joints, or "
            "clearances when new); simulate its lives again with `leg-wear-monitor life --json`",
        )
    return _lives_in(document, path, mechanism)


def _shipped_lives(mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives that come with the package for just this leg; none if there are none."""
    own = fingerprint(mechanism)
    for file in sorted((share_directory() / "config" / "lives").glob("*.json")):
        document = _document(str(file))
        if document.get("fingerprint") == own:
            return _lives_in(document, str(file), mechanism)
    return ()


def _lives_in(document: dict[str, Any], path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    try:
        return [_life(each, mechanism.clearance_joints) for each in (document, *document["further"])]
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        joints = ", ".join(mechanism.clearance_joints)
        raise ConfigError(
            path, "", f"is not a life of the joints {joints}. Expected the output of `life --json`"
        ) from error


def _document(path: str) -> dict[str, Any]:
    document = read_json(path)
    if not isinstance(document, dict):
        raise ConfigError(path, "", "is not a life. Expected the output of `life --json`")
    version = document.get("schema_version", 1)
    if version != SCHEMA_VERSION:
        fault = f"{reprlib.repr(version)} is not {SCHEMA_VERSION}, the version that this program reads"
        raise ConfigError(path, "schema_version", f"{fault}; simulate the lives again")
    return document


def _life(record: dict[str, Any], clearance_joints: Sequence[str]) -> SimulatedLife:
    def columns(name: str) -> Floats:
        return np.array([record["joints"][joint][name] for joint in clearance_joints], dtype=float).T

    life = SimulatedLife(
        factor=np.array([record["wear_factor"][joint] for joint in clearance_joints], dtype=float),
        cycles=np.array(record["cycles"], dtype=float),
        clearance_m=columns("clearance_m"),
        growth_m_per_cycle=columns("growth_m_per_cycle"),
    )
    shapes = {life.clearance_m.shape, life.growth_m_per_cycle.shape, (len(life.cycles), len(life.factor))}
    if len(shapes) > 1 or len(life.cycles) < 2 or not (life.clearance_m > 0.0).all():
        raise ValueError("values that do not fit together")
    return life
