"""The leg that follows the tracker's steps, and actions where its kernel returns (physics.md section 9)."""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import Record, Records, compile_for, new_records, record_of
from leg_wear_monitor.dynamics import run
from leg_wear_monitor.dynamics.clearance.contact import contact_laws
from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper
from leg_wear_monitor.dynamics.clearance.stepper import Snapshot as StepperSnapshot
from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import heavier_person_torque
from leg_wear_monitor.mechanism.position import TURN, Linkage
from leg_wear_monitor.twin import cycle, follower_state
from leg_wear_monitor.twin import steps as step_codes
from leg_wear_monitor.twin.following import CYCLE, LEFT, NEEDS_START, REPORTED, follow
from leg_wear_monitor.twin.load import FootLoad, force_of, set_force, shape_torque, torque_size
from leg_wear_monitor.twin.reference import LegParameters, drive_coupling
from leg_wear_monitor.twin.sample import FOOT_FRAME, GROUND, INSTANT, MEASURED, STANCE, TwinSettings
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    Event,
    NotCompared,
    SampleStatistics,
    TorqueProfile,
    TorqueStatistics,
    TwinEventKind,
)
from leg_wear_monitor.twin.steps import MOVE, Steps

_DENT_M = 1.0e-5  # a third of the penetration under 10 kN
_RUN_IN_S = 0.2
_STEADY = 0.05  # relative difference of two gait cycles' durations beyond which the cadence changes
_LARGEST_FRICTION = 0.3  # constant one, of the RMS torque: as drive_torque.max_friction_nm by default
_NOTABLE, _MUCH_LESS = 0.05, 0.5  # residual over RMS torque from which a load may have a different shape
_LEAST_TORQUE_NM = 1.0e-6  # lower bound of the RMS torque, for a leg that needs no torque

_EVENT_KINDS = {
    step_codes.LOST_IN_GAP: TwinEventKind.LOST_IN_GAP,
    step_codes.LOST_BY_OUTLIERS: TwinEventKind.LOST_BY_OUTLIERS,
    step_codes.LOST_BY_OVERFLOW: TwinEventKind.LOST_BY_OVERFLOW,
    step_codes.LOST_BY_JUMP: TwinEventKind.BACKWARD_JUMP,
    step_codes.STOPPED: TwinEventKind.STOPPED,
    step_codes.MOVING: TwinEventKind.MOVING,
    step_codes.REVERSED: TwinEventKind.REVERSED,
}
_FAILURES = {
    run.STEP_TOO_SMALL: TwinEventKind.STEP_TOO_SMALL,
    run.PUSHED_THROUGH: TwinEventKind.PUSHED_THROUGH,
    run.INVALID_DRIVE: TwinEventKind.INVALID_DRIVE,
}


class FollowerSnapshot(NamedTuple):
    """Complete state of a follower as plain arrays."""

    stepper: StepperSnapshot
    leg: tuple[np.ndarray, ...]
    statistics: tuple[np.ndarray, ...]
    before: Floats
    estimate: Floats
    repeating: tuple[Floats, ...]
    load: tuple[Floats, ...]
    load_shape: str


class LegFollower:
    """A leg with clearances that follows the tracker's steps.

    Parameters
    ----------
    setup : Setup
        The follower wears its surfaces.
    settings : TwinSettings

    Attributes
    ----------
    records : Records
        The `LEG_STATE`, (1,).
    state : Record
        The same record, by names.
    statistics : RunStatistics
        Statistics of the present gait cycle.
    estimate : LoadEstimate
    torque_size_nm : float
        RMS of the ideal drive torque at the commanded speed.
    """

    def __init__(self, setup: run.Setup, settings: TwinSettings) -> None:
        is_measured = settings.load_model == MEASURED
        # with a measured load, the estimated load is only the excess that the torque shows
        self._setup, self._acts = setup, settings.estimate_load and not is_measured
        is_of_foot = settings.load_frame == FOOT_FRAME
        self._load = FootLoad(setup.linkage, setup.contacts, settings.load_shape, is_measured, is_of_foot)
        # a whole number of nanoseconds, so that the stepper's time does not drift from the stamps
        interval = round(1.0e9 * TURN / abs(setup.speed) / INTERVALS) * 1.0e-9
        self._stepper = ClearanceStepper(setup, interval, tables=self._load.tables)
        self._leg: follower_state.FollowerState = follower_state.leg_state(len(setup.clearance_joints))
        self.records = self._leg.records
        self.state: Record = record_of(self.records)
        self.statistics = run.new_run_statistics(len(setup.linkage.mechanism.joints))
        self._loads = settings.loads_n
        # an undeclared load is a push, or the ground's force in stance, whichever explains the torque
        self._is_load_known = is_measured or settings.load_model == GROUND or settings.load_shape != STANCE
        self._shape_torque = shape_torque(setup.linkage)
        self.estimate = cycle.LoadEstimate(self._loads[1], self._loads[0])
        self._cutoff, self._declared_lag_s = TURN * settings.torque_bandwidth_hz, settings.torque_lag_s
        self.torque_size_nm = max(torque_size(setup.linkage, setup.speed), _LEAST_TORQUE_NM)
        self._instants = settings.torque_sampling == INSTANT
        kept = (
            (cycle.INSTANT_CYCLES, cycle.INSTANT_CYCLES)
            if self._instants
            else (cycle.CYCLES, cycle.LEAST_CYCLES)
        )
        self._repeating = cycle.RepeatingResidual(*kept)
        self._tolerated_nm = self._of_person() if setup.linkage.mechanism.person_kg else None
        self._sensor = new_records(1, follower_state.TORQUE_SENSOR)
        self._sensor[0] = self._cutoff, self.torque_size_nm, self._instants, 0.0, 0.0
        self._before = self.clearances

    @cached_property
    def _advance_address(self) -> int:
        return self._stepper.advance_address(self._leg.polynomial, self.statistics)

    @property
    def peak_force_n(self) -> Floats:
        """Largest contact force (k,) [N] since the begin of the gait cycle."""
        return np.asarray(self.statistics.peak[self._setup.contacts.joint])

    @property
    def clearances(self) -> Floats:
        """Mean and largest radial clearance (2, k) [m]."""
        return cycle.clearances(self._setup.contacts, self._setup.surfaces.depth)

    def take_surfaces(self, depth: Floats) -> None:
        """Set wear depths (k, 2, N) [m]; for changed joints, the growth of the cycle counts from there.

        Where a wall comes closer by more than an impact dents it, a journal may be behind it: the leg is set
        in motion again.
        """
        own, state = self._setup.surfaces.depth, self._stepper.state
        changed = (own != depth).any(axis=(1, 2))
        if (own - depth > _DENT_M).any():
            self.state.motion.runs = 0
        own[:] = depth
        if changed.any():
            self._repeating.cycles = ()
        state.pending[:, changed] = 0.0
        self._before[:, changed] = self.clearances[:, changed]

    def take_parameters(self, linkage: Linkage, friction: Floats, parameters: LegParameters) -> None:
        """Continue with other masses, lengths and friction coefficients (k,); the motion goes on.

        Behind a compliant drive, as in ``parameters``, the crank swings; the load has the shape of theirs.
        """
        self._load.rebuild(linkage, parameters.load)
        self._stepper.take_tables()
        model = self._stepper.model
        self._stepper.model = model._replace(coupling=drive_coupling(self._setup, model, parameters))
        contacts = self._setup.contacts
        contacts.friction[:, 0] = friction
        self._stepper.model.law[:] = contact_laws(contacts)
        self._repeating.cycles = ()

    def forget_torque(self) -> None:
        """Forget load, frictions and lag, and the torques that repeat: they are of an input with a fault."""
        self.estimate = cycle.LoadEstimate(self._loads[1], self._loads[0])
        self._repeating.cycles = ()
        self._load.set(self.estimate.acting)
        self._set_friction()

    def freeze_load(self, is_frozen: bool, clears: bool) -> bool:
        """Let the mean of the measured force act, and no sample change it; returns whether there is one.

        There is none if it ``clears``.
        """
        _, mean, learned = force_of(self._load.rows)
        if clears:
            mean[:], learned[:] = 0.0, 0.0
        if is_frozen and (clears or not self.state.push.is_frozen):
            set_force(self._load.rows, (mean, mean, learned))
        self.state.push.is_frozen = is_frozen
        return bool(learned.any())

    def follow(
        self, steps: Steps, n: int, cycles: list[CycleStatistics], events: list[Event]
    ) -> SampleStatistics:
        """Follow n steps; append finished gait cycles and events; returns statistics of the samples."""
        i, m = 0, 0
        room = evaluated, forces, eccentricities = self._room(n)
        while i < n:
            reason, i, k, m = follow(
                self._advance_address, self._stepper.model, self._setup.surfaces.feeds_back,
                self._stepper.state, self.statistics, self._stepper.work, self._sensor, self._load.signature,
                self._load.rows, self._leg, steps, i, n, m, *room,
            )  # fmt: skip
            if reason == CYCLE:
                self._end_cycle(k, cycles)
            elif reason == NEEDS_START:
                events.append(self._start(steps, i))
                i += int(steps["code"][i] != MOVE)
            elif reason in (LEFT, REPORTED):
                if reason == LEFT:
                    self.state.motion.runs, self.state.motion.lost = 0, 0
                events.append(Event(int(steps["begin_ns"][i]), _EVENT_KINDS[int(steps["detail"][i])]))
                i += 1
            elif reason != run.DONE:
                joint = self._setup.clearance_joints[k] if k >= 0 else None
                events.append(Event(int(self.state.motion.failed_at_ns), _FAILURES[reason], joint))
        stamp, kind, angle, torque, measured = (
            evaluated[name][:m] for name in follower_state.EVALUATED.names or ()
        )
        at = eccentricities[:m].reshape(m, forces.shape[1], 2)
        return SampleStatistics(stamp, kind, angle, torque, forces[:m], measured, at)

    def _room(self, n: int) -> tuple[Records, Floats, Floats]:
        """Room for n samples: `EVALUATED`, contact forces (n, k) [N], and eccentricities (n, 2 k) [m]."""
        joints = len(self._setup.clearance_joints)
        return new_records(n, follower_state.EVALUATED), np.zeros((n, joints)), np.zeros((n, 2 * joints))

    def compile(self, steps: Steps) -> None:
        """Compile the evaluation that follows the steps, without moving the leg."""
        compile_for(
            follow, 0, self._stepper.model, self._setup.surfaces.feeds_back, self._stepper.state,
            self.statistics, self._stepper.work, self._sensor, self._load.signature, self._load.rows,
            self._leg, steps, 0, 0, 0, *self._room(0),
        )  # fmt: skip

    def _start(self, steps: Steps, i: int) -> Event:
        """Set the leg in motion at the begin of step i, with its wear unchanged; returns the event."""
        motion, step = self.state.motion, steps[i]
        stamp, (angle, speed) = int(step["begin_ns"]), step["motion"][:2]
        kept = float(self.state.push.peak_n), int(self.state.push.is_frozen)
        for part in ("torque", "sums", "load", "push"):
            self.records[part] = 0
        self.state.push.peak_n, self.state.push.is_frozen = kept
        motion.base_ns = stamp - self._run_in(float(angle), float(speed))
        if motion.lost:
            motion.failed_ns += stamp - motion.failed_at_ns
        motion.piece_begin_ns = motion.piece_end_ns = stamp
        motion.lost = motion.anchored = motion.cut_ns = motion.cycle_begin_ns = motion.cycle_bridged_ns = 0
        motion.whole_cycles = motion.cycle_before_ns = 0
        motion.runs, motion.turns_before, self.state.low_pass.stage = 1, step["turns"], 0
        self._leg.polynomial[:] = 0.0, angle, speed, 0.0, 0.0, 0.0, 0.0
        cycle.clear_run_statistics(self.statistics)
        return Event(stamp, TwinEventKind.ACQUIRED)

    def _run_in(self, angle: float, speed: float) -> int:
        """Run the leg in up to a crank angle [rad] and speed [rad/s], without wear.

        Journals start centred, and their first impacts can be several times as large as in the gait: they
        must not be reported.

        Returns
        -------
        int
            Duration of the run-in [ns].
        """
        stepper, depth = self._stepper, self._setup.surfaces.depth
        intervals = round(_RUN_IN_S / stepper.model.interval)
        worn, time = depth.copy(), intervals * stepper.model.interval
        polynomial = run.steady_drive(angle - speed * time, speed)
        stepper.init(polynomial[1], speed)
        reached = stepper.advance(polynomial, 0.9 * time, self.statistics)[0]
        cycle.clear_run_statistics(self.statistics)
        if reached == run.DONE:
            reached = stepper.advance(polynomial, time, self.statistics)[0]
        depth[:] = worn
        stepper.drop_pending_wear()
        if reached != run.DONE:  # continue from centred journals; the next step reports the failure
            stepper.init(angle, speed)
            self._leg.force[:] = 0.0
            return 0
        self._leg.force[:] = stepper.last_force
        self.state.torque.mean_before = self.statistics.drive_integral[run.TORQUE] / self.statistics.time[0]
        return round(1.0e9 * time)

    def _end_cycle(self, stamp: int, cycles: list[CycleStatistics]) -> None:
        """Append the gait cycle that ends at a stamp [ns] if it is complete; begin the next one."""
        motion, depth = self.state.motion, self._setup.surfaces.depth
        if motion.cycle_is_whole:
            motion.cycles += 1
            not_compared, load_peak_n = self._why_not_compared(stamp), self._load.peak_n
            torque, profile = self._end_torque(not_compared is None)
            motion.whole_cycles += 1
            motion.cycle_before_ns = stamp - motion.cycle_begin_ns
            cycles.append(
                cycle.cycle_statistics(
                    self.state, stamp, self._setup.contacts, depth, self._before, self.statistics, torque,
                    profile, not_compared, load_peak_n,
                )
            )  # fmt: skip
        self._begin_cycle(stamp)

    def _begin_cycle(self, stamp: int) -> None:
        """Begin a gait cycle at a stamp [ns]."""
        motion = self.state.motion
        motion.cycle_begin_ns, motion.cycle_bridged_ns = stamp, 0
        self.state.push.peak_n = self.state.load.largest
        for part in ("sums", "load"):
            self.records[part] = 0
        cycle.clear_run_statistics(self.statistics)
        self._before = self.clearances

    def _why_not_compared(self, stamp: int) -> NotCompared | None:
        """Why the torque of the gait cycle that ends at a stamp [ns] is not compared; None if it is."""
        motion = self.state.motion
        if self.state.sums.number < cycle.LEAST_SAMPLES:
            return NotCompared.SAMPLES
        if motion.whole_cycles == 0:
            return NotCompared.FIRST
        if motion.cycle_bridged_ns > 0:
            return NotCompared.GAP
        duration = float(stamp - motion.cycle_begin_ns)
        if abs(duration / float(motion.cycle_before_ns) - 1.0) > _STEADY:
            return NotCompared.CADENCE
        return None

    def _end_torque(self, is_compared: bool) -> tuple[TorqueStatistics, TorqueProfile]:
        """Torque of the gait cycle that ends; the load that it shows acts from now on."""
        # number of independent samples after two equal low-pass stages
        independent = max(0.25 * self._cutoff * self.statistics.time[0], 1.0)
        sums = self.state.sums
        acting_n = self.estimate.acting
        profile = cycle.torque_profile(sums, acting_n)
        found = cycle.find(sums, sums.number / independent, self.estimate.room)
        if found is not None:
            self.estimate.take(found, self._acts)
            self._load.set(self.estimate.acting)
            self._set_friction()
        if found is not None and is_compared:
            self._repeating.take(sums.by_phase if self._instants else self._by_phase(profile, acting_n))
            if not self._is_load_known:
                self._choose_shape(acting_n)
        torque = cycle.torque_statistics(sums, found, self.estimate, self._unexplained_nm)
        return torque, profile

    def _choose_shape(self, acting_n: float) -> None:
        """Let the load have the other shape, where that explains much more of the torque."""
        left_nm = self._unexplained_nm
        if not left_nm > _NOTABLE * self.torque_size_nm:
            return
        shape = STANCE if self._load.shape == GROUND else GROUND
        other_m = self._by_phases(self._load.signature_of(shape))
        acting_n = acting_n if self._instants else 0.0
        other_nm, load_n = self._repeating.rms_nm(self._loads, other_m, acting_n, self._tolerated_nm)
        if self._beyond_shape(other_nm, shape, load_n) < _MUCH_LESS * left_nm:
            self._take_shape(shape)
            self.estimate.restart_load(load_n, self._acts)
            self._load.set(self.estimate.acting)

    def _by_phases(self, torque: Floats) -> Floats:
        """A torque (n,) over a turn at the commanded speed, by the phases of the residual."""
        phases = follower_state.PHASES if self._instants else follower_state.FINE_PHASES
        return cycle.behind_low_pass(torque, phases, self._cutoff, self._setup.speed, self._instants)

    def _of_person(self) -> Floats:
        """Torque that the person may be heavier by, by the phases of the residual."""
        mechanism = self._setup.linkage.mechanism
        return self._by_phases(heavier_person_torque(mechanism, POINTS, self._setup.speed))

    def _take_shape(self, shape: str) -> None:
        self._load.take_shape(shape)
        self._repeating.cycles = ()

    def _beyond_shape(self, left_nm: float, shape: str, load_n: float) -> float:
        """A residual [N m] less the residual that a different shape of the ground's force leaves."""
        other_nm = self._shape_torque * load_n if shape == GROUND else 0.0
        return math.sqrt(max(0.0, left_nm**2 - other_nm**2)) if math.isfinite(left_nm) else left_nm

    def _set_friction(self) -> None:
        """Predict torques behind the friction of the drive as estimated, as far as friction can be that."""
        constant, under_load = self.estimate.values[[follower_state.FRICTION, follower_state.LOAD_FRICTION]]
        most_nm = _LARGEST_FRICTION * self.torque_size_nm
        self._sensor["friction"] = min(max(float(constant), 0.0), most_nm)
        self._sensor["load_friction"] = under_load

    def _by_phase(self, profile: TorqueProfile, acting_n: float) -> Floats:
        """Residual (6, n) of the gait cycle that ends, of a sensor that averages."""
        direction = 1 if self.state.motion.cut_rises else -1
        lag_s = self._declared_lag_s, float(self.estimate.values[follower_state.LAG])
        duration_s = float(self.statistics.time[0])
        return cycle.averages_by_phase(profile, acting_n, lag_s, direction, duration_s, self._cutoff)

    @property
    def _unexplained_nm(self) -> float:
        """RMS of the residual that repeats and is not explained [N m]; NaN if unknown."""
        # the residual of averages refers to the torque without a load, the residual of instants does not
        loads = (-math.inf, math.inf) if self._instants else self._loads
        rms_nm, _ = self._repeating.rms_nm(loads, tolerated_nm=self._tolerated_nm)
        return self._beyond_shape(rms_nm, self._load.shape, float(self.estimate.values[follower_state.LOAD]))

    def snapshot(self) -> FollowerSnapshot:
        """A copy of the whole state, surfaces included."""
        return FollowerSnapshot(
            self._stepper.snapshot(),
            tuple(part.copy() for part in self._leg),
            tuple(part.copy() for part in self.statistics),
            self._before.copy(),
            self.estimate.state.copy(),
            self._repeating.cycles,
            force_of(self._load.rows),
            self._load.shape,
        )

    def restore(self, snapshot: FollowerSnapshot) -> None:
        """Restore a snapshot of a follower of the same setup and settings."""
        self._stepper.restore(snapshot.stepper)
        for own, saved in ((self._leg, snapshot.leg), (self.statistics, snapshot.statistics)):
            for part, values in zip(own, saved, strict=True):
                part[...] = values
        self._before = snapshot.before.copy()
        self.estimate.state[:] = snapshot.estimate
        self._take_shape(snapshot.load_shape)
        self._repeating.cycles = snapshot.repeating
        self._load.set(self.estimate.acting)
        set_force(self._load.rows, snapshot.load)
        self._set_friction()
