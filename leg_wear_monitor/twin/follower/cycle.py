"""A gait cycle's statistics from what was added up over it."""

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.run.run_statistics import ARCHARD, CONTACT, FORCE, RunStatistics, percentile
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.follower.state import (
    CUT_RISES,
    CYCLE_BEGIN,
    CYCLE_BRIDGED,
    CYCLES,
    MEASURED_2,
    NUMBER,
    PREDICTED_2,
    RESIDUAL,
    RESIDUAL_2,
    LegState,
)
from leg_wear_monitor.twin.follower.torque_estimate import FRICTION, LAG, LOAD, CycleEstimate, LoadEstimate
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueStatistics


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
    sums: Floats, found: CycleEstimate | None, settled: LoadEstimate, unexplained_nm: float
) -> TorqueStatistics:
    """Of the sums (SUMS,) of a cycle, what it alone says, and what has settled."""
    n = int(sums[NUMBER])

    def rms(i: int) -> float:
        return float(np.sqrt(sums[i] / n)) if n else np.nan

    load, friction, lag = settled.values.tolist()
    return TorqueStatistics(
        samples=n,
        measured_rms_nm=rms(MEASURED_2),
        predicted_rms_nm=rms(PREDICTED_2),
        residual_mean_nm=float(sums[RESIDUAL] / n) if n else np.nan,
        residual_rms_nm=rms(RESIDUAL_2),
        unexplained_rms_nm=unexplained_nm,
        condition=found.condition if found else np.nan,
        load_n=load,
        load_sigma_n=float(settled.sigma[LOAD]),
        load_acting_n=settled.acting,
        friction_nm=friction,
        torque_lag_s=lag,
        friction_sigma_nm=float(settled.sigma[FRICTION]),
        torque_lag_sigma_s=float(settled.sigma[LAG]),
        cycle_lag_s=float(found.values[LAG]) if found else np.nan,
        cycle_lag_sigma_s=float(found.sigma[LAG]) if found else np.nan,
    )


def cycle_statistics(
    leg: LegState, stamp: int, contacts: ContactArrays, depth: Floats, before: Floats,
    statistics: RunStatistics, torque: TorqueStatistics,
) -> CycleStatistics:  # fmt: skip
    """Statistics of the cycle that ends at a stamp; ``before`` (2, k) the clearances at its begin."""
    joint, mark, now = contacts.joint, leg.mark, clearances(contacts, depth)
    moving = float(statistics.time[0])
    return CycleStatistics(
        cycle=int(mark[CYCLES]),
        begin_ns=int(mark[CYCLE_BEGIN]),
        stamp_ns=stamp,
        direction=1 if mark[CUT_RISES] else -1,
        moving_s=moving,
        bridged_s=float(mark[CYCLE_BRIDGED]) * 1.0e-9,
        peak_force_n=statistics.peak[joint],
        p99_force_n=np.array([percentile(statistics.force_time[j], 0.99) for j in joint]),
        mean_force_n=statistics.integral[joint, FORCE] / moving,
        impacts=statistics.impacts[joint],
        contact_fraction=statistics.integral[joint, CONTACT] / moving,
        archard_j=statistics.integral[joint, ARCHARD],
        clearance_mean_m=now[0],
        clearance_max_m=now[1],
        growth_mean_m=now[0] - before[0],
        growth_max_m=now[1] - before[1],
        depth_max_m=depth.max(axis=2),
        torque=torque,
    )
