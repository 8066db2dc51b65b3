"""Tasks of a study's points: response to clearance, Lyapunov exponent, Poincaré section."""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.model import state_shapes
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_tables, views
from leg_wear_monitor.dynamics.joint import EX, EY, F_N, F_T, VX, VY
from leg_wear_monitor.dynamics.result import JointResult
from leg_wear_monitor.dynamics.run import (
    BEGIN,
    DONE,
    IMPACTS,
    SPEED,
    RunStatistics,
    Sample,
    Setup,
    new_run_statistics,
    steady_drive,
    stop,
)
from leg_wear_monitor.dynamics.simulation import Leg, prepare_legs
from leg_wear_monitor.dynamics.statistics import drive_torque, joint_statistics
from leg_wear_monitor.errors import ConfigError, SimulationError
from leg_wear_monitor.mechanism import position
from leg_wear_monitor.mechanism.arrays import Flags, Floats
from leg_wear_monitor.mechanism.person import with_ground_reaction
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.workers import package_digest

Arrays = dict[str, np.ndarray[Any, Any]]
"""Result of a point; `run_ensemble` lists the arrays of a response, with their shapes."""

ERRORS = ("toe_position_m", "toe_velocity_mps", "toe_acceleration_mps2", "drive_torque_nm")
"""Quantities of a response that are compared with the ideal leg, which has no clearance. Of each, the array
``error_<name>`` has the largest deviation in each cycle, and ``ideal_<name>`` the curve of the ideal leg."""

# Sampling grid of the studies.


# samples per gait cycle: equal crank steps from angle 0, at whole intervals of the stepper; with only 512, a
# portrait would look like a polygon
SAMPLES, PORTRAIT_SAMPLES = 512, 2048


# A leg sampled at equal crank steps over whole gait cycles, with run statistics.


class ObservedLeg:
    """A leg with constant crank speed, advanced in equal steps of the crank.

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
        self._period = TURN / abs(setup.speed)

    def advance(self, steps: int, statistics: RunStatistics, samples: int = SAMPLES) -> None:
        """Advance by a number of steps, with a given number per gait cycle, and add to the run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        step = self._period / samples
        done = round(self.stepper.time / step)
        status, k = self.stepper.advance(self._polynomial, (done + steps) * step, statistics)
        if status != DONE:
            raise stop(self.setup, status, k, self.stepper.time)

    def observe(self) -> Sample:
        """The present state of the leg."""
        return self.stepper.observe()

    def moments(self, statistics: RunStatistics, samples: int = SAMPLES) -> Iterator[Sample]:
        """States at every step of the next cycle, from the present one on; adds to the run statistics."""
        for _ in range(samples):
            yield self.observe()
            self.advance(1, statistics, samples)


# Ensembles: legs with equal parameters that differ in the initial positions of crank and journals.


def changed(mechanism: Mechanism, settings: dict[str, Any]) -> Mechanism:
    """The mechanism with the point's ground force and friction, if it has them.

    0 N replaces a load of the ground that the mechanism file has.
    """
    keys = {"friction": "law", "friction_coefficient": "coefficient"}
    friction = {key: settings[name] for name, key in keys.items() if name in settings}
    clearances = {
        name: attrs.evolve(own, friction=attrs.evolve(own.friction, **friction))
        for name, own in mechanism.clearances.items()
    }
    mechanism = attrs.evolve(mechanism, clearances=clearances)
    return with_ground_reaction(mechanism, settings["ground_n"]) if "ground_n" in settings else mechanism


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
        ``clearances``, ``clearance_m`` [m], ``speed_rpm``, ``runs``, ``seed``, ``perturb_fraction`` (of the
        clearance); optional keys as in `sweeps`.

    Returns
    -------
    list of Leg
        One for each run.
    """
    mechanism = changed(mechanism, settings)
    return [
        Leg(
            mechanism=mechanism,
            clearances=settings["clearances"],
            clearance_m=settings["clearance_m"],
            speed_rpm=speed_rpm_of(mechanism, settings),
            normal_law=settings.get("normal_law"),
            crank_angle_rad=angle,
            perturb_m=settings["perturb_fraction"] * settings["clearance_m"],
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
    setups = prepare_legs(legs)
    tables = build_tables(setups[0].linkage, setups[0].contacts)
    return [ObservedLeg(leg, setup, tables, tolerance_m) for leg, setup in zip(legs, setups, strict=True)]


def check_points(mechanism: Mechanism, settings: list[dict[str, Any]]) -> None:
    """Prepare one leg per distinct setting, so that errors are reported before any computation.

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
            raise ConfigError("clearances", "", "a point has no clearance joint. Expected at least one")
        leg.prepare()


# Response of the leg to clearance: errors, forces, wear and curves of a cycle over an ensemble.


BAND = (0.05, 0.5, 0.95)  # quantiles of the ensemble's cycles: lower end of the band, median, upper end

_FIGURES = (
    "mean_force_n", "rms_force_n", "p99_force_n",
    "contact_fraction", "friction_work_j_per_cycle", "archard_integral_j_per_cycle",
)  # fmt: skip


def run_ensemble(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Response of a leg with clearances, compared with the ideal leg.

    Returns
    -------
    dict of arrays
        For runs r, cycles c, joints j, clearance joints k, sectors N and samples s of a cycle from crank
        angle 0:
        ``error_<name>`` (r, c): largest error in each cycle, for the names in `ERRORS`;
        ``peak_force_n`` (r, c, j), ``impacts`` (r, c, k): of each cycle;
        ``mean_force_n``, ``rms_force_n``, ``p99_force_n`` (r, j): over the run;
        ``contact_fraction``, ``friction_work_j_per_cycle``, ``archard_integral_j_per_cycle``,
        ``impact_speed_mps`` (mean approach speed) (r, k); ``rms_torque_nm`` (r,);
        ``wear_depth_m_per_cycle`` (r, k, 2, N): of bushing and journal;
        ``band_<name>`` (3, s, ...): quantiles `BAND` of the curves; ``example_<name>`` (s, ...): first cycle
        of the first run; ``ideal_<name>`` (s, ...): curve of the ideal linkage;
        ``repeats_contact_force`` (k,): fraction of the variance of the force that the mean cycle explains;
        ``repeats_contact_force_by_run`` (r, k): their jackknife pseudo-values, for their scatter over runs.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    legs = observed_legs(ensemble(mechanism, settings))
    members = [_follow(leg, settings) for leg in legs]
    linkage, clearance_joints = legs[0].setup.linkage, legs[0].setup.clearance_joints
    result = {name: np.array([member[name] for member in members]) for name in members[0] if name != "curves"}
    curves = {
        name: np.concatenate([member["curves"][name] for member in members]) for name in members[0]["curves"]
    }
    result |= _bands(curves, len(members)) | _ideal(linkage, legs[0].setup.speed)
    result["joints"], result["clearance_joints"] = (
        np.array(list(mechanism.joints)),
        np.array(clearance_joints),
    )
    return result


def _follow(leg: ObservedLeg, settings: dict[str, Any]) -> dict[str, Any]:
    """Statistics and curves of one run, by the names of `run_ensemble` without the axis r."""
    setup = leg.setup
    joints, clearance_joints = len(setup.linkage.mechanism.joints), list(setup.contacts.joint)
    leg.advance(settings["skip_cycles"] * SAMPLES, new_run_statistics(joints))
    statistics, depth = new_run_statistics(joints), setup.surfaces.depth.copy()
    shift = round(leg.stepper.crank_angle / position.TURN * SAMPLES) % SAMPLES
    largest: list[Floats] = []
    peaks: list[Floats] = []
    impacts = [statistics.impacts.copy()]
    cycles: list[dict[str, Floats]] = []
    for cycle in range(settings["cycles"]):
        if cycle < settings["traced_cycles"]:
            cycles.append(_curves(list(leg.moments(statistics)), shift, setup.speed > 0.0))
        else:
            leg.advance(SAMPLES, statistics)
        largest.append(statistics.response.copy())
        peaks.append(statistics.peak.copy())
        impacts.append(statistics.impacts.copy())
        statistics.response[:], statistics.peak[:] = 0.0, 0.0
    statistics.peak[:] = np.max(peaks, axis=0)  # largest value of the whole run, which bounds its percentiles
    found = joint_statistics(setup, statistics, setup.surfaces.depth - depth, settings["cycles"])
    member = {f"error_{name}": np.array(largest)[:, i] for i, name in enumerate(ERRORS)}
    member |= {name: _known(found.values(), name) for name in _FIGURES}
    return member | {
        "peak_force_n": np.array(peaks),
        "impacts": np.diff(np.array(impacts), axis=0)[:, clearance_joints],
        "impact_speed_mps": _impact_speed(statistics, clearance_joints),
        "rms_torque_nm": drive_torque(statistics).rms,
        "wear_depth_m_per_cycle": (setup.surfaces.depth - depth) / settings["cycles"],
        "curves": {name: np.array([one[name] for one in cycles]) for name in cycles[0]},
    }


def _known(joints: Iterable[JointResult], name: str) -> Floats:
    """Values of the joints that have this statistic; contact statistics exist for clearance joints only."""
    values = [getattr(joint, name) for joint in joints]
    return np.array([value for value in values if value is not None])


def _impact_speed(statistics: RunStatistics, clearance_joints: list[int]) -> Floats:
    """Mean approach speed (k,) [m/s] of the recorded impacts; 0 without impacts."""
    counts = [min(IMPACTS, int(statistics.impacts[joint])) for joint in clearance_joints]
    rows = [statistics.impact[joint, :count] for joint, count in zip(clearance_joints, counts, strict=True)]
    return np.array([row[row[:, BEGIN] >= 0.0, SPEED].mean() if len(row) else 0.0 for row in rows])


def _curves(moments: list[Sample], shift: int, turns_forwards: bool) -> dict[str, Floats]:
    """Curves (s, ...) of one cycle by the crank angle from 0 on; the states begin at the sample ``shift``."""
    deviation = np.array([sample.toe for sample in moments])
    curves = {
        "toe_position_m": deviation[:, 0],
        "toe_velocity_mps": deviation[:, 1],
        "toe_acceleration_mps2": deviation[:, 2],
        "drive_torque_nm": np.array([sample.drive_torque for sample in moments]),
        "eccentricity_m": _rows(moments, EX, EY),
        "contact_force_n": np.linalg.norm(_rows(moments, F_N, F_T), axis=2),
    }
    if not turns_forwards:  # angles descend
        curves, shift = {name: curve[::-1] for name, curve in curves.items()}, shift + 1
    return {name: np.roll(curve, shift, axis=0) for name, curve in curves.items()}


def _rows(samples: list[Sample], *rows: int) -> Floats:
    """Rows of the contacts' samples (s, k, rows), as in `dynamics.joint`."""
    return np.array([sample.contact[list(rows)].T for sample in samples])


def _bands(curves: dict[str, Floats], runs: int) -> Arrays:
    """Quantiles, an example and the periodicity of each curve; curves (r c, s, ...) of r runs."""
    result: Arrays = {f"example_{name}": curve[0] for name, curve in curves.items()}
    magnitude = curves["contact_force_n"]
    bands = {name: curve for name, curve in curves.items() if name.startswith(("toe", "drive"))}
    bands["contact_force_n"] = magnitude
    for name, curve in bands.items():
        result[f"band_{name}"] = np.quantile(curve, BAND, axis=0).astype(np.float32)
    result["repeats_contact_force"] = _repeats(magnitude)
    result["repeats_contact_force_by_run"] = _by_run(magnitude, runs)
    return result


def _repeats(curve: Floats) -> Floats:
    """Fraction (...) of the variance of curves (n, s, ...) that their mean over n explains; 1 if equal."""
    middle = curve.mean(axis=0)
    whole = np.square(curve - middle.mean(axis=0)).mean(axis=(0, 1))
    mean = np.square(middle - middle.mean(axis=0)).mean(axis=0)
    return np.asarray(mean / np.maximum(whole, 1.0e-300))


def _by_run(curve: Floats, runs: int) -> Floats:
    """Jackknife pseudo-values (r, ...) of `_repeats`, one run left out; their mean has no bias 1 / n."""
    whole, members = _repeats(curve), np.split(curve, runs)
    without = [_repeats(np.concatenate(members[:i] + members[i + 1 :])) for i in range(runs)]
    return np.asarray(runs * whole - (runs - 1) * np.array(without))


def _ideal(linkage: position.Linkage, speed: float) -> Arrays:
    """Curves (s, ...) of the ideal linkage at the same samples."""
    motion = position.one_cycle(linkage, SAMPLES, speed)
    result: Arrays = {
        "ideal_drive_torque_nm": motion.drive_torque,
        "ideal_joint_force_n": np.linalg.norm(motion.joint_force, axis=2),
    }
    if linkage.mechanism.toe is not None:
        path = position.point_motion(motion, linkage, *linkage.mechanism.toe)
        result |= {f"ideal_{name}": part for name, part in zip(ERRORS, path, strict=False)}
    return result


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
        0 is not part of the distance; rescaling copies it from the first trajectory.
    distance : float
        Initial distance, in units of the scale.
    steps : int
        Number of steps.
    comparable : callable, optional
        True if the neighbour may be rescaled between these two states; default: always. Around an impact, the
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
        # both are equal in all bits, so we take the smallest distance that the numbers resolve
        if size == 0.0:
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
    logs = np.array([_growth(leg, settings) for leg in legs])
    runs, cycles = settings["runs"], settings["cycles"]
    return {
        "clearance_joints": np.array(legs[0].setup.clearance_joints),
        "stretch_per_cycle": logs.reshape(runs, cycles, settings["renewals"]).sum(axis=2),
        "period_s": np.array(TURN / abs(legs[0].setup.speed)),
    }


def _growth(leg: ObservedLeg, settings: dict[str, Any]) -> Floats:
    """Logarithmic growth factors (steps,) of one run."""
    stepper, statistics = leg.stepper, new_run_statistics(len(leg.setup.linkage.mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    steps, depth = SAMPLES // settings["renewals"], stepper.state.depth.copy()

    def advance(motion: Floats) -> Floats:
        stepper.state.motion[:], stepper.state.depth[:] = motion, depth
        leg.advance(steps, statistics)
        return stepper.state.motion.copy()

    scale, rates = _scale(leg), np.zeros(len(stepper.state.motion))
    _of_joints(leg, rates)["approach"][:] = 1.0
    approach = rates > 0.0

    def same_contacts(one: Floats, other: Floats) -> bool:
        return bool(np.array_equal(one[approach] > 0.0, other[approach] > 0.0))

    direction = np.random.default_rng([settings["seed"], 2]).normal(size=len(scale))
    direction[approach] = 0.0
    return stretches(
        advance, stepper.state.motion.copy(), direction, scale,
        settings["distance"], settings["cycles"] * settings["renewals"], same_contacts,
    )  # fmt: skip


def _scale(leg: ObservedLeg) -> Floats:
    """Scale of each number of the state: the clearance, and clearance times crank speed for rates."""
    clearance = float(leg.setup.contacts.clearance.min())
    rate = clearance * abs(leg.setup.speed)
    scale = np.zeros(len(leg.stepper.state.motion))
    for name, unit in {"e": clearance, "v": rate, "approach": rate}.items():
        _of_joints(leg, scale)[name][:] = unit
    return scale


def _of_joints(leg: ObservedLeg, motion: Floats) -> dict[str, Floats]:
    """Views of the parts of an array with an entry for each number of a leg's state, by name."""
    return views(motion, state_shapes(len(leg.stepper.state.approach)))


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
    first = ensemble(mechanism, settings | {"runs": 1})[0]
    (leg,) = observed_legs([attrs.evolve(first, crank_angle_rad=start)])
    statistics = new_run_statistics(len(mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    cycles = (leg.moments(statistics, PORTRAIT_SAMPLES) for _ in range(settings["portrait_cycles"]))
    portrait = [moment for cycle in cycles for moment in cycle]
    section = []
    for _ in range(settings["cycles"]):
        leg.advance(SAMPLES, statistics)
        section.append(leg.observe())
    shape = (-1, len(leg.setup.clearance_joints), 2)
    return {
        "clearance_joints": np.array(leg.setup.clearance_joints),
        "section_eccentricity_m": _rows(section, EX, EY),
        "section_rate_mps": _rows(section, VX, VY),
        "portrait_eccentricity_m": _rows(portrait, EX, EY).reshape(shape),
        "portrait_rate_mps": _rows(portrait, VX, VY).reshape(shape),
    }


# Tasks by name, and their execution in a worker.


TASKS: dict[str, Callable[[Mechanism, dict[str, Any]], Arrays]] = {
    "response": run_ensemble,
    "exponent": lyapunov_exponent,
    "section": poincare_section,
    "portrait": poincare_section,
}


def code_digest() -> str:
    """Digest of the sources that produce results: the physics, and these tasks."""
    folders = ("configuration", "mechanism", "contact", "dynamics")
    return package_digest(*folders, "wear.py", "studies/tasks.py")


def compute(task: str, mechanism: Mechanism, settings: dict[str, Any], code: str) -> Arrays:
    """Compute the result of a point in a worker; the worker's sources must have the caller's digest ``code``.

    If the motion diverges, the result is only ``fault`` (), the message: divergence is a valid result.
    """
    if code_digest() != code:
        raise RuntimeError("a worker has a different version of leg_wear_monitor than the caller")
    try:
        return TASKS[task](mechanism, settings)
    except SimulationError as error:
        return {"fault": np.array(str(error))}
