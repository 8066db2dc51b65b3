"""Response of the leg to clearance: errors, forces, wear and curves of a cycle over an ensemble."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import Moment
from leg_wear_monitor.dynamics.result.parts import JointResult
from leg_wear_monitor.dynamics.result.statistics import drive_torque, joint_statistics
from leg_wear_monitor.dynamics.run.run_statistics import (
    BEGIN,
    IMPACTS,
    SPEED,
    RunStatistics,
    new_run_statistics,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.ensemble import ensemble, observed_legs
from leg_wear_monitor.studies.tasks.grid import SAMPLES
from leg_wear_monitor.studies.tasks.observed_leg import ObservedLeg

BAND = (0.05, 0.5, 0.95)  # quantiles of the ensemble's cycles: lower end of the band, median, upper end
ERRORS = ("toe_position_m", "toe_velocity_mps", "toe_acceleration_mps2", "drive_torque_nm")

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
    shift = round(leg.stepper.crank_angle / TURN * SAMPLES) % SAMPLES
    largest: list[Floats] = []
    peaks: list[Floats] = []
    impacts = [statistics.impacts.copy()]
    cycles: list[dict[str, Floats]] = []
    for cycle in range(settings["cycles"]):
        if cycle < settings["traced_cycles"]:
            cycles.append(_curves(list(leg.moments(statistics)), shift))
        else:
            leg.advance(SAMPLES, statistics)
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


def _curves(moments: list[Moment], shift: int) -> dict[str, Floats]:
    """Curves (s, ...) of one cycle from crank angle 0 on; the states begin at the sample ``shift``."""
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


def _ideal(linkage: Linkage, speed: float) -> Arrays:
    """Curves (s, ...) of the ideal linkage at the same samples."""
    motion = one_cycle(linkage, SAMPLES, speed)
    result: Arrays = {
        "ideal_drive_torque_nm": motion.drive_torque,
        "ideal_joint_force_n": np.linalg.norm(motion.joint_force, axis=2),
    }
    if linkage.mechanism.toe is not None:
        path = point_motion(motion, linkage, *linkage.mechanism.toe)
        result |= {f"ideal_{name}": part for name, part in zip(ERRORS, path, strict=False)}
    return result
