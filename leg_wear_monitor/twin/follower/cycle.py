"""Statistics of a gait cycle from its sums."""

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.run.run_statistics import ARCHARD, CONTACT, FORCE, RunStatistics, percentile
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.record import Record
from leg_wear_monitor.twin.follower.state import FRICTION, LAG, LOAD, LOAD_FRICTION
from leg_wear_monitor.twin.follower.torque_estimate import CycleEstimate, LoadEstimate
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    LoadProfile,
    NotCompared,
    TorqueProfile,
    TorqueStatistics,
)


def clear_run_statistics(statistics: RunStatistics) -> None:
    """Empty run statistics in place."""
    for part in statistics:
        part[...] = 0
    statistics.drive_range[:] = np.inf, -np.inf


def clearances(contacts: ContactArrays, depth: Floats) -> Floats:
    """Mean and largest radial clearance (2, k) [m] of worn joints, depth (k, 2, N)."""
    opened = depth.sum(axis=1)
    return np.stack([contacts.clearance + opened.mean(axis=1), contacts.clearance + opened.max(axis=1)])


def torque_statistics(
    sums: Record, found: CycleEstimate | None, settled: LoadEstimate, unexplained_nm: float
) -> TorqueStatistics:
    """Torque statistics of one cycle.

    Parameters
    ----------
    sums : Record
        `TORQUE_SUMS` of the cycle.
    found : CycleEstimate or None
        Least-squares estimate of this cycle alone.
    settled : LoadEstimate
        Estimate filtered over cycles.
    unexplained_nm : float
        RMS of the unexplained residual over the last cycles that were compared.

    Returns
    -------
    TorqueStatistics
    """
    n, weight = int(sums.number), sums.weight

    def rms(squares: float) -> float:
        return float(np.sqrt(squares / weight)) if n else np.nan

    load, friction, lag, load_friction = settled.values.tolist()
    return TorqueStatistics(
        samples=n,
        measured_rms_nm=rms(sums.measured_squares),
        predicted_rms_nm=rms(sums.predicted_squares),
        residual_rms_nm=rms(sums.residual_squares),
        unexplained_rms_nm=unexplained_nm,
        condition=found.condition if found else np.nan,
        load_n=load,
        load_sigma_n=float(settled.sigma[LOAD]),
        load_acting_n=settled.acting,
        friction_nm=friction,
        torque_lag_s=lag,
        load_friction=load_friction,
        load_friction_sigma=float(settled.sigma[LOAD_FRICTION]),
        friction_sigma_nm=float(settled.sigma[FRICTION]),
        torque_lag_sigma_s=float(settled.sigma[LAG]),
        cycle_lag_s=float(found.values[LAG]) if found else np.nan,
        cycle_lag_sigma_s=float(found.sigma[LAG]) if found else np.nan,
    )


def torque_profile(sums: Record, acting_n: float) -> TorqueProfile:
    """Torques of a cycle by phase; ``acting_n`` is the foot load that acted in the model [N]."""
    number, angle, measured, predicted, lever = sums.profile.copy()
    return TorqueProfile(number, angle, measured, predicted - acting_n * lever, lever)


def load_profile(leg: Record) -> LoadProfile | None:
    """Foot load of the cycle of a `LEG_STATE`; None without a sample."""
    sums = leg.load
    if not sums.samples:
        return None
    number, *force = sums.profile.copy()
    return LoadProfile(
        1.0e-9 * float(sums.gap_ns), float(sums.least), float(sums.largest), number, np.stack(force)
    )


def cycle_statistics(
    leg: Record, stamp: int, contacts: ContactArrays, depth: Floats, before: Floats,
    statistics: RunStatistics, torque: TorqueStatistics, profile: TorqueProfile,
    not_compared: NotCompared | None, load_peak_n: float,
) -> CycleStatistics:  # fmt: skip
    """Statistics of a cycle at its end from a `LEG_STATE`; ``before`` (2, k) [m]: initial clearances."""
    joint, motion, now = contacts.joint, leg.motion, clearances(contacts, depth)
    moving = float(statistics.time[0])
    return CycleStatistics(
        cycle=int(motion.cycles),
        begin_ns=int(motion.cycle_begin_ns),
        stamp_ns=stamp,
        direction=1 if motion.cut_rises else -1,
        moving_s=moving,
        bridged_s=float(motion.cycle_bridged_ns) * 1.0e-9,
        peak_force_n=statistics.peak[joint],
        p99_force_n=np.array([percentile(statistics.force_time[j], 0.99) for j in joint]),
        mean_force_n=statistics.integral[joint, FORCE] / moving,
        impacts=statistics.impacts[joint],
        contact_fraction=statistics.integral[joint, CONTACT] / moving,
        archard_j=statistics.integral[joint, ARCHARD],
        clearance_mean_m=now[0],
        clearance_max_m=now[1],
        growth_mean_m=now[0] - before[0],
        torque=torque,
        torque_profile=profile,
        not_compared=not_compared,
        load=load_profile(leg),
        load_peak_n=load_peak_n,
    )


def tracked_cycle(
    leg: Record, stamp: int, contacts: ContactArrays, depth: Floats, moving_s: float
) -> CycleStatistics:
    """Statistics of a cycle that was tracked, but does not count by itself; depth (k, 2, N) is estimated."""
    motion, now = leg.motion, clearances(contacts, depth)
    unknown = np.full(len(contacts.joint), np.nan)
    values = [field.name for field in attrs.fields(TorqueStatistics) if field.name != "samples"]
    return CycleStatistics(
        cycle=int(motion.cycles),
        begin_ns=int(motion.cycle_begin_ns),
        stamp_ns=stamp,
        direction=1 if motion.cut_rises else -1,
        moving_s=moving_s,
        bridged_s=float(motion.cycle_bridged_ns) * 1.0e-9,
        peak_force_n=unknown,
        p99_force_n=unknown,
        mean_force_n=unknown,
        impacts=np.zeros(len(unknown), np.int64),
        contact_fraction=unknown,
        archard_j=unknown,
        clearance_mean_m=now[0],
        clearance_max_m=now[1],
        growth_mean_m=unknown,
        torque=TorqueStatistics(samples=0, **dict.fromkeys(values, np.nan)),
        torque_profile=torque_profile(leg.sums, 0.0),
        is_followed=False,
        load=load_profile(leg),
        load_peak_n=np.nan,
    )
