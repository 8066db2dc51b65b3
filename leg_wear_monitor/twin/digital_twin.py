"""The leg, in step with a real one: samples in, forces and wear out.

::

    twin = DigitalTwin(mechanism, TwinSettings())       # builds tables; twin.warm_up() compiles
    update = twin.update(samples)                       # a block, in order of arrival, any size
    update.samples, update.cycles, update.events        # see figures
    twin.tracking, twin.speed_radps, twin.intake        # how it goes
    twin.clearance_mean_m, twin.depth                   # wear now
    twin.set_depth(depth), twin.reset_wear("G")         # from a ledger; a part was replaced
    twin.wear_acceleration = 100.0                      # may change at any time
    snapshot = twin.snapshot(); twin.restore(snapshot)  # goes on bit for bit

However the samples are cut into blocks, results are the same bit for bit.
"""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance_run import ClearanceStepper, usual_intervals
from leg_wear_monitor.dynamics.clearance_run import Snapshot as StepperSnapshot
from leg_wear_monitor.dynamics.run import DONE, INVALID_DRIVE, PUSHED_THROUGH, STEP_TOO_SMALL
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin import steps as told
from leg_wear_monitor.twin.cycle import clear_tally, clearances, cycle_figures, torque_figures
from leg_wear_monitor.twin.figures import (
    CycleFigures,
    Event,
    Happening,
    Intake,
    SampleFigures,
    Tracking,
    TwinUpdate,
    no_samples,
)
from leg_wear_monitor.twin.intake import intake
from leg_wear_monitor.twin.leg_kernel import CYCLE, LEFT, NEEDS_START, TOLD, follow
from leg_wear_monitor.twin.leg_state import (
    AFRESH,
    ANCHORED,
    BASE,
    CUT,
    CYCLE_BEGIN,
    CYCLE_BRIDGED,
    CYCLES,
    FAILED_AT,
    FAILED_NS,
    FILTERING,
    LOOKS,
    PIECE_BEGIN,
    PIECE_END,
    RUNNING,
    TURNS_BEFORE,
    WHOLE,
    LegState,
    Looks,
    leg_state,
    room_for_looks,
)
from leg_wear_monitor.twin.load import FootLoad, estimate_load
from leg_wear_monitor.twin.sample import Samples, gait_samples
from leg_wear_monitor.twin.settings import TwinSettings
from leg_wear_monitor.twin.steps import BEGIN, EXTRA, MOVE, TURNS, Steps
from leg_wear_monitor.twin.tracker import CrankTracker, TrackerSnapshot
from leg_wear_monitor.twin.tracker_state import TRACKING

_HAPPENINGS = {
    told.LOST_IN_GAP: Happening.LOST_IN_GAP,
    told.LOST_BY_OUTLIERS: Happening.LOST_BY_OUTLIERS,
    told.LOST_BY_OVERFLOW: Happening.LOST_BY_OVERFLOW,
    told.LOST_BY_JUMP: Happening.BACKWARD_JUMP,
    told.STOPPED: Happening.STOPPED,
    told.MOVING: Happening.MOVING,
    told.REVERSED: Happening.REVERSED,
}
_FAILURES = {
    STEP_TOO_SMALL: Happening.STEP_TOO_SMALL,
    PUSHED_THROUGH: Happening.PUSHED_THROUGH,
    INVALID_DRIVE: Happening.INVALID_DRIVE,
}


class TwinSnapshot(NamedTuple):
    """All of a twin; plain arrays and numbers."""

    tracker: TrackerSnapshot
    stepper: StepperSnapshot
    leg: tuple[np.ndarray, ...]
    tally: tuple[np.ndarray, ...]
    before: Floats
    numbers: tuple[float, float, float]


class DigitalTwin:
    """A leg with clearances that moves and wears in step with the samples it is given.

    Parameters
    ----------
    mechanism : Mechanism
    settings : TwinSettings, optional

    Attributes
    ----------
    loose : tuple of str
        The loose joints, in the order of all figures.
    load_n, friction_nm : float
        Foot load at work in the model, and friction of the drive, as last estimated.

    Raises
    ------
    ConfigError, AssemblyError
        For a mechanism that cannot be followed.
    """

    def __init__(self, mechanism: Mechanism, settings: TwinSettings | None = None) -> None:
        self.settings = settings or TwinSettings()
        commanded = self.settings.tracker.commanded_speed_radps
        setup = prepare(
            mechanism, clearances=self.settings.loose, speed_rpm=60.0 * commanded / TURN, wear=True
        )
        if not setup.loose:
            raise ConfigError(mechanism.source, "clearances.joints", "no joint is loose, nothing can wear")
        self.loose = setup.loose
        self._nominal = setup.contacts.wear_coefficient.copy()
        self._load = FootLoad(setup.linkage, setup.contacts)
        # a whole number of nanoseconds, so that stamps and the stepper's time cannot drift apart
        interval = round(1.0e9 * TURN / abs(setup.speed) / usual_intervals(setup)) * 1.0e-9
        self._setup = setup
        self._stepper = ClearanceStepper(setup, interval, tables=self._load.tables)
        self._tracker = CrankTracker(self.settings.tracker)
        self._leg: LegState = leg_state(len(self.loose))
        self._tally = new_tally(len(mechanism.joints))
        self._cutoff = TURN * self.settings.torque_bandwidth_hz
        self._before = clearances(setup.contacts, self.depth)
        self.load_n, self.friction_nm = 0.0, 0.0
        self.wear_acceleration = self.settings.wear_acceleration

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
    def depth(self) -> Floats:
        """Wear depth (loose, 2, sectors) [m] of bushing and journal; a copy."""
        return self._setup.surfaces.depth.copy()

    @property
    def clearance_mean_m(self) -> Floats:
        """Mean radial clearance (loose,) [m]."""
        return np.asarray(clearances(self._setup.contacts, self._setup.surfaces.depth)[0])

    @property
    def clearance_max_m(self) -> Floats:
        """Largest radial clearance (loose,) [m]."""
        return np.asarray(clearances(self._setup.contacts, self._setup.surfaces.depth)[1])

    @property
    def peak_force_n(self) -> Floats:
        """Largest contact force (loose,) [N] since the gait cycle began."""
        return np.asarray(self._tally.peak[self._setup.contacts.joint])

    @property
    def tracking(self) -> Tracking:
        """How the crank is followed."""
        return Tracking(int(self._tracker.state.clock[TRACKING]))

    @property
    def speed_radps(self) -> float:
        """Speed of the crank at the last knot [rad/s]."""
        return float(self._tracker.state.target[1])

    @property
    def intake(self) -> Intake:
        """Counts since the twin was made."""
        return intake(self._tracker.state, self._leg)

    def set_depth(self, depth: Floats) -> None:
        """Take over wear depths (loose, 2, sectors) [m], as from a ledger.

        Raises
        ------
        LegWearError
            For another shape, or for values that are no depths.
        """
        own = self._setup.surfaces.depth
        if depth.shape != own.shape or not (np.isfinite(depth).all() and (depth >= 0.0).all()):
            raise LegWearError(f"depth: expected finite depths from 0 m up of shape {own.shape}")
        own[:] = depth
        self._stepper.state.pending[:] = 0.0
        self._stepper.state.local[:] = np.nan
        self._before = clearances(self._setup.contacts, own)

    def reset_wear(self, joint: str) -> None:
        """Fresh surfaces for a joint whose part was replaced.

        Raises
        ------
        LegWearError
            For a joint that is not loose.
        """
        if joint not in self.loose:
            raise LegWearError(f"{joint}: no loose joint, expected one of {', '.join(self.loose)}")
        depth = self.depth
        depth[self.loose.index(joint)] = 0.0
        self.set_depth(depth)

    def warm_up(self) -> None:
        """Compile all that `update` needs, before the first sample; takes about a minute once."""
        now = self.snapshot()
        stamps = 1_000_000_000 + 5_000_000 * np.arange(150)
        angle = self.settings.tracker.commanded_speed_radps * 1.0e-9 * stamps
        self.update(gait_samples(stamps, crank_angle_rad=angle))
        self.restore(now)

    def update(self, samples: Samples) -> TwinUpdate:
        """Take in a block (n,) of `GAIT_SAMPLE` in order of arrival, and follow as far as can be."""
        looks: list[SampleFigures] = []
        cycles: list[CycleFigures] = []
        events: list[Event] = []
        for steps, n in self._tracker.update(samples):
            if n:
                looks.append(self._follow(steps, n, cycles, events))
        return TwinUpdate(_join(looks, len(self.loose)), tuple(cycles), tuple(events))

    def _follow(self, steps: Steps, n: int, cycles: list[CycleFigures], events: list[Event]) -> SampleFigures:
        """Follow n steps."""
        mark, i = self._leg.mark, 0
        seen = room_for_looks(n, len(self.loose))
        mark[LOOKS] = 0
        while i < n:
            reason, i, k = follow(
                self._stepper.model, self._setup.surfaces.feeds_back, self._stepper.state, self._tally,
                self._stepper.work, self._cutoff, self._load.signature, self._leg, steps, i, n, seen,
            )  # fmt: skip
            if reason == CYCLE:
                self._end_cycle(k, cycles)
            elif reason == NEEDS_START:
                events.append(self._start(steps, i))
                i += int(steps.what[i, told.CODE] != MOVE)
            elif reason in (LEFT, TOLD):
                if reason == LEFT:
                    mark[RUNNING], mark[AFRESH] = 0, 0
                events.append(Event(int(steps.what[i, BEGIN]), _HAPPENINGS[int(steps.what[i, EXTRA])]))
                i += 1
            elif reason != DONE:
                joint = self.loose[k] if k >= 0 else None
                events.append(Event(int(mark[FAILED_AT]), _FAILURES[reason], joint))
        return _figures(seen, int(mark[LOOKS]))

    def _start(self, steps: Steps, i: int) -> Event:
        """Set the leg in motion where step i begins: journals centred, wear as it was."""
        mark, stamp = self._leg.mark, int(steps.what[i, BEGIN])
        angle, speed = steps.motion[i, :2]
        self._stepper.init(float(angle), float(speed))
        if mark[AFRESH]:
            mark[FAILED_NS] += stamp - mark[FAILED_AT]
        for where in (BASE, PIECE_BEGIN, PIECE_END):
            mark[where] = stamp
        for where in (AFRESH, ANCHORED, CUT, FILTERING, CYCLE_BEGIN, CYCLE_BRIDGED):
            mark[where] = 0
        mark[RUNNING], mark[TURNS_BEFORE] = 1, steps.what[i, TURNS]
        self._leg.polynomial[:] = 0.0, angle, speed, 0.0, 0.0, 0.0, 0.0
        for part in (self._leg.value, self._leg.sums, self._leg.force):
            part[:] = 0.0
        clear_tally(self._tally)
        return Event(stamp, Happening.ACQUIRED)

    def _end_cycle(self, stamp: int, cycles: list[CycleFigures]) -> None:
        """Report the gait cycle that ends at a stamp, if it is a whole one; begin the next."""
        mark, sums, depth = self._leg.mark, self._leg.sums, self._setup.surfaces.depth
        if mark[WHOLE]:
            mark[CYCLES] += 1
            found = estimate_load(sums)
            load = self.load_n
            if found is not None:
                gain, limit = self.settings.load_gain, self.settings.load_limit_n
                self.friction_nm += gain * (found.friction - self.friction_nm)
                self.load_n = float(np.clip(load + gain * found.load, -limit, limit))
            torque = torque_figures(sums, found, self.load_n, self.friction_nm)
            cycles.append(
                cycle_figures(
                    self._leg, stamp, self._setup.contacts, depth, self._before, self._tally, torque
                )
            )
            if self.settings.estimate_load and self.load_n != load:
                self._load.set(self.load_n)
        mark[CYCLE_BEGIN], mark[CYCLE_BRIDGED] = stamp, 0
        sums[:] = 0.0
        clear_tally(self._tally)
        self._before = clearances(self._setup.contacts, depth)

    def snapshot(self) -> TwinSnapshot:
        """A copy of the whole state."""
        return TwinSnapshot(
            self._tracker.snapshot(),
            self._stepper.snapshot(),
            tuple(part.copy() for part in self._leg),
            tuple(part.copy() for part in self._tally),
            self._before.copy(),
            (self.load_n, self.friction_nm, self.wear_acceleration),
        )

    def restore(self, snapshot: TwinSnapshot) -> None:
        """Go back to a snapshot of a twin of the same mechanism and settings."""
        self._tracker.restore(snapshot.tracker)
        self._stepper.restore(snapshot.stepper)
        for own, saved in ((self._leg, snapshot.leg), (self._tally, snapshot.tally)):
            for part, values in zip(own, saved, strict=True):
                part[...] = values
        self._before = snapshot.before.copy()
        self.load_n, self.friction_nm, self.wear_acceleration = snapshot.numbers
        self._load.set(self.load_n if self.settings.estimate_load else 0.0)


def _figures(seen: Looks, n: int) -> SampleFigures:
    """The first n looks."""
    return SampleFigures(
        seen.stamp[:n, 0], seen.stamp[:n, 1], seen.figure[:n, 0], seen.figure[:n, 1], seen.force[:n]
    )


def _join(parts: list[SampleFigures], loose: int) -> SampleFigures:
    """Figures of one chunk after the other."""
    if len(parts) < 2:
        return parts[0] if parts else no_samples(loose)
    names = [field.name for field in attrs.fields(SampleFigures)]
    return SampleFigures(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
