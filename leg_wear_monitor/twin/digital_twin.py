"""The digital twin: moves and wears like the real leg, from its samples (physics.md section 9).

::

    twin = DigitalTwin(mechanism, TwinSettings())       # builds tables; twin.warm_up() compiles
    update = twin.update(samples)                       # a block of any size, in order of arrival
    update.samples, update.cycles, update.events        # see `statistics`
    twin.tracking, twin.speed_radps, twin.intake        # state of tracking, counts of samples
    twin.clearance_mean_m, twin.depth                   # present wear
    twin.set_depth(depth), twin.reset_wear("G")         # from a ledger; after a replacement
    twin.set_parameters(parameters)                     # masses, lengths, friction, drive
    twin.wear_acceleration = 100.0                      # may change at any time
    snapshot = twin.snapshot(); twin.restore(snapshot)  # continues bit-identically

Results do not depend on the division of the samples into blocks, bit for bit. They lag behind the newest
sample by slightly more than `TrackerSettings.lag`, because the twin needs samples before and after an
instant.
"""

import copy

import numpy as np

from leg_wear_monitor.compiled.kernel import uncompiled
from leg_wear_monitor.dynamics.run import Setup, drive_at
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, check_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin import statistics
from leg_wear_monitor.twin.cycle import torque_profile, tracked_cycle
from leg_wear_monitor.twin.follower import FollowerSnapshot, LegFollower
from leg_wear_monitor.twin.follower_state import COUNTED, SETTLING, TRACKED
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import Samples, SamplingSettings, TwinSettings, gait_samples, intake
from leg_wear_monitor.twin.sampling import (
    Condition,
    SampledState,
    SamplingPlan,
    WearEstimate,
    condition_of,
    measured_load,
)
from leg_wear_monitor.twin.steps import Steps
from leg_wear_monitor.twin.tracker import CrankTracker, TrackerSnapshot

# A leg that follows blocks of gait cycles only, and whose other cycles wear as those do.
#
# Where it does not follow, the crank is tracked and the leg is left where it is: at crank angle 0. It is
# taken up at another passage of crank angle 0, as if the time between had not been.


# RMS of a load's torque, as a fraction of that of the leg itself: wear in a class differs by a tenth or so
_LOAD_STEP = 0.1

_LEAVES = (
    statistics.TwinEventKind.LOST_IN_GAP,
    statistics.TwinEventKind.LOST_BY_OUTLIERS,
    statistics.TwinEventKind.LOST_BY_OVERFLOW,
    statistics.TwinEventKind.BACKWARD_JUMP,
)
_PULLS = (statistics.TwinEventKind.MOVING, statistics.TwinEventKind.REVERSED)


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
    def sampling(self) -> statistics.Sampling:
        """What was followed, and the variance of what was not."""
        own = self._sampled
        return statistics.Sampling(
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

    def _start(self, steps: Steps, i: int) -> statistics.Event:
        self._give_up_cycle()  # after a failure
        event = super()._start(steps, i)
        own, motion = self._sampled, self.state.motion
        own.plan.restart()
        own.depth, own.moved_ns = self._setup.surfaces.depth.copy(), int(motion.moving_ns)
        return event

    def _happened(self, what: statistics.TwinEventKind) -> None:
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

    def _end_cycle(self, stamp: int, cycles: list[statistics.CycleStatistics]) -> None:
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

    def _end_counted(self, stamp: int, cycles: list[statistics.CycleStatistics]) -> Condition | None:
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

    def _end_estimated(
        self, stamp: int, moved_s: float, cycles: list[statistics.CycleStatistics]
    ) -> Condition:
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
            self._follow_again(stamp)
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

    def _follow_again(self, stamp: int) -> None:
        """Follow again from a passage of crank angle 0: the journals are where they were left."""
        own, motion, polynomial = self._sampled, self.state.motion, self._leg.polynomial
        motion.base_ns = stamp - round(1.0e9 * self._stepper.time) - own.left_ns
        polynomial[0] = 1.0e-9 * (motion.piece_begin_ns - motion.base_ns)
        uncompiled(drive_at)(polynomial, self._stepper.time, self._stepper.state.drive)
        self.records["torque"] = 0
        self.state.torque.mean_before, self.state.low_pass.stage = np.nan, 0
        self.estimate.wait(own.passed)
        motion.counts = SETTLING if own.plan.is_settling else COUNTED

    def _condition(self, cadence_rpm: float, profile: statistics.TorqueProfile) -> Condition:
        load = measured_load(profile) / self._load_step_n
        return condition_of(cadence_rpm, load, self._sampled.condition)


TwinSnapshot = tuple[TrackerSnapshot, FollowerSnapshot, float, LegParameters]
"""Complete state of a twin: tracker, follower, factor on the wear, parameters of the leg."""


class DigitalTwin:
    """A leg with clearances that moves and wears according to measured samples.

    Parameters
    ----------
    mechanism : Mechanism
    settings : TwinSettings, optional
    sampling : SamplingSettings, optional
        Follow blocks of gait cycles only; by default, all.

    Attributes
    ----------
    settings : TwinSettings
    clearance_joints : tuple of str
        The clearance joints, in the order of all arrays.

    Raises
    ------
    ConfigError
        For invalid settings, or a mechanism without clearance joints.
    AssemblyError
        If the linkage does not close or has a dead point.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        settings: TwinSettings | None = None,
        sampling: SamplingSettings | None = None,
    ) -> None:
        self.settings = settings or TwinSettings()
        commanded = self.settings.tracker.commanded_speed_radps
        setup = prepare(
            mechanism, clearances=self.settings.clearance_joints, speed_rpm=60.0 * commanded / TURN, wear=True
        )
        if not setup.clearance_joints:
            raise ConfigError(
                mechanism.source, "clearances.joints", "no joint has clearance, nothing can wear"
            )
        self.clearance_joints = setup.clearance_joints
        self._setup, self._mechanism = setup, mechanism
        self._parameters = LegParameters.none(mechanism)
        self._nominal = setup.contacts.wear_coefficient.copy()
        self._friction = setup.contacts.friction[:, 0].copy()
        self._follower = (
            SampledFollower(setup, self.settings, sampling) if sampling else LegFollower(setup, self.settings)
        )
        self._tracker = CrankTracker(self.settings.tracker)
        self.wear_acceleration = self.settings.wear_acceleration
        self._intake: statistics.Intake | None = None

    @property
    def wear_acceleration(self) -> float:
        """Factor on all wear coefficients."""
        return self._acceleration

    @wear_acceleration.setter
    def wear_acceleration(self, factor: float) -> None:
        if not 0.0 <= factor < np.inf:
            raise LegWearError(f"wear_acceleration: {factor} is not a finite number from 0 up")
        self._acceleration = float(factor)
        self._setup.contacts.wear_coefficient[:] = factor * self._nominal

    @property
    def wear_coefficient_per_pa(self) -> Floats:
        """Nominal wear coefficient (k,) of bushing and journal together [1/Pa]."""
        return np.asarray(self._nominal.sum(axis=1))

    @property
    def depth(self) -> Floats:
        """Wear depth (k, 2, N) [m] of bushing and journal; a copy."""
        return self._setup.surfaces.depth.copy()

    @property
    def clearance_mean_m(self) -> Floats:
        """Mean radial clearance (k,) [m]."""
        return np.asarray(self._follower.clearances[0])

    @property
    def clearance_max_m(self) -> Floats:
        """Largest radial clearance (k,) [m]."""
        return np.asarray(self._follower.clearances[1])

    @property
    def peak_force_n(self) -> Floats:
        """Largest contact force (k,) [N] since the begin of the gait cycle; NaN if it is tracked only."""
        return self._follower.peak_force_n

    @property
    def torque_size_nm(self) -> float:
        """RMS of the ideal drive torque at the commanded speed [N m]."""
        return self._follower.torque_size_nm

    @property
    def sampling(self) -> statistics.Sampling | None:
        """State of a sampled replay; None where all gait cycles are followed."""
        return self._follower.sampling if isinstance(self._follower, SampledFollower) else None

    def pull_block(self) -> None:
        """In a sampled replay, follow the next gait cycles, because something has changed."""
        if isinstance(self._follower, SampledFollower):
            self._follower.pull_block()

    def end_recording(self) -> None:
        """In a sampled replay, count the part of a gait cycle that was tracked at the end."""
        if isinstance(self._follower, SampledFollower):
            self._follower.end_recording()

    @property
    def tracking(self) -> statistics.Tracking:
        """State of the crank tracking."""
        return statistics.Tracking(int(self._tracker.state.clock.tracking))

    @property
    def speed_radps(self) -> float:
        """Crank speed at the last spline node [rad/s]."""
        return float(self._tracker.state.node.speed)

    @property
    def due_stamp_ns(self) -> int:
        """Stamp that the samples of all kinds must reach for the next values; 0 if it is not known."""
        return self._tracker.due_stamp_ns

    @property
    def intake(self) -> statistics.Intake:
        """Counts of samples and times since the twin was created."""
        if self._intake is None:  # it is asked for several times between two updates
            self._intake = intake(self._tracker.records, self._follower.records, self.settings.kinds)
        return self._intake

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism as it was given."""
        return self._mechanism

    @property
    def parameters(self) -> LegParameters:
        """Factors on the parameters of the mechanism, the compliance of its drive, and the load's shape."""
        return self._parameters

    def set_parameters(self, parameters: LegParameters) -> None:
        """Continue with other masses, lengths, friction and drive; motion and wear go on.

        Raises
        ------
        AssemblyError
            If the linkage does not close or has a dead point.
        """
        if parameters != self._parameters:
            linkage = build_linkage(parameters.in_air.applied(self._mechanism))
            check_cycle(linkage)
            friction = parameters.friction * self._friction
            self._follower.take_parameters(linkage, friction, parameters)
            self._parameters = parameters

    def freeze_load(self, is_frozen: bool, clears: bool = False) -> bool:
        """Go on with the measured load of the gait cycles before, because its samples are wrong.

        Parameters
        ----------
        is_frozen : bool
            False to take samples again.
        clears : bool, optional
            Whether the load of the gait cycles before was wrong, too: then none acts.

        Returns
        -------
        bool
            Whether a mean load of gait cycles is known.
        """
        return self._follower.freeze_load(is_frozen, clears)

    def set_depth(self, depth: Floats) -> None:
        """Set wear depths (k, 2, N) [m], for instance from a ledger.

        Raises
        ------
        LegWearError
            For another shape, or for values that are negative or not finite.
        """
        own = self._setup.surfaces.depth
        if depth.shape != own.shape or not (np.isfinite(depth).all() and (depth >= 0.0).all()):
            raise LegWearError(f"depth: expected finite depths from 0 m up of shape {own.shape}")
        self._follower.take_surfaces(depth)

    def reset_wear(self, joint: str) -> None:
        """Set the wear of a joint to 0 after a replacement of its parts.

        Raises
        ------
        LegWearError
            For a joint without clearance.
        """
        if joint not in self.clearance_joints:
            raise LegWearError(
                f"{joint}: no clearance joint, expected one of {', '.join(self.clearance_joints)}"
            )
        depth = self.depth
        depth[self.clearance_joints.index(joint)] = 0.0
        self.set_depth(depth)

    def warm_up(self) -> None:
        """Compile everything that `update` needs, before the first sample; takes about a minute once.

        The motion comes last, because a second process may be compiling it.
        """
        now = self.snapshot()
        self._follower.compile(self._tracker.steps)
        stamps = 1_000_000_000 + 5_000_000 * np.arange(150)
        angle = self.settings.tracker.commanded_speed_radps * 1.0e-9 * stamps
        self.update(gait_samples(stamps, crank_angle_rad=angle))
        self.restore(now)

    def update(self, samples: Samples) -> statistics.TwinUpdate:
        """Process a block (n,) of `GAIT_SAMPLE` in order of arrival, as far as the lag allows."""
        evaluated: list[statistics.SampleStatistics] = []
        cycles: list[statistics.CycleStatistics] = []
        events: list[statistics.Event] = []
        self._intake = None
        for steps, n in self._tracker.update(samples):
            if n:
                evaluated.append(self._follower.follow(steps, n, cycles, events))
        return statistics.TwinUpdate(
            statistics.joined(evaluated, len(self.clearance_joints)), tuple(cycles), tuple(events)
        )

    def snapshot(self) -> TwinSnapshot:
        """A copy of the whole state."""
        tracker, follower = self._tracker.snapshot(), self._follower.snapshot()
        return tracker, follower, self.wear_acceleration, self._parameters

    def restore(self, snapshot: TwinSnapshot) -> None:
        """Restore a snapshot of a twin of the same mechanism and settings."""
        tracker, follower, acceleration, parameters = snapshot
        self._intake = None
        self.set_parameters(parameters)
        self._tracker.restore(tracker)
        self._follower.restore(follower)
        self.wear_acceleration = acceleration
