"""A leg that follows blocks of gait cycles only, and whose other cycles wear as those do.

Where it does not follow, the crank is tracked and the leg is left where it is: at crank angle 0. It is taken
up at another passage of crank angle 0, as if the time between had not been.
"""

import copy

import numpy as np

from leg_wear_monitor.dynamics.run.drive import drive_at
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.follower.cycle import torque_profile, tracked_cycle
from leg_wear_monitor.twin.follower.follower import FollowerSnapshot, LegFollower
from leg_wear_monitor.twin.follower.state import COUNTED, SETTLING, TRACKED
from leg_wear_monitor.twin.sampling.condition import Condition, condition_of, measured_load
from leg_wear_monitor.twin.sampling.plan import SamplingPlan
from leg_wear_monitor.twin.sampling.settings import SamplingSettings
from leg_wear_monitor.twin.sampling.state import SampledState
from leg_wear_monitor.twin.sampling.wear_estimate import WearEstimate
from leg_wear_monitor.twin.settings import TwinSettings
from leg_wear_monitor.twin.statistics import CycleStatistics, Event, Sampling, TorqueProfile, TwinEventKind
from leg_wear_monitor.twin.steps import Steps

# RMS of a load's torque, as a fraction of that of the leg itself: wear in a class differs by a tenth or so
_LOAD_STEP = 0.1

_LEAVES = (
    TwinEventKind.LOST_IN_GAP,
    TwinEventKind.LOST_BY_OUTLIERS,
    TwinEventKind.LOST_BY_OVERFLOW,
    TwinEventKind.BACKWARD_JUMP,
)
_PULLS = (TwinEventKind.MOVING, TwinEventKind.REVERSED)


class SampledFollower(LegFollower):
    """A leg that follows the tracker's steps in blocks of gait cycles.

    Parameters
    ----------
    setup : Setup
    settings : TwinSettings
    sampling : SamplingSettings
    """

    def __init__(self, setup: Setup, settings: TwinSettings, sampling: SamplingSettings) -> None:
        super().__init__(setup, settings)
        self._fraction = sampling.fraction
        lever_m = float(np.sqrt(np.mean(np.square(self._load.signature))))
        self._load_step_n = _LOAD_STEP * self.torque_size_nm / lever_m if lever_m > 0.0 else np.inf
        depth = setup.surfaces.depth
        self._sampled = SampledState(SamplingPlan(sampling), WearEstimate(depth.shape), depth.copy())

    @property
    def sampling(self) -> Sampling:
        """What was followed, and the variance of what was not."""
        own = self._sampled
        return Sampling(
            fraction=self._fraction,
            followed_cycles=own.followed,
            estimated_cycles=own.wear.estimated_cycles,
            blocks=own.wear.blocks,
            variance_m2=own.wear.variance_m2,
        )

    @property
    def peak_force_n(self) -> Floats:
        """Largest contact force (k,) [N] since the begin of the gait cycle; NaN if it does not count."""
        peak = super().peak_force_n
        return peak if self.state.motion.counts == COUNTED else np.full_like(peak, np.nan)

    def pull_block(self) -> None:
        """Follow a block from the next gait cycle on."""
        self._sampled.plan.pull()

    def end_recording(self) -> None:
        """Count the part of a gait cycle at the end of a recording."""
        motion, own = self.state.motion, self._sampled
        if motion.counts != COUNTED and motion.runs:
            self._estimate_part(int(motion.moving_ns) - own.moved_ns)
            own.depth, own.moved_ns = self._setup.surfaces.depth.copy(), int(motion.moving_ns)

    def take_surfaces(self, depth: Floats) -> None:
        """Set wear depths (k, 2, N) [m]; what was counted before stays."""
        changed = (self._setup.surfaces.depth != depth).any(axis=(1, 2))
        super().take_surfaces(depth)
        self._sampled.depth[changed] = depth[changed]

    def snapshot(self) -> FollowerSnapshot:
        """A copy of the whole state, surfaces included."""
        return super().snapshot()._replace(sampled=copy.deepcopy(self._sampled))

    def restore(self, snapshot: FollowerSnapshot) -> None:
        """Restore a snapshot of a follower of the same setup and settings."""
        super().restore(snapshot)
        if snapshot.sampled is not None:
            self._sampled = copy.deepcopy(snapshot.sampled)

    def _start(self, steps: Steps, i: int) -> Event:
        self._give_up_cycle()  # after a failure
        event = super()._start(steps, i)
        own, motion = self._sampled, self.state.motion
        own.plan.restart()
        own.depth, own.moved_ns = self._setup.surfaces.depth.copy(), int(motion.moving_ns)
        return event

    def _happened(self, what: TwinEventKind) -> None:
        if what in _LEAVES:
            self._give_up_cycle()
        elif what in _PULLS:
            self._sampled.plan.pull()

    def _give_up_cycle(self) -> None:
        """End the present gait cycle, which is not a whole one, where the leg is left."""
        motion, own = self.state.motion, self._sampled
        if motion.counts != COUNTED:
            self._estimate_part(int(motion.moving_ns) - own.moved_ns)
        motion.counts = COUNTED

    def _end_cycle(self, stamp: int, cycles: list[CycleStatistics]) -> None:
        motion, own = self.state.motion, self._sampled
        was_followed, is_whole = motion.counts != TRACKED, bool(motion.cycle_is_whole)
        moved_ns = int(motion.moving_ns - (motion.piece_end_ns - stamp))
        moved_s = 1.0e-9 * (moved_ns - own.moved_ns)
        condition = None
        if motion.counts == COUNTED:
            condition = self._end_counted(stamp, cycles)
        elif is_whole:
            condition = self._end_estimated(stamp, moved_s, cycles)
        else:
            self._estimate_part(moved_ns - own.moved_ns)
            self._begin_cycle(stamp)
        if is_whole:
            own.cycle_s, own.condition = moved_s, condition
        self._plan_next(condition, stamp, was_followed)
        own.depth, own.moved_ns = self._setup.surfaces.depth.copy(), moved_ns

    def _end_counted(self, stamp: int, cycles: list[CycleStatistics]) -> Condition | None:
        """End a gait cycle that was followed; returns its condition if it is a whole one."""
        own, number = self._sampled, len(cycles)
        super()._end_cycle(stamp, cycles)
        if len(cycles) == number:
            return None
        cycle = cycles[-1]
        own.followed += 1
        condition = self._condition(cycle.cadence_rpm, cycle.torque_profile)
        if not own.plan.is_settling:
            own.add(condition, cycle.growth_mean_m, self._setup.surfaces.depth - own.depth)
        return condition

    def _end_estimated(self, stamp: int, moved_s: float, cycles: list[CycleStatistics]) -> Condition:
        """End a whole gait cycle that does not count by itself; returns its condition."""
        motion = self.state.motion
        motion.cycles += 1
        profile = torque_profile(self.state.sums, 0.0)
        if motion.counts == SETTLING:
            self._end_torque(is_compared=False)  # the load may be another one than before the jump
        direction = 1 if motion.cut_rises else -1
        condition = self._condition(60.0 * direction / moved_s, profile)
        self._estimate(condition, 1.0)
        cycles.append(
            tracked_cycle(self.state, stamp, self._setup.contacts, self._setup.surfaces.depth, moved_s)
        )
        self._begin_cycle(stamp)
        return condition

    def _estimate_part(self, moved_ns: int) -> None:
        """Count a part of a gait cycle by its time."""
        own = self._sampled
        if own.condition is not None:
            self._estimate(own.condition, 1.0e-9 * max(moved_ns, 0) / own.cycle_s)

    def _estimate(self, condition: Condition, cycles: float) -> None:
        """Let gait cycles wear as others do, instead of what was simulated in them."""
        own, depth = self._sampled, self._setup.surfaces.depth
        depth[:] = own.depth + own.wear.pass_over(condition, cycles)
        self._stepper.drop_pending_wear()

    def _plan_next(self, condition: Condition | None, stamp: int, was_followed: bool) -> None:
        """Set what the next gait cycle is: counted, settling, or tracked only."""
        own, motion = self._sampled, self.state.motion
        follows = own.plan.follows_next(condition, stamp, was_followed)
        if not follows:
            if was_followed:
                self._leave(stamp)
            own.passed += 1
            return
        if not was_followed:
            self._take_up(stamp)
        if motion.counts == SETTLING and not own.plan.is_settling:
            motion.counts = COUNTED

    def _leave(self, stamp: int) -> None:
        """Leave the leg where it is, at a passage of crank angle 0, and end the block."""
        own, motion = self._sampled, self.state.motion
        depth = self._setup.surfaces.depth
        depth[:] = np.maximum(depth + own.end_block(), 0.0)  # rounding
        self._before = self.clearances
        own.left_ns = stamp - int(motion.base_ns) - round(1.0e9 * self._stepper.time)
        motion.counts, own.passed = TRACKED, 0

    def _take_up(self, stamp: int) -> None:
        """Follow again from a passage of crank angle 0: the journals are where they were left."""
        own, motion, polynomial = self._sampled, self.state.motion, self._leg.polynomial
        motion.base_ns = stamp - round(1.0e9 * self._stepper.time) - own.left_ns
        polynomial[0] = 1.0e-9 * (motion.piece_begin_ns - motion.base_ns)
        drive_at(polynomial, self._stepper.time, self._stepper.state.drive)
        self.records["torque"] = 0
        self.state.torque.mean_before, self.state.low_pass.stage = np.nan, 0
        self.estimate.wait(own.passed)
        motion.counts = SETTLING if own.plan.is_settling else COUNTED

    def _condition(self, cadence_rpm: float, profile: TorqueProfile) -> Condition:
        load = measured_load(profile) / self._load_step_n
        return condition_of(cadence_rpm, load, self._sampled.condition)
