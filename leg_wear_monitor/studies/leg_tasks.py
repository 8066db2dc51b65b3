"""Tasks by name; those of a leg: its response to clearance, also of drawn legs."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import Moment
from leg_wear_monitor.dynamics.result import JointResult
from leg_wear_monitor.dynamics.run import BEGIN, IMPACTS, SPEED, RunStatistics, new_run_statistics
from leg_wear_monitor.dynamics.statistics import drive_torque, joint_statistics
from leg_wear_monitor.errors import AssemblyError, SimulationError
from leg_wear_monitor.mechanism import position
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.studies import life_tasks
from leg_wear_monitor.studies.plan import ERRORS, Arrays, code_digest
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.wear import BUSHING, wear_zone

# Legs of the same topology whose bodies have other lengths and masses, drawn from a seed.


OPEN, DEAD_POINT, TRANSMISSION, STEP = "open", "dead_point", "transmission", "step"  # why a leg is rejected

_POINTS = 72  # crank angles of the check: 5 degrees apart
# A body that turns this many times as far per clearance as in the file's leg is close to a dead point.
_MOST_TURN = 3.0
# A step beyond these bounds, in strides or lifts of the file's leg, is none of a walking leg.
_LEAST_STEP, _MOST_STEP = 1.0 / 3.0, 3.0


class DrawnLeg(NamedTuple):
    """A leg, and its factors on the lengths of ground and bodies and on the masses of bodies."""

    mechanism: Mechanism
    length: Floats
    mass: Floats


def draw_leg(mechanism: Mechanism, settings: dict[str, Any]) -> DrawnLeg:
    """The leg number ``leg`` of ``draw_seed``; leg 0 is the mechanism as it is.

    Parameters
    ----------
    mechanism : Mechanism
    settings : dict
        ``leg``, ``draw_seed``, ``length_tolerance``, ``mass_tolerance``: factors are uniform within 1 ± the
        tolerance. A body, or the ground, is scaled in all directions; its inertia follows.
    """
    bodies = len(mechanism.bodies)
    chance = np.random.default_rng([settings["draw_seed"], settings["leg"]])
    length = 1.0 + settings["length_tolerance"] * chance.uniform(-1.0, 1.0, bodies + 1)
    mass = 1.0 + settings["mass_tolerance"] * chance.uniform(-1.0, 1.0, bodies)
    if settings["leg"] == 0:
        length, mass = np.ones_like(length), np.ones_like(mass)
    leg = LegParameters(mass, length[1:]).applied(mechanism)
    points = {
        name: (float(length[0] * x), float(length[0] * y)) for name, (x, y) in leg.ground.points.items()
    }
    return DrawnLeg(attrs.evolve(leg, ground=attrs.evolve(leg.ground, points=points)), length, mass)


def rejection(leg: Mechanism, file_leg: Mechanism) -> str:
    """Why a leg is none that walks: `OPEN`, `DEAD_POINT`, `TRANSMISSION` or `STEP`; empty if it walks."""
    try:
        position.assemble(position.build_linkage(leg))
    except AssemblyError:
        return OPEN
    try:
        turn, step = _walk(leg)
    except AssemblyError:
        return DEAD_POINT
    usual_turn, usual_step = _walk(file_leg)
    if turn > _MOST_TURN * usual_turn:
        return TRANSMISSION
    parts = step / usual_step
    return "" if ((parts >= _LEAST_STEP) & (parts <= _MOST_STEP)).all() else STEP


def _walk(leg: Mechanism) -> tuple[float, Floats]:
    """Largest turn of a body per eccentricity of a joint [rad/m], and the toe's stride and lift (2,) [m].

    A leg without a toe has the step 1 m, 1 m.
    """
    linkage = position.build_linkage(leg)
    motion = position.one_cycle(linkage, _POINTS, 1.0)
    by_closure = np.linalg.inv(position.jacobians(linkage, motion.q))
    closures = np.arange(by_closure.shape[2]) != linkage.rows.drive_row
    turn = float(np.abs(by_closure[:, 2::3][:, :, closures]).max())
    if leg.toe is None:
        return turn, np.ones(2)
    return turn, np.asarray(np.ptp(position.point_motion(motion, linkage, *leg.toe)[0], axis=0))


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
        ``repeats_contact_force`` (k,), ``repeats_eccentricity`` (k, 2): fraction of the variance of the
        force, and of the eccentricity along the ground's x and y, that the mean cycle explains; with
        ``_by_run`` (r, ...) appended their jackknife pseudo-values, for their scatter over runs.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    legs = life_tasks.observed_legs(life_tasks.ensemble(mechanism, settings))
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


def _follow(leg: life_tasks.ObservedLeg, settings: dict[str, Any]) -> dict[str, Any]:
    """Statistics and curves of one run, by the names of `run_ensemble` without the axis r."""
    setup = leg.setup
    joints, clearance_joints = len(setup.linkage.mechanism.joints), list(setup.contacts.joint)
    leg.advance(settings["skip_cycles"] * life_tasks.SAMPLES, new_run_statistics(joints))
    statistics, depth = new_run_statistics(joints), setup.surfaces.depth.copy()
    shift = round(leg.stepper.crank_angle / position.TURN * life_tasks.SAMPLES) % life_tasks.SAMPLES
    largest: list[Floats] = []
    peaks: list[Floats] = []
    impacts = [statistics.impacts.copy()]
    cycles: list[dict[str, Floats]] = []
    for cycle in range(settings["cycles"]):
        if cycle < settings["traced_cycles"]:
            cycles.append(_curves(list(leg.moments(statistics)), shift, setup.speed > 0.0))
        else:
            leg.advance(life_tasks.SAMPLES, statistics)
        largest.append(statistics.response.copy())
        peaks.append(statistics.peak.copy())
        impacts.append(statistics.impacts.copy())
        statistics.response[:], statistics.peak[:] = 0.0, 0.0
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
    """Values of the joints that have this statistic; those of contact exist for clearance joints only."""
    values = [getattr(joint, name) for joint in joints]
    return np.array([value for value in values if value is not None])


def _impact_speed(statistics: RunStatistics, clearance_joints: list[int]) -> Floats:
    """Mean approach speed (k,) [m/s] of the recorded impacts; 0 without impacts."""
    counts = [min(IMPACTS, int(statistics.impacts[joint])) for joint in clearance_joints]
    rows = [statistics.impact[joint, :count] for joint, count in zip(clearance_joints, counts, strict=True)]
    return np.array([row[row[:, BEGIN] >= 0.0, SPEED].mean() if len(row) else 0.0 for row in rows])


def _curves(moments: list[Moment], shift: int, turns_forwards: bool) -> dict[str, Floats]:
    """Curves (s, ...) of one cycle by the crank angle from 0 on; the states begin at the sample ``shift``."""
    deviation = np.array([moment.deviation for moment in moments])
    curves = {
        "toe_position_m": deviation[:, 0],
        "toe_velocity_mps": deviation[:, 1],
        "toe_acceleration_mps2": deviation[:, 2],
        "drive_torque_nm": np.array([moment.torque for moment in moments]),
        "eccentricity_m": np.array([moment.e for moment in moments]),
        "eccentricity_rate_mps": np.array([moment.rate for moment in moments]),
        "contact_force_n": np.array([moment.force for moment in moments]),
    }
    if not turns_forwards:  # angles descend
        curves, shift = {name: curve[::-1] for name, curve in curves.items()}, shift + 1
    return {name: np.roll(curve, shift, axis=0) for name, curve in curves.items()}


def _bands(curves: dict[str, Floats], runs: int) -> Arrays:
    """Quantiles, an example and the periodicity of each curve; curves (r c, s, ...) of r runs."""
    result: Arrays = {f"example_{name}": curve[0] for name, curve in curves.items()}
    magnitude = np.linalg.norm(curves["contact_force_n"], axis=-1)
    bands = {name: curve for name, curve in curves.items() if name.startswith(("toe", "drive"))}
    bands["contact_force_n"] = magnitude
    for name, curve in bands.items():
        result[f"band_{name}"] = np.quantile(curve, BAND, axis=0).astype(np.float32)
    for name, curve in (("contact_force", magnitude), ("eccentricity", curves["eccentricity_m"])):
        result[f"repeats_{name}"] = _repeats(curve)
        result[f"repeats_{name}_by_run"] = _by_run(curve, runs)
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
    motion = position.one_cycle(linkage, life_tasks.SAMPLES, speed)
    result: Arrays = {
        "ideal_drive_torque_nm": motion.drive_torque,
        "ideal_joint_force_n": np.linalg.norm(motion.joint_force, axis=2),
    }
    if linkage.mechanism.toe is not None:
        path = position.point_motion(motion, linkage, *linkage.mechanism.toe)
        result |= {f"ideal_{name}": part for name, part in zip(ERRORS, path, strict=False)}
    return result


# Response of a drawn leg with clearance in one place or another, as statistics of every run.


HALF = 0.5  # of the wear: the fraction whose narrowest zone is measured

_OF_CLEARANCE_JOINTS = ("impacts", "contact_fraction", "archard_integral_j_per_cycle", "impact_speed_mps")


def drawn_leg_response(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Statistics of a drawn leg, for every set of clearance joints in ``settings["sets"]``.

    Returns
    -------
    dict of arrays
        ``bodies`` (b + 1,): names, ground first; ``length_factor`` (b + 1,), ``mass_factor`` (b,);
        ``rejected`` (): why the leg is not simulated, see `rejection`; empty if it is. Then, for set i,
        runs r and its joints k, names begin with ``set<i>_``:
        ``rms_torque_nm`` (r,); ``error_<name>`` (r,), ``peak_force_n`` (r, k): mean over cycles of the
        largest in a cycle;
        ``ideal_range_<name>`` (): range of the ideal curve, the larger one of x and y;
        ``wear_depth_m_per_cycle`` (r, k): greatest of the bushing; ``zone_deg``, ``zone_centre_deg``
        (r, k): width of the zone with half of its wear, and the angle of its middle in the bushing's frame;
        ``mean_force_n``, ``p99_force_n``, ``impacts``, ``contact_fraction``,
        ``archard_integral_j_per_cycle``, ``impact_speed_mps``, ``repeats_contact_force`` (r, k): as of
        `run_ensemble`; the last are pseudo-values.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    leg = draw_leg(mechanism, settings)
    why_not = rejection(leg.mechanism, mechanism)
    result: Arrays = {
        "bodies": np.array([GROUND, *mechanism.bodies]),
        "length_factor": leg.length,
        "mass_factor": leg.mass,
        "rejected": np.array(why_not),
    }
    if why_not:
        return result
    for i, clearance_joints in enumerate(settings["sets"]):
        arrays = run_ensemble(leg.mechanism, settings | {"clearance_joints": clearance_joints})
        result |= {f"set{i}_{name}": value for name, value in _of_runs(arrays).items()}
    return result


def _of_runs(arrays: Arrays) -> Arrays:
    """The statistics of every run in a result of `run_ensemble`."""
    joints = [list(arrays["joints"]).index(name) for name in arrays["clearance_joints"]]
    depth = arrays["wear_depth_m_per_cycle"][:, :, BUSHING]
    # without wear, the zone with half of it is the whole turn
    zone = np.array([[wear_zone(profile, HALF) or (0.0, 360.0) for profile in run] for run in depth])
    found: Arrays = {
        "peak_force_n": arrays["peak_force_n"][:, :, joints].mean(axis=1),
        "mean_force_n": arrays["mean_force_n"][:, joints],
        "p99_force_n": arrays["p99_force_n"][:, joints],
        "rms_torque_nm": arrays["rms_torque_nm"],
        "wear_depth_m_per_cycle": depth.max(axis=2),
        "zone_deg": zone[..., 1] - zone[..., 0],
        "zone_centre_deg": zone.mean(axis=2) % 360.0,
        "repeats_contact_force": arrays["repeats_contact_force_by_run"],
    }
    for name in _OF_CLEARANCE_JOINTS:
        found[name] = arrays[name].reshape(len(depth), -1, len(joints)).mean(axis=1)
    for name in ERRORS:
        found[f"error_{name}"] = arrays[f"error_{name}"].mean(axis=1)
        if f"ideal_{name}" in arrays:
            found[f"ideal_range_{name}"] = np.ptp(arrays[f"ideal_{name}"], axis=0).max()
    return found


# Tasks by name, and their execution in a worker.


TASKS: dict[str, Callable[[Mechanism, dict[str, Any]], Arrays]] = {
    "response": run_ensemble,
    "leg": drawn_leg_response,
    "life": life_tasks.wear_life,
    "section": life_tasks.poincare_section,
    "exponent": life_tasks.lyapunov_exponent,
}


def compute(task: str, mechanism: Mechanism, settings: dict[str, Any], code: str) -> Arrays:
    """Compute the result of a point; runs in the workers.

    Parameters
    ----------
    task : str
        A key of `TASKS`.
    mechanism : Mechanism
    settings : dict
        Settings of the point.
    code : str
        The caller's `code_digest`.

    Returns
    -------
    dict of arrays
        Result of the task. If the motion diverges, only ``fault`` (), the message: divergence is a valid
        result.

    Raises
    ------
    RuntimeError
        If the code version of this process differs from the caller's.
    """
    if code_digest() != code:
        raise RuntimeError("a worker has another version of leg_wear_monitor than the study that asks it")
    try:
        return TASKS[task](mechanism, settings)
    except SimulationError as error:
        return {"fault": np.array(str(error))}
