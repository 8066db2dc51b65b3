"""What the twin says: at each sample, of each gait cycle, and when something happens."""

from collections.abc import Sequence
from enum import Enum

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats, Ints


class Tracking(Enum):
    """How the crank is followed."""

    STOPPED = 0
    STARTING = 1
    IN_STEP = 2
    OUT_OF_STEP = 3


class TwinEventKind(Enum):
    """What may happen to the twin; the value is fit for a key."""

    ACQUIRED = "acquired"  # the leg is (again) set in motion, wear as it was
    STOPPED = "stopped"
    MOVING = "moving"
    REVERSED = "reversed"
    LOST_IN_GAP = "lost_in_gap"
    LOST_BY_OUTLIERS = "lost_by_outliers"
    LOST_BY_OVERFLOW = "lost_by_overflow"
    BACKWARD_JUMP = "backward_jump"
    STEP_TOO_SMALL = "step_too_small"  # the leg's motion could not be resolved; it starts afresh, wear kept
    PUSHED_THROUGH = "pushed_through"  # a journal went through its bushing; likewise
    INVALID_DRIVE = "invalid_drive"  # the crank's motion was none of a leg's; likewise


@attrs.frozen
class Event:
    """Something that happened at a stamp, in a joint if it concerns one."""

    stamp_ns: int
    what: TwinEventKind
    joint: str | None = None


@attrs.frozen(eq=False)
class SampleStatistics:
    """The leg at each of n samples that were passed now; NaN while the leg is not followed.

    Attributes
    ----------
    stamp_ns : (n,) array of int
    kind : (n,) array of int
        As in `sample`.
    crank_angle_rad : (n,) array
        Of the leg, in [0, 2 pi).
    predicted_torque_nm : (n,) array
        Mean of the drive torque since the sample before.
    contact_force_n : (n, k) array
        At the sample.
    """

    stamp_ns: Ints
    kind: Ints
    crank_angle_rad: Floats
    predicted_torque_nm: Floats
    contact_force_n: Floats

    def __len__(self) -> int:
        return len(self.stamp_ns)


@attrs.frozen
class TorqueStatistics:
    """Measured against predicted drive torque over a gait cycle, both through the same low-pass.

    Attributes
    ----------
    samples : int
        Torque samples compared; without any, all up to ``condition`` are NaN.
    measured_rms_nm, predicted_rms_nm, residual_mean_nm, residual_rms_nm : float
    unexplained_rms_nm : float
        Of the residual once foot load, friction and lag are taken out: the mismatch of the model.
    condition : float
        Condition number of this cycle's estimate of the three below, 1 at best.
    load_n, load_sigma_n : float
        Vertical foot load, up positive, and its standard deviation.
    load_acting_n : float
        The load at work in the model from now on: that above where it is believed and asked for, else 0.
    friction_nm : float
        Torque of friction in the drive, against the motion; no force in the joints comes of it.
    torque_lag_s : float
        By how much the measured torque comes late.
    friction_sigma_nm, torque_lag_sigma_s : float
        Standard deviations of these two.
    cycle_lag_s, cycle_lag_sigma_s : float
        The lag by this cycle alone, and its standard deviation.
    """

    samples: int
    measured_rms_nm: float
    predicted_rms_nm: float
    residual_mean_nm: float
    residual_rms_nm: float
    unexplained_rms_nm: float
    condition: float
    load_n: float
    load_sigma_n: float
    load_acting_n: float
    friction_nm: float
    torque_lag_s: float
    friction_sigma_nm: float
    torque_lag_sigma_s: float
    cycle_lag_s: float
    cycle_lag_sigma_s: float


@attrs.frozen(eq=False)
class CycleStatistics:
    """One whole gait cycle, from crank angle 0 to the next 0.

    Arrays are (k,) in the order of `DigitalTwin.clearance_joints`.

    Attributes
    ----------
    cycle : int
        Counted from 1 since the twin was made (or restored).
    begin_ns, stamp_ns : int
        Its begin and end.
    direction : int
        1 forward, -1 backward.
    moving_s, bridged_s : float
        Time in motion; time bridged in gaps.
    peak_force_n, p99_force_n, mean_force_n : array
        Of the contact force; the peak is a sample of a heavy tail.
    impacts : array of int
    contact_fraction : array
        Share of the time in contact.
    archard_j : array
        Integral of F_N |v_t| dt.
    clearance_mean_m, clearance_max_m : array
        At its end.
    growth_mean_m, growth_max_m : array
        Of the two over the cycle.
    depth_max_m : (k, 2) array
        Deepest wear of bushing and journal.
    torque : TorqueStatistics
    """

    cycle: int
    begin_ns: int
    stamp_ns: int
    direction: int
    moving_s: float
    bridged_s: float
    peak_force_n: Floats
    p99_force_n: Floats
    mean_force_n: Floats
    impacts: Ints
    contact_fraction: Floats
    archard_j: Floats
    clearance_mean_m: Floats
    clearance_max_m: Floats
    growth_mean_m: Floats
    growth_max_m: Floats
    depth_max_m: Floats
    torque: TorqueStatistics

    @property
    def duration_s(self) -> float:
        """From begin to end, standing included."""
        return (self.stamp_ns - self.begin_ns) * 1.0e-9


@attrs.frozen(eq=False)
class TwinUpdate:
    """What an update of the twin brought."""

    samples: SampleStatistics
    cycles: tuple[CycleStatistics, ...]
    events: tuple[Event, ...]


@attrs.frozen
class Intake:
    """Counts since the twin was made, of samples and of time; they only grow.

    Attributes
    ----------
    received : int
    faulty : dict of str to int
        Counts by the names of `sample.FAULTS`, without ``none``.
    used : dict of str to int
        Samples that were used, by the names of `KINDS`; a crank sample with a torque counts for both.
    duplicates, late, stray_stamps : int
        Dropped: seen before; later than the window; a stamp far off that no other followed.
    outliers, velocity_outliers : int
        Dropped by the gates; of the latter only the velocity.
    gaps_bridged, lost, backward_jumps, reversals, failures : int
        ``failures`` of the leg's motion: see `TwinEventKind`.
    bridged_s, moving_s, standing_s : float
        Monitored time, bridged time is a part of moving time.
    unmonitored_s : float
        Time in which the leg was not followed, up to its last new start.
    out_s : float
        Since when it is not followed at present, 0 where it is; no count.
    newest_stamp_ns, followed_stamp_ns : int
        The youngest stamp taken in, and up to where the leg has followed; 0 before.
    """

    received: int
    faulty: dict[str, int]
    used: dict[str, int]
    duplicates: int
    late: int
    stray_stamps: int
    outliers: int
    velocity_outliers: int
    gaps_bridged: int
    lost: int
    backward_jumps: int
    reversals: int
    failures: int
    bridged_s: float
    moving_s: float
    standing_s: float
    unmonitored_s: float
    out_s: float
    newest_stamp_ns: int
    followed_stamp_ns: int


def joined(parts: Sequence[SampleStatistics], clearance_joints: int) -> SampleStatistics:
    """Statistics of one stretch after the other."""
    if len(parts) < 2:
        return parts[0] if parts else no_samples(clearance_joints)
    names = [field.name for field in attrs.fields(SampleStatistics)]
    return SampleStatistics(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def no_samples(clearance_joints: int) -> SampleStatistics:
    """Statistics of no sample."""
    stamps: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    return SampleStatistics(stamps, stamps, np.zeros(0), np.zeros(0), np.zeros((0, clearance_joints)))
