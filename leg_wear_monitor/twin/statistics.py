"""Outputs of the twin: values at each sample, statistics of each gait cycle, events, counts."""

from collections.abc import Sequence
from enum import Enum

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats, Ints

LONGEST = 1.5  # times the time in motion: a longer cycle contains standstill, no steady gait


class Tracking(Enum):
    """State of the crank tracking."""

    STOPPED = 0
    STARTING = 1
    IN_STEP = 2
    OUT_OF_STEP = 3


class TwinEventKind(Enum):
    """Kind of an event of the twin; the value is used as a key."""

    ACQUIRED = "acquired"  # the leg starts to move (again), with unchanged wear
    STOPPED = "stopped"
    MOVING = "moving"
    REVERSED = "reversed"
    LOST_IN_GAP = "lost_in_gap"
    LOST_BY_OUTLIERS = "lost_by_outliers"
    LOST_BY_OVERFLOW = "lost_by_overflow"
    BACKWARD_JUMP = "backward_jump"
    # failures of the leg's integration; it restarts with its wear unchanged
    STEP_TOO_SMALL = "step_too_small"  # the step became too small
    PUSHED_THROUGH = "pushed_through"  # a penetration became too large
    INVALID_DRIVE = "invalid_drive"  # the crank's motion was implausible


@attrs.frozen
class Event:
    """An event at a stamp, with its joint if it concerns a joint."""

    stamp_ns: int
    what: TwinEventKind
    joint: str | None = None


@attrs.frozen(eq=False)
class SampleStatistics:
    """The leg at each of the n samples that an update reached; NaN while tracking is lost.

    Attributes
    ----------
    stamp_ns : (n,) array of int
    kind : (n,) array of int
        As in `sample`.
    crank_angle_rad : (n,) array
        Crank angle of the model, in [0, 2 pi).
    predicted_torque_nm : (n,) array
        Mean of the predicted drive torque since the previous sample, with the friction of the drive.
    contact_force_n : (n, k) array
        Forces in the clearance joints at the sample.
    """

    stamp_ns: Ints
    kind: Ints
    crank_angle_rad: Floats
    predicted_torque_nm: Floats
    contact_force_n: Floats

    def __len__(self) -> int:
        return len(self.stamp_ns)


class NotCompared(Enum):
    """Why the torque of a gait cycle is not compared with its prediction; the value is used as a key."""

    FIRST = "first"  # the first whole gait cycle since the leg was set in motion
    CADENCE = "cadence"  # it lasted longer or shorter than the previous cycle
    GAP = "gap"  # motion was bridged in it
    SAMPLES = "samples"  # too few torque samples


@attrs.frozen
class TorqueStatistics:
    """Comparison of measured and predicted drive torque over a gait cycle, after the same low-pass filter.

    Attributes
    ----------
    samples : int
        Number of compared torque samples; if 0, the four values below are NaN.
    measured_rms_nm, predicted_rms_nm, residual_rms_nm : float
    unexplained_rms_nm : float
        RMS of the residual that repeats over the last compared gait cycles, without the parts of foot load,
        frictions and lag and without the scatter from cycle to cycle: the error of the model.
    load_n, load_sigma_n : float
        Vertical foot load, positive upwards, and its standard deviation.
    load_acting_n : float
        Load that acts in the model from now on: the estimate if it is significant and enabled, else 0.
    friction_nm : float
        Friction torque of the drive, opposite to the motion; it does not load the joints.
    torque_lag_s : float
        Delay of the measured torque.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    friction_sigma_nm, torque_lag_sigma_s, load_friction_sigma : float
        Standard deviations of the friction, the lag and the load friction.
    """

    samples: int
    measured_rms_nm: float
    predicted_rms_nm: float
    residual_rms_nm: float
    unexplained_rms_nm: float
    load_n: float
    load_sigma_n: float
    load_acting_n: float
    friction_nm: float
    torque_lag_s: float
    load_friction: float
    friction_sigma_nm: float
    torque_lag_sigma_s: float
    load_friction_sigma: float


@attrs.frozen(eq=False)
class TorqueProfile:
    """Sums over the torque samples of a gait cycle by crank phase, before the low-pass filter.

    Attributes
    ----------
    number, angle_rad : (FINE_PHASES,) array
        Samples in each phase, averages weighted by their duration, and the sum of their crank
        angles.
    measured_nm, predicted_nm : (FINE_PHASES,) array
        Measured torque, and the torque of the model without a foot load.
    lever_m : (FINE_PHASES,) array
        Drive torque per foot load [N m/N].
    """

    number: Floats
    angle_rad: Floats
    measured_nm: Floats
    predicted_nm: Floats
    lever_m: Floats


@attrs.frozen(eq=False)
class LoadProfile:
    """Measured foot load of a gait cycle, along the axes of the mechanism; a contact switch's is 0 or 1 up.

    Attributes
    ----------
    gap_s : float
        Time in gaps between samples.
    least_n, largest_n : float
        Vertical force.
    number : (FINE_PHASES,) array
        Samples in each phase.
    force_n : (2, FINE_PHASES) array
        Sum of their forces.
    """

    gap_s: float
    least_n: float
    largest_n: float
    number: Floats
    force_n: Floats


def means_by_phase(number: Floats, sums: Floats) -> Floats:
    """Means (m, n) by phase of sums (m, n); empty phases are interpolated."""
    there = np.flatnonzero(number)
    if not len(there):
        return np.full(sums.shape, np.nan)
    n = len(number)
    return np.array([np.interp(np.arange(n), there, one[there] / number[there], period=n) for one in sums])


@attrs.frozen(eq=False)
class CycleStatistics:
    """Statistics of one complete gait cycle, from crank angle 0 to the next 0.

    Arrays are (k,) in the order of `DigitalTwin.clearance_joints`.

    Attributes
    ----------
    cycle : int
        Number of the cycle, from 1 since the twin was created (or restored).
    begin_ns, stamp_ns : int
        Stamps of the start and end of the cycle.
    direction : int
        1 forward, -1 backward.
    moving_s, bridged_s : float
        Time in motion; time of bridged gaps.
    peak_force_n, p99_force_n, mean_force_n : array
        Statistics of the contact force; the peak is a sample of a heavy tail.
    impacts : array of int
    archard_j : array
        Integral of ``F_N |v_t| dt``.
    clearance_mean_m, clearance_max_m : array
        Radial clearances at the end of the cycle.
    growth_mean_m : array
        Change of the first over the cycle.
    torque : TorqueStatistics
    torque_profile : TorqueProfile
    not_compared : NotCompared or None
        Why the torque residual leaves this cycle's torque out; None if it does not.
    load : LoadProfile or None
        None without a sample of the foot load.
    load_peak_n : float
        Largest vertical foot load that acted on the leg.
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
    archard_j: Floats
    clearance_mean_m: Floats
    clearance_max_m: Floats
    growth_mean_m: Floats
    torque: TorqueStatistics
    torque_profile: TorqueProfile
    not_compared: NotCompared | None = None
    load: LoadProfile | None = None
    load_peak_n: float = 0.0

    @property
    def duration_s(self) -> float:
        """Time from begin to end [s], standstill included."""
        return (self.stamp_ns - self.begin_ns) * 1.0e-9

    @property
    def cadence_rpm(self) -> float:
        """Mean speed of the crank while it moved [rpm], negative backward."""
        return 60.0 * self.direction / self.moving_s

    @property
    def without_torque(self) -> "CycleStatistics":
        """The gait cycle without its drive torque, as if none had come."""
        values = {name: np.nan for name in attrs.fields_dict(TorqueStatistics) if name != "samples"}
        torque = TorqueStatistics(samples=0, **values)
        return attrs.evolve(self, torque=torque, not_compared=NotCompared.SAMPLES)

    @property
    def is_steady(self) -> bool:
        """True if the leg walked all the time without a bridged gap."""
        return self.bridged_s == 0.0 and self.duration_s <= LONGEST * self.moving_s


@attrs.frozen(eq=False)
class TwinUpdate:
    """Result of an update of the twin."""

    samples: SampleStatistics
    cycles: tuple[CycleStatistics, ...]
    events: tuple[Event, ...]


@attrs.frozen
class Intake:
    """Counts of samples and times since the twin was created; they only increase.

    Attributes
    ----------
    received : int
        All samples.
    faulty : dict of str to int
        Counts by the names of `sample.FAULTS`, without ``none``.
    used : dict of str to int
        Used samples by the names of `KINDS`; a crank sample with a torque counts for both.
    duplicates, late, stray_stamps : int
        Dropped samples: repeated; later than the window; with a stamp far from the others that no second
        sample confirmed.
    outliers, velocity_outliers, load_outliers : int
        Samples dropped by the angle's gate; velocities dropped by theirs; samples of the foot load that both
        neighbours contradict.
    gaps_bridged, lost, backward_jumps, reversals, failures : int
        Numbers of events; ``failures`` of the leg's integration, see `TwinEventKind`.
    bridged_s, moving_s, standing_s : float
        Monitored time; bridged time is a part of moving time.
    unmonitored_s : float
        Time without tracking, up to its last restart.
    out_s : float
        Duration of the present loss of tracking, 0 while the crank is tracked; not a count.
    newest_stamp_ns, followed_stamp_ns : int
        Youngest stamp received, and stamp to which the leg was advanced; 0 before the first.
    """

    received: int
    faulty: dict[str, int]
    used: dict[str, int]
    duplicates: int
    late: int
    stray_stamps: int
    outliers: int
    velocity_outliers: int
    load_outliers: int
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

    @property
    def stamp_ns(self) -> int:
        """Stamp to which the leg was advanced, at first the youngest stamp; 0 before the first sample."""
        return self.followed_stamp_ns or self.newest_stamp_ns


def joined(parts: Sequence[SampleStatistics], clearance_joints: int) -> SampleStatistics:
    """Concatenation of sample statistics; empty statistics without parts."""
    if len(parts) == 1:
        return parts[0]
    stamps: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    none, forces = np.zeros(0), np.zeros((0, clearance_joints))
    empty = SampleStatistics(stamps, stamps, none, none, forces)
    names = [field.name for field in attrs.fields(SampleStatistics)]
    return SampleStatistics(
        *(np.concatenate([getattr(part, name) for part in parts or (empty,)]) for name in names)
    )
