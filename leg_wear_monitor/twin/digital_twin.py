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

import numpy as np

from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, check_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin import statistics
from leg_wear_monitor.twin.follower import FollowerSnapshot, LegFollower
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import Samples, TwinSettings, gait_samples, intake
from leg_wear_monitor.twin.tracker import CrankTracker, TrackerSnapshot

TwinSnapshot = tuple[TrackerSnapshot, FollowerSnapshot, float, LegParameters]
"""Complete state of a twin: tracker, follower, factor on the wear, parameters of the leg."""


class DigitalTwin:
    """A leg with clearances that moves and wears according to measured samples.

    Parameters
    ----------
    mechanism : Mechanism
    settings : TwinSettings, optional

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

    def __init__(self, mechanism: Mechanism, settings: TwinSettings | None = None) -> None:
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
        self._follower = LegFollower(setup, self.settings)
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
        """Largest contact force (k,) [N] since the begin of the gait cycle."""
        return self._follower.peak_force_n

    @property
    def torque_size_nm(self) -> float:
        """RMS of the ideal drive torque at the commanded speed [N m]."""
        return self._follower.torque_size_nm

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

    def forget_torque(self) -> None:
        """Forget the results of the last gait cycles' drive torque, because its input had a fault."""
        self._follower.forget_torque()

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
            For a wrong shape, or for values that are negative or not finite.
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
                f"{joint}: no clearance joint. Expected one of {', '.join(self.clearance_joints)}"
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
