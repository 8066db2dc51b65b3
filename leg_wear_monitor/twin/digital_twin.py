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

Results do not depend on the division of the samples into blocks, bit for bit. They lag behind the newest
sample by slightly more than `TrackerSettings.lag`, because the twin needs samples before and after an
instant.
"""

import math
from functools import cached_property

import attrs
import numpy as np

from leg_wear_monitor.compiled.kernel import Record, Records, compile_for, new_records, record_of
from leg_wear_monitor.dynamics import run
from leg_wear_monitor.dynamics.clearance.contact import contact_laws
from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import heavier_person_torque
from leg_wear_monitor.mechanism.position import TURN, build_linkage, check_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin import crank_motion, cycle, following
from leg_wear_monitor.twin.crank_motion import MOVE, Steps
from leg_wear_monitor.twin.following import CYCLE, LEFT, NEEDS_START, REPORTED, follow
from leg_wear_monitor.twin.load import FootLoad, shape_torque, torque_size
from leg_wear_monitor.twin.reference import LegParameters, drive_coupling
from leg_wear_monitor.twin.sample import (
    FOOT_FRAME,
    INSTANT,
    LOADS_N,
    MEASURED,
    Samples,
    TwinSettings,
    intake,
)
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    Event,
    Intake,
    NotCompared,
    SampleStatistics,
    TorqueProfile,
    TorqueStatistics,
    Tracking,
    TwinEventKind,
    TwinUpdate,
    joined,
    means_by_phase,
)
from leg_wear_monitor.twin.tracker import CrankTracker

_CUTOFF = TURN * 10.0  # rad/s: of the low-pass filter of measured and predicted torque
_DENT_M = 1.0e-5  # a third of the penetration under 10 kN
_RUN_IN_S = 0.2
_STEADY = 0.05  # relative difference of two gait cycles' durations beyond which the cadence changes
# fraction of the RMS torque: joints and gears lose some tenths; a larger constant torque is a bias
_MAX_FRICTION = 0.3
_LEAST_TORQUE_NM = 1.0e-6  # lower bound of the RMS torque, for a leg that needs no torque

_EVENT_KINDS = {
    crank_motion.LOST_IN_GAP: TwinEventKind.LOST_IN_GAP,
    crank_motion.LOST_BY_OUTLIERS: TwinEventKind.LOST_BY_OUTLIERS,
    crank_motion.LOST_BY_OVERFLOW: TwinEventKind.LOST_BY_OVERFLOW,
    crank_motion.LOST_BY_JUMP: TwinEventKind.BACKWARD_JUMP,
    crank_motion.STOPPED: TwinEventKind.STOPPED,
    crank_motion.MOVING: TwinEventKind.MOVING,
    crank_motion.REVERSED: TwinEventKind.REVERSED,
}
_FAILURES = {
    run.STEP_TOO_SMALL: TwinEventKind.STEP_TOO_SMALL,
    run.PUSHED_THROUGH: TwinEventKind.PUSHED_THROUGH,
    run.INVALID_DRIVE: TwinEventKind.INVALID_DRIVE,
}


class DigitalTwin:
    """A leg with clearances that moves and wears according to measured samples.

    Parameters
    ----------
    mechanism : Mechanism
    settings : TwinSettings, optional

    Attributes
    ----------
    mechanism : Mechanism
        The mechanism as it was given.
    settings : TwinSettings
    clearance_joints : tuple of str
        The clearance joints, in the order of all arrays.
    parameters : LegParameters
        Factors on the parameters of the mechanism, the compliance of its drive, and the load's shape.
    estimate : LoadEstimate
        Foot load, friction and lag by the drive torque.
    torque_size_nm : float
        RMS of the ideal drive torque at the commanded speed.
    max_friction_nm : float
        Largest constant torque that counts as friction.

    Raises
    ------
    ConfigError
        For a mechanism without clearance joints.
    AssemblyError
        If the linkage does not close or has a dead point.
    """

    def __init__(self, mechanism: Mechanism, settings: TwinSettings | None = None) -> None:
        self.mechanism, self.settings = mechanism, settings or TwinSettings()
        settings, commanded = self.settings, self.settings.tracker.commanded_speed_radps
        setup = self._setup = prepare(mechanism, speed_rpm=60.0 * commanded / TURN, wear=True)
        if not setup.clearance_joints:
            raise ConfigError(
                mechanism.source, "clearances.joints", "no joint has clearance, so nothing can wear"
            )
        self.clearance_joints = setup.clearance_joints
        self.parameters = LegParameters.none(mechanism)
        self._nominal = setup.contacts.wear_coefficient.copy()
        self._friction = setup.contacts.friction[:, 0].copy()
        self.wear_acceleration = settings.wear_acceleration
        self._tracker = CrankTracker(settings.tracker)
        self._intake: Intake | None = None
        is_measured = settings.load_model == MEASURED
        # with a measured load, the estimated load is only the excess that the torque shows
        self._acts = settings.estimate_load and not is_measured
        is_of_foot = settings.load_frame == FOOT_FRAME
        self._load = FootLoad(setup.linkage, setup.contacts, is_measured, is_of_foot)
        # a whole number of nanoseconds, so that the stepper's time does not drift from the stamps
        interval = round(1.0e9 * TURN / abs(setup.speed) / INTERVALS) * 1.0e-9
        self._stepper = ClearanceStepper(setup, interval, tables=self._load.tables)
        self._leg: following.FollowerState = following.leg_state(len(setup.clearance_joints))
        self._state: Record = record_of(self._leg.records)
        # of the present gait cycle
        self._statistics = run.new_run_statistics(len(setup.linkage.mechanism.joints))
        self._shape_torque = 0.0 if is_measured else shape_torque(setup.linkage)
        self.torque_size_nm = max(torque_size(setup.linkage, setup.speed), _LEAST_TORQUE_NM)
        self.max_friction_nm = _MAX_FRICTION * self.torque_size_nm
        self._instants = settings.torque_sampling == INSTANT
        kept = (
            (cycle.INSTANT_CYCLES, cycle.INSTANT_CYCLES)
            if self._instants
            else (cycle.CYCLES, cycle.LEAST_CYCLES)
        )
        self._repeating = cycle.RepeatingResidual(*kept)
        self._tolerated_nm = self._of_person() if mechanism.person_kg else None
        self._sensor = new_records(1, following.TORQUE_SENSOR)
        self._sensor[0] = _CUTOFF, self.torque_size_nm, self._instants, 0.0, 0.0
        self._before = self._clearances
        self.estimate = cycle.LoadEstimate()

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
    def _clearances(self) -> Floats:
        """Mean and largest radial clearance (2, k) [m]."""
        return cycle.clearances(self._setup.contacts, self._setup.surfaces.depth)

    @property
    def clearance_mean_m(self) -> Floats:
        """Mean radial clearance (k,) [m]."""
        return np.asarray(self._clearances[0])

    @property
    def clearance_max_m(self) -> Floats:
        """Largest radial clearance (k,) [m]."""
        return np.asarray(self._clearances[1])

    @property
    def peak_force_n(self) -> Floats:
        """Largest contact force (k,) [N] since the begin of the gait cycle."""
        return np.asarray(self._statistics.peak[self._setup.contacts.joint])

    @property
    def tracking(self) -> Tracking:
        """State of the crank tracking."""
        return Tracking(int(self._tracker.state.clock.tracking))

    @property
    def speed_radps(self) -> float:
        """Crank speed at the last spline node [rad/s]."""
        return float(self._tracker.state.node.speed)

    @property
    def intake(self) -> Intake:
        """Counts of samples and times since the twin was created."""
        if self._intake is None:  # needed several times between two updates
            self._intake = intake(self._tracker.records, self._leg.records, self.settings.kinds)
        return self._intake

    def set_parameters(self, parameters: LegParameters) -> None:
        """Continue with other masses, lengths, friction and drive; motion and wear stay.

        Behind a compliant drive the crank swings; the load has the same shape as in ``parameters``.

        Raises
        ------
        AssemblyError
            If the linkage does not close or has a dead point.
        """
        if parameters == self.parameters:
            return
        linkage = build_linkage(parameters.in_air.applied(self.mechanism))
        check_cycle(linkage)
        self._load.rebuild(linkage, parameters.load)
        self._stepper.take_tables()
        model, contacts = self._stepper.model, self._setup.contacts
        self._stepper.model = model._replace(coupling=drive_coupling(self._setup, model, parameters))
        contacts.friction[:, 0] = parameters.friction * self._friction
        model.law[:] = contact_laws(contacts)
        self._repeating.cycles = ()
        self.parameters = parameters

    def forget_torque(self) -> None:
        """Forget load, frictions, lag and repeating torques, because the torque's input had a fault."""
        self.estimate = cycle.LoadEstimate()
        self._repeating.cycles = ()
        self._load.set(self.estimate.acting)
        self._set_friction()

    def freeze_load(self, is_frozen: bool, clears: bool = False) -> bool:
        """Continue with the measured load of the previous gait cycles, because the samples are wrong.

        Parameters
        ----------
        is_frozen : bool
            False to take samples again.
        clears : bool, optional
            True if the load of the gait cycles before was wrong as well: then none acts.

        Returns
        -------
        bool
            True if a mean load of gait cycles is known.
        """
        rows = self._load.rows
        if clears:
            rows.mean[:], rows.learned[:] = 0.0, 0.0
            self._load.take_mean()
        self._state.last_load.is_frozen = is_frozen
        return bool(rows.learned.any())

    def set_depth(self, depth: Floats) -> None:
        """Set wear depths (k, 2, N) [m], for instance from a ledger.

        For changed joints, the growth of the gait cycle counts from there. Where a wall comes closer by more
        than an impact dents it, a journal may be behind it: the leg is set in motion again.

        Raises
        ------
        LegWearError
            For a wrong shape, or for values that are negative or not finite.
        """
        own = self._setup.surfaces.depth
        if depth.shape != own.shape or not (np.isfinite(depth).all() and (depth >= 0.0).all()):
            raise LegWearError(f"depth: expected finite depths from 0 m up of shape {own.shape}")
        changed = (own != depth).any(axis=(1, 2))
        if (own - depth > _DENT_M).any():
            self._state.motion.runs = 0
        own[:] = depth
        if changed.any():
            self._repeating.cycles = ()
        self._stepper.state.pending[:, changed] = 0.0
        self._before[:, changed] = self._clearances[:, changed]

    def reset_wear(self, joint: str) -> None:
        """Set the wear of a joint to 0 after a replacement of its parts.

        Raises
        ------
        LegWearError
            For a joint without clearance.
        """
        if joint not in self.clearance_joints:
            raise LegWearError(
                f"{joint}: no clearance joint. Expected one of {', '.join(self.clearance_joints)}"
            )
        depth = self.depth
        depth[self.clearance_joints.index(joint)] = 0.0
        self.set_depth(depth)

    def warm_up(self) -> None:
        """Compile everything that `update` needs, before the first sample; takes about a minute once.

        The motion comes last, because a second process may be compiling it.
        """
        self._tracker.compile()
        compile_for(
            follow, 0, self._stepper.model, self._setup.surfaces.feeds_back, self._stepper.state,
            self._statistics, self._stepper.work, self._sensor, self._load.signature, self._load.rows,
            self._leg, self._tracker.steps, 0, 0, 0, *self._room(0),
        )  # fmt: skip
        _ = self._advance_address

    @cached_property
    def _advance_address(self) -> int:
        return self._stepper.advance_address(self._leg.polynomial, self._statistics)

    def update(self, samples: Samples) -> TwinUpdate:
        """Process a block (n,) of `GAIT_SAMPLE` in order of arrival, as far as the lag allows."""
        evaluated: list[SampleStatistics] = []
        cycles: list[CycleStatistics] = []
        events: list[Event] = []
        self._intake = None
        for steps, n in self._tracker.update(samples):
            if n:
                evaluated.append(self._follow(steps, n, cycles, events))
        return TwinUpdate(joined(evaluated, len(self.clearance_joints)), tuple(cycles), tuple(events))

    def _follow(
        self, steps: Steps, n: int, cycles: list[CycleStatistics], events: list[Event]
    ) -> SampleStatistics:
        """Follow n steps; append finished gait cycles and events; returns statistics of the samples."""
        i, m = 0, 0
        room = evaluated, forces = self._room(n)
        while i < n:
            reason, i, k, m = follow(
                self._advance_address, self._stepper.model, self._setup.surfaces.feeds_back,
                self._stepper.state, self._statistics, self._stepper.work, self._sensor, self._load.signature,
                self._load.rows, self._leg, steps, i, n, m, *room,
            )  # fmt: skip
            if reason == CYCLE:
                self._end_cycle(k, cycles)
            elif reason == NEEDS_START:
                events.append(self._start(steps, i))
                i += int(steps["code"][i] != MOVE)
            elif reason in (LEFT, REPORTED):
                if reason == LEFT:
                    self._state.motion.runs, self._state.motion.lost = 0, 0
                events.append(Event(int(steps["begin_ns"][i]), _EVENT_KINDS[int(steps["detail"][i])]))
                i += 1
            elif reason != run.DONE:
                joint = self.clearance_joints[k] if k >= 0 else None
                events.append(Event(int(self._state.motion.failed_at_ns), _FAILURES[reason], joint))
        stamp, kind, angle, torque = (evaluated[name][:m] for name in following.EVALUATED.names or ())
        return SampleStatistics(stamp, kind, angle, torque, forces[:m])

    def _room(self, n: int) -> tuple[Records, Floats]:
        """Room for n samples: `EVALUATED`, and contact forces (n, k) [N]."""
        return new_records(n, following.EVALUATED), np.zeros((n, len(self.clearance_joints)))

    def _start(self, steps: Steps, i: int) -> Event:
        """Set the leg in motion at the begin of step i, with its wear unchanged; returns the event."""
        motion, step = self._state.motion, steps[i]
        stamp, (angle, speed) = int(step["begin_ns"]), step["motion"][:2]
        for part in ("torque", "sums", "load"):
            self._leg.records[part] = 0
        self._state.last_load.stamp_ns = 0
        motion.base_ns = stamp - self._run_in(float(angle), float(speed))
        if motion.lost:
            motion.failed_ns += stamp - motion.failed_at_ns
        motion.piece_begin_ns = motion.piece_end_ns = stamp
        motion.lost = motion.anchored = motion.cut_ns = motion.cycle_begin_ns = motion.cycle_bridged_ns = 0
        motion.whole_cycles = motion.cycle_before_ns = 0
        motion.runs, motion.turns_before, self._state.low_pass.stage = 1, step["turns"], 0
        self._leg.polynomial[:] = 0.0, angle, speed, 0.0, 0.0, 0.0, 0.0
        cycle.clear_run_statistics(self._statistics)
        return Event(stamp, TwinEventKind.ACQUIRED)

    def _run_in(self, angle: float, speed: float) -> int:
        """Let the leg run in, up to a crank angle [rad] and speed [rad/s], without wear.

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
        reached = stepper.advance(polynomial, 0.9 * time, self._statistics)[0]
        cycle.clear_run_statistics(self._statistics)
        if reached == run.DONE:
            reached = stepper.advance(polynomial, time, self._statistics)[0]
        depth[:] = worn
        stepper.state.pending[:] = 0.0
        if reached != run.DONE:  # continue from centred journals; the next step reports the failure
            stepper.init(angle, speed)
            self._leg.force[:] = 0.0
            return 0
        self._leg.force[:] = stepper.last_force
        self._state.torque.mean_before = (
            self._statistics.drive_integral[run.TORQUE] / self._statistics.time[0]
        )
        return round(1.0e9 * time)

    def _end_cycle(self, stamp: int, cycles: list[CycleStatistics]) -> None:
        """Append the gait cycle that ends at a stamp [ns] if it is complete; begin the next cycle."""
        motion, depth = self._state.motion, self._setup.surfaces.depth
        if motion.cycle_is_whole:
            motion.cycles += 1
            not_compared, load_peak_n = self._why_not_compared(stamp), self._load.peak_n
            torque, profile = self._end_torque(not_compared is None)
            self._load.take_mean()
            motion.whole_cycles += 1
            motion.cycle_before_ns = stamp - motion.cycle_begin_ns
            cycles.append(
                cycle.cycle_statistics(
                    self._state, stamp, self._setup.contacts, depth, self._before, self._statistics, torque,
                    profile, not_compared, load_peak_n,
                )
            )  # fmt: skip
        self._begin_cycle(stamp)

    def _begin_cycle(self, stamp: int) -> None:
        """Begin a gait cycle at a stamp [ns]."""
        motion = self._state.motion
        motion.cycle_begin_ns, motion.cycle_bridged_ns = stamp, 0
        for part in ("sums", "load"):
            self._leg.records[part] = 0
        cycle.clear_run_statistics(self._statistics)
        self._before = self._clearances

    def _why_not_compared(self, stamp: int) -> NotCompared | None:
        """Why the torque of the gait cycle that ends at a stamp [ns] is not compared; None if it is."""
        motion = self._state.motion
        if self._state.sums.number < cycle.LEAST_SAMPLES:
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
        """Torque of the gait cycle that ends; the load estimated from it acts from now on."""
        # number of independent samples after two equal low-pass stages
        independent = max(0.25 * _CUTOFF * self._statistics.time[0], 1.0)
        sums = self._state.sums
        acting_n = self.estimate.acting
        profile, step_nm = cycle.torque_profile(sums, acting_n), self._step_torque()
        profile = attrs.evolve(profile, predicted_nm=profile.predicted_nm + profile.number * step_nm)
        found = cycle.find(sums, sums.number / independent, self.estimate.room)
        if found is not None:
            self.estimate.take(*found[:2], self._acts)
            self._load.set(self.estimate.acting)
            self._set_friction()
        if found is not None and is_compared:
            self._repeating.take(self._by_phase(profile, acting_n, step_nm))
        return cycle.torque_statistics(sums, self.estimate, self._unexplained_nm), profile

    def _step_torque(self) -> Floats:
        """Torque (FINE_PHASES,) of the measured load of this gait cycle less the mean that acted [N m]."""
        load, mean_n, phases = (
            cycle.load_profile(self._state),
            self._load.acting_n,
            following.FINE_PHASES,
        )
        acts = self._load.rows.learned.any() and mean_n.any() and not self._state.last_load.is_frozen
        if load is None or not acts:
            return np.zeros(phases)
        middles = np.arange(POINTS // phases // 2, POINTS, POINTS // phases)
        departure = means_by_phase(load.number, load.force_n) - mean_n[middles].T
        return np.asarray(-(departure * self._load.toe_m[middles].T).sum(axis=0))  # by virtual work

    def _by_phases(self, torque: Floats) -> Floats:
        """A torque (n,) over a turn at the commanded speed, by the phases of the residual."""
        phases = following.PHASES if self._instants else following.FINE_PHASES
        return cycle.behind_low_pass(torque, phases, _CUTOFF, self._setup.speed, self._instants)

    def _of_person(self) -> Floats:
        """Torque that the person may be heavier by, by the phases of the residual."""
        return self._by_phases(heavier_person_torque(self.mechanism, POINTS, self._setup.speed))

    def _set_friction(self) -> None:
        """Predict torques behind the friction of the drive as estimated, as far as friction can be that."""
        constant, under_load = self.estimate.values[[following.FRICTION, following.LOAD_FRICTION]]
        self._sensor["friction"] = min(max(float(constant), 0.0), self.max_friction_nm)
        self._sensor["load_friction"] = under_load

    def _by_phase(self, profile: TorqueProfile, acting_n: float, step_nm: Floats) -> Floats:
        """Residual (6, n) of the gait cycle that ends."""
        if self._instants:
            by_phase: Floats = self._state.sums.by_phase.copy()
            by_phase[1] -= by_phase[0] * self._by_phases(step_nm)
            return by_phase
        direction = 1 if self._state.motion.cut_rises else -1
        lag_s = self.settings.torque_lag_s, float(self.estimate.values[following.LAG])
        duration_s = float(self._statistics.time[0])
        return cycle.averages_by_phase(profile, acting_n, lag_s, direction, duration_s, _CUTOFF)

    @property
    def _unexplained_nm(self) -> float:
        """RMS of the residual that repeats and is not explained [N m]; NaN if unknown."""
        # the residual of averages refers to the torque without a load, the residual of instants does not
        loads = (-math.inf, math.inf) if self._instants else LOADS_N
        left_nm = self._repeating.rms_nm(loads, self._tolerated_nm)
        # because steps differ from the template
        step_nm = self._shape_torque * float(self.estimate.values[following.LOAD])
        return math.sqrt(max(0.0, left_nm**2 - step_nm**2)) if math.isfinite(left_nm) else left_nm
