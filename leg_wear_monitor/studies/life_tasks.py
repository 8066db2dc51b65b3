"""Tasks over many cycles: ensembles, lives, exponents of Lyapunov, sections of Poincaré."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import clearance_settings
from leg_wear_monitor.dynamics.batch import Leg, prepare_legs
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, Moment, Snapshot
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_tables
from leg_wear_monitor.dynamics.run import DONE, RunStatistics, Setup, new_run_statistics, steady_drive, stop
from leg_wear_monitor.errors import ConfigError, SimulationError
from leg_wear_monitor.life.jumps import JumpControl
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.mechanism.arrays import Flags, Floats
from leg_wear_monitor.mechanism.person import on_the_ground
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.plan import Arrays, Estimate

# Sampling grid of the studies.


SAMPLES = 512  # samples per gait cycle: equal crank steps from angle 0, at whole intervals of the stepper


# A leg sampled at equal crank steps over whole gait cycles, with run statistics.


class ObservedLeg:
    """A leg with constant crank speed, advanced in steps of 1 / `SAMPLES` of a gait cycle.

    Parameters
    ----------
    leg : Leg
    setup : Setup
        Setup of this leg; its surfaces must not be shared with other legs.
    tables : ClearanceTables, optional
        Tables of this setup, to reuse those built before.
    tolerance_m : float, optional
        Integration tolerance of `ClearanceStepper` [m].
    """

    def __init__(
        self,
        leg: Leg,
        setup: Setup,
        tables: ClearanceTables | None = None,
        tolerance_m: float | None = None,
    ) -> None:
        accuracy = {} if tolerance_m is None else {"tolerance_m": tolerance_m}
        self.setup = setup
        self.stepper = ClearanceStepper(setup, tables=tables, **accuracy)
        leg.start(self.stepper)
        self._polynomial = steady_drive(leg.crank_angle_rad, setup.speed)
        self._step = TURN / abs(setup.speed) / SAMPLES

    def advance(self, steps: int, statistics: RunStatistics) -> None:
        """Advance by a number of steps and add to the run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        done = round(self.stepper.time / self._step)
        status, k = self.stepper.advance(self._polynomial, (done + steps) * self._step, statistics)
        if status != DONE:
            raise stop(self.setup, status, k, self.stepper.time)

    def observe(self) -> Moment:
        """The present state of the leg."""
        return self.stepper.observe()

    def moments(self, statistics: RunStatistics) -> Iterator[Moment]:
        """States at every step of the next cycle, from the present one on; adds to the run statistics."""
        for _ in range(SAMPLES):
            yield self.observe()
            self.advance(1, statistics)


# Ensembles: legs with equal parameters that differ in the initial positions of crank and journals.


def with_friction(mechanism: Mechanism, settings: dict[str, Any]) -> Mechanism:
    """The mechanism with the values of a setting ``friction`` in all its clearance joints."""
    changes = settings.get("friction", {})
    clearances = {
        name: attrs.evolve(own, friction=attrs.evolve(own.friction, **changes))
        for name, own in mechanism.clearances.items()
    }
    return attrs.evolve(mechanism, clearances=clearances)


def loaded(mechanism: Mechanism, settings: dict[str, Any]) -> Mechanism:
    """The mechanism under the force of the ground, its vertical peak ``ground_n`` [N] if that is given.

    0 N takes the place of a load of the ground that the mechanism has, too.
    """
    return on_the_ground(mechanism, settings["ground_n"]) if "ground_n" in settings else mechanism


def speed_rpm_of(mechanism: Mechanism, settings: dict[str, Any]) -> float:
    """Crank speed ``speed_rpm`` in the direction of the mechanism's own drive, negative for clockwise."""
    return math.copysign(settings["speed_rpm"], getattr(mechanism.drive, "speed", 1.0))


def start_angles(runs: int, seed: int) -> list[float]:
    """Initial crank angles [rad] of the runs: on the sampling grid, one in each equal part of a turn."""
    chance = np.random.default_rng([seed, 1])
    steps = (SAMPLES * (np.arange(runs) + chance.random(runs)) / runs).astype(int)
    return [float(step) * (TURN / SAMPLES) for step in steps]


def ensemble(mechanism: Mechanism, settings: dict[str, Any]) -> list[Leg]:
    """Legs that differ in their initial positions.

    Parameters
    ----------
    mechanism : Mechanism
    settings : dict
        ``clearance_joints``, ``clearance_m`` [m], ``speed_rpm``, ``runs``, ``seed``, ``perturb_fraction`` (of
        the smallest clearance); optional ``normal_law``, ``friction`` and ``ground_n`` [N].

    Returns
    -------
    list of Leg
        One for each run.
    """
    mechanism = loaded(with_friction(mechanism, settings), settings)
    clearance_joints, clearance_m = settings["clearance_joints"], settings["clearance_m"]
    smallest = min(c.radial_clearance for c in clearance_settings(mechanism, clearance_joints, clearance_m))
    return [
        Leg(
            mechanism=mechanism,
            clearances=clearance_joints,
            clearance_m=clearance_m,
            speed_rpm=speed_rpm_of(mechanism, settings),
            normal_law=settings.get("normal_law"),
            crank_angle_rad=angle,
            perturb_m=settings["perturb_fraction"] * smallest,
            seed=settings["seed"] + member,
        )
        for member, angle in enumerate(start_angles(settings["runs"], settings["seed"]))
    ]


def observed_legs(legs: list[Leg], tolerance_m: float | None = None) -> list[ObservedLeg]:
    """Legs in their initial positions; they share one set of tables.

    Raises
    ------
    AssemblyError
        If the linkage of a leg does not close or has a dead point.
    """
    setups: list[Setup] = []
    for setup in prepare_legs(legs):
        if not isinstance(setup, Setup):
            raise setup
        setups.append(setup)
    tables = build_tables(setups[0].linkage, setups[0].contacts)
    return [ObservedLeg(leg, setup, tables, tolerance_m) for leg, setup in zip(legs, setups, strict=True)]


def check_points(mechanism: Mechanism, settings: list[dict[str, Any]]) -> None:
    """Prepare one leg of every setting, equal ones once, so that errors are reported before any computation.

    Raises
    ------
    ConfigError
        If a setting is invalid or names no joint.
    AssemblyError
        If a linkage does not close or has a dead point.
    """
    legs = [ensemble(mechanism, each | {"runs": 1})[0] for each in settings]
    for leg in {repr(leg): leg for leg in legs}.values():
        if not leg.clearances:
            raise ConfigError("joints", "", "names no joint")
        leg.prepare()


# Wear lives with wear feedback, by cycle jumps, sampled at equal increases of the largest clearance.


STATES = 41  # states of a life at equal increases of clearance, new and end included; odd: one is halfway


def wear_life(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Wear lives of an ensemble.

    Returns
    -------
    dict of arrays
        For runs r, states of wear w (the first is new), clearance joints k and sectors N:
        ``cycles`` (r, w): gait cycles since new;
        ``clearance_mean_m``, ``clearance_max_m`` (r, w, k): radial clearance;
        ``depth_m`` (r, 2, k, 2, N): wear depth of bushing and journal, halfway and at the end;
        ``rate_m_per_cycle`` (r, 2, k, 2, N): wear depth per cycle, when new and at the end;
        ``peak_force_n`` (r, w, k), ``toe_position_m`` (r, w): largest contact force and toe error of a cycle.

    Raises
    ------
    SimulationError
        If the motion diverges, or no joint wears.
    """
    mechanism = loaded(mechanism, settings)
    lives = [_life(mechanism, settings, run) for run in range(settings["runs"])]
    result = {name: np.array([life[name] for life in lives]) for name in lives[0]}
    return result | {"clearance_joints": np.array(settings["clearance_joints"])}


def _life(mechanism: Mechanism, settings: dict[str, Any], member: int) -> dict[str, Floats]:
    run = LifeRun(
        mechanism,
        LifeSettings(
            legs=1,
            cycles=settings["cycles"],
            perturb_fraction=settings["perturb_fraction"],
            jump=JumpControl.of(settings["jump_m"]),
            seed=settings["seed"] + member,
        ),
        clearances=settings["clearance_joints"],
        clearance_m=settings["clearance_m"],
        speed_rpm=speed_rpm_of(mechanism, settings),
    )
    life = simulate_life(run, limit_m=run.fresh_m + settings["opens_m"], horizon_cycles=np.inf)
    opened = (life.clearance_m - run.fresh_m).max(axis=1)
    if opened[-1] < settings["opens_m"]:
        raise SimulationError(
            f"none of {', '.join(run.clearance_joints)} wears, look at their wear_coefficient"
        )
    cycles = np.interp(np.linspace(0.0, settings["opens_m"], STATES), opened, life.cycles)
    depth = between(life.cycles, life.depth, cycles)
    rate = between(life.cycles, np.array([point.rate.depth for point in run.points]), cycles[[0, -1]])
    toe = np.array([point.toe_position_m for point in run.points])
    profile = depth.sum(axis=2)  # of both surfaces, each in its own frame
    return {
        "cycles": cycles,
        "clearance_mean_m": run.fresh_m + profile.mean(axis=2),
        "clearance_max_m": run.fresh_m + profile.max(axis=2),
        "depth_m": depth[[STATES // 2, -1]].astype(np.float32),
        "rate_m_per_cycle": rate.astype(np.float32),
        "peak_force_n": between(life.cycles, life.peak_force_n, cycles),
        "toe_position_m": between(life.cycles, toe, cycles),
    }


def between(cycles: Floats, values: Floats, at: Floats) -> Floats:
    """Values (p, ...) at cycles (p,), interpolated linearly at the cycles ``at`` (w,); shape (w, ...)."""
    left = np.clip(np.searchsorted(cycles, at) - 1, 0, len(cycles) - 2)
    fraction = (at - cycles[left]) / np.diff(cycles)[left]
    fraction = fraction.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[left] + fraction * (values[left + 1] - values[left]))


# The largest Lyapunov exponent from two neighbouring trajectories (Benettin et al., Meccanica 15, 1980).
#
# The neighbour starts at a small distance, both trajectories are advanced by a step, the growth of their
# distance is recorded, and the neighbour is rescaled to the initial distance in the present direction.


Motion = Callable[[Floats], Floats]
Comparable = Callable[[Floats, Floats], bool]


def stretches(
    advance: Motion,
    state: Floats,
    direction: Floats,
    scale: Floats,
    distance: float,
    steps: int,
    comparable: Comparable | None = None,
) -> Floats:
    """Logarithms of the growth of a small distance, step by step.

    Parameters
    ----------
    advance : callable
        Returns the state one step later; must not modify its argument.
    state, direction, scale : (n,) arrays
        Initial state, direction of the neighbour from it, and scale of each coordinate. A coordinate of scale
        0 does not count in the distance; rescaling copies it from the first trajectory.
    distance : float
        Initial distance, in units of the scale.
    steps : int
        Number of steps.
    comparable : callable, optional
        Whether the neighbour may be rescaled between these two states; default: always. Around an impact, the
        two are on different sides of it for a moment and their distance is not small.

    Returns
    -------
    (steps,) array
        Logarithmic growth factors [-]; their mean divided by the duration of a step is the exponent, without
        the first steps.
    """
    counts = scale > 0.0
    unit = scale[counts]
    offset = direction[counts] / np.linalg.norm(direction[counts])
    near, last, logs = _beside(state, counts, distance * unit * offset), distance, np.zeros(steps)
    for step in range(steps):
        state, near = advance(state), advance(near)
        gap = (near[counts] - state[counts]) / unit
        size = float(np.linalg.norm(gap))
        if size == 0.0:  # equal in all bits: take the smallest distance that the numbers resolve
            gap, size = offset, np.finfo(float).eps
        logs[step] = np.log(size / last)
        last = size
        if comparable is None or comparable(state, near):
            near, last = _beside(state, counts, gap * (distance / size) * unit), distance
    return logs


def _beside(state: Floats, counts: Flags, offset: Floats) -> Floats:
    near = state.copy()
    near[counts] += offset
    return near


def exponent(logs: Floats, step_time: float, skip: int = 0) -> Estimate:
    """Lyapunov exponent from the growth factors of independent runs, with its standard error.

    The standard error is the larger one of those over runs and over steps, because few runs may agree by
    chance.

    Parameters
    ----------
    logs : (runs, steps) array
        Logarithmic growth factors [-].
    step_time : float
        Duration of a step, in the unit of time of the exponent.
    skip : int
        Number of first steps to leave out, in which the separation turns into the fastest growing direction.

    Returns
    -------
    Estimate
    """
    rates = logs[:, skip:] / step_time
    each = rates.mean(axis=1)
    errors = each.std(ddof=1) / np.sqrt(len(each)), rates.std(ddof=1) / np.sqrt(rates.size)
    return Estimate(float(each.mean()), float(max(errors)))


# The largest Lyapunov exponent of a leg.
#
# The eccentricities are continuous, but their rates change within the short duration of an impact: if the
# neighbour's impact begins a moment later, its rate differs strongly during that moment. Therefore the
# neighbour is rescaled only while both legs have the same joints in contact. The state consists of
# eccentricities, their rates and the approach speed of each contact; the crank's motion is prescribed and
# equal for both.


def lyapunov_exponent(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Growth of the distance between neighbouring motions.

    Returns
    -------
    dict of arrays
        ``stretch_per_cycle`` (r, c) [-]: logarithm of the growth factor in each cycle c of each run r;
        ``period_s`` (): duration of a cycle [s]; ``clearance_joints`` (k,): names.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    legs = observed_legs(ensemble(mechanism, settings), settings["tolerance_m"])
    logs = np.array([_follow(leg, settings) for leg in legs])
    runs, cycles = settings["runs"], settings["cycles"]
    return {
        "clearance_joints": np.array(legs[0].setup.clearance_joints),
        "stretch_per_cycle": logs.reshape(runs, cycles, settings["renewals"]).sum(axis=2),
        "period_s": np.array(TURN / abs(legs[0].setup.speed)),
    }


def _follow(leg: ObservedLeg, settings: dict[str, Any]) -> Floats:
    """Logarithmic growth factors (steps,) of one run."""
    stepper, statistics = leg.stepper, new_run_statistics(len(leg.setup.linkage.mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    steps, depth = SAMPLES // settings["renewals"], stepper.snapshot().depth

    def advance(motion: Floats) -> Floats:
        stepper.restore(Snapshot(motion, depth))
        leg.advance(steps, statistics)
        return stepper.snapshot().motion

    scale, approach = _scale(leg), stepper.snapshot_mask("approach")

    def same_contacts(one: Floats, other: Floats) -> bool:
        return bool(np.array_equal(one[approach] > 0.0, other[approach] > 0.0))

    direction = np.random.default_rng([settings["seed"], 2]).normal(size=len(scale))
    direction[approach] = 0.0
    return stretches(
        advance, stepper.snapshot().motion, direction, scale,
        settings["distance"], settings["cycles"] * settings["renewals"], same_contacts,
    )  # fmt: skip


def _scale(leg: ObservedLeg) -> Floats:
    """Scale of each number of the state: the clearance, and clearance times crank speed for rates."""
    clearance = float(leg.setup.contacts.clearance.min())
    rate = clearance * abs(leg.setup.speed)
    units = {"e": clearance, "v": rate, "approach": rate}
    scale = np.zeros(len(leg.stepper.snapshot().motion))
    for name, unit in units.items():
        scale[leg.stepper.snapshot_mask(name)] = unit
    return scale


# Poincaré sections at one crank angle, and phase portraits over a few cycles.


def poincare_section(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Eccentricities and their rates at one crank angle of every cycle.

    Returns
    -------
    dict of arrays
        For cycles c, clearance joints k and samples s of ``portrait_cycles`` cycles:
        ``section_eccentricity_m``, ``section_rate_mps`` (c, k, 2); ``portrait_eccentricity_m``,
        ``portrait_rate_mps`` (s, k, 2); ``clearance_joints`` (k,): names.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    start = round(settings["crank_angle_deg"] / 360.0 * SAMPLES) % SAMPLES * (TURN / SAMPLES)
    first = ensemble(mechanism, settings)[0]
    (leg,) = observed_legs([attrs.evolve(first, crank_angle_rad=start)])
    statistics = new_run_statistics(len(mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    portrait = [moment for _ in range(settings["portrait_cycles"]) for moment in leg.moments(statistics)]
    section = []
    for _ in range(settings["cycles"]):
        leg.advance(SAMPLES, statistics)
        section.append(leg.observe())
    shape = (-1, len(leg.setup.clearance_joints), 2)
    return {
        "clearance_joints": np.array(leg.setup.clearance_joints),
        "section_eccentricity_m": np.array([moment.e for moment in section]),
        "section_rate_mps": np.array([moment.rate for moment in section]),
        "portrait_eccentricity_m": np.array([moment.e for moment in portrait]).reshape(shape),
        "portrait_rate_mps": np.array([moment.rate for moment in portrait]).reshape(shape),
    }


def period_of(points: Floats, longest: int, tolerance: float) -> int | None:
    """Period of a Poincaré section.

    Parameters
    ----------
    points : (n, m) array
        Points of the section.
    longest : int
        Longest period to try.
    tolerance : float
        Largest difference between equal points, in the unit of the points.

    Returns
    -------
    int or None
        Number of points after which the section repeats; None if it does not.
    """
    for period in range(1, min(longest, len(points) - 1) + 1):
        if np.abs(points[period:] - points[:-period]).max() <= tolerance:
            return period
    return None
