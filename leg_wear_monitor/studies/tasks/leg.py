"""Response of a drawn leg with clearance in one place or another, as statistics of every run."""

from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.drawn_leg import draw_leg, rejection
from leg_wear_monitor.studies.tasks.response import ERRORS, run_ensemble
from leg_wear_monitor.wear.surfaces import BUSHING, wear_zone

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
