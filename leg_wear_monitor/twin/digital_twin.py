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

However the samples are cut into blocks, results are the same bit for bit. What the twin tells lags behind the
newest sample by `TrackerSettings.lag` and a little more: it waits for samples on both sides of an instant.
"""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.follower.follower import FollowerSnapshot, LegFollower
from leg_wear_monitor.twin.intake import intake
from leg_wear_monitor.twin.sample import Samples, gait_samples
from leg_wear_monitor.twin.settings import TwinSettings
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    Event,
    Intake,
    SampleStatistics,
    Tracking,
    TwinUpdate,
    joined,
)
from leg_wear_monitor.twin.tracker.tracker import CrankTracker, TrackerSnapshot


class TwinSnapshot(NamedTuple):
    """All of a twin; plain arrays and numbers."""

    tracker: TrackerSnapshot
    follower: FollowerSnapshot
    wear_acceleration: float


class DigitalTwin:
    """A leg with clearances that moves and wears in step with the samples it is given.

    Parameters
    ----------
    mechanism : Mechanism
    settings : TwinSettings, optional

    Attributes
    ----------
    settings : TwinSettings
    clearance_joints : tuple of str
        The clearance joints, in the order of all figures.

    Raises
    ------
    ConfigError, AssemblyError
        For a mechanism that cannot be followed.
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
        self._setup = setup
        self._nominal = setup.contacts.wear_coefficient.copy()
        self._follower = LegFollower(setup, self.settings)
        self._tracker = CrankTracker(self.settings.tracker)
        self.wear_acceleration = self.settings.wear_acceleration
        self._intake: Intake | None = None

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
        """Wear depth (clearance joints, 2, sectors) [m] of bushing and journal; a copy."""
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
        """Largest contact force (k,) [N] since the gait cycle began."""
        return np.asarray(self._follower.statistics.peak[self._setup.contacts.joint])

    @property
    def torque_size_nm(self) -> float:
        """RMS of the ideal drive torque at the commanded speed."""
        return self._follower.torque_size_nm

    @property
    def tracking(self) -> Tracking:
        """How the crank is followed."""
        return Tracking(int(self._tracker.state.clock.tracking))

    @property
    def speed_radps(self) -> float:
        """Speed of the crank at the last spline node [rad/s]."""
        return float(self._tracker.state.node.speed)

    @property
    def intake(self) -> Intake:
        """Counts since the twin was made."""
        if self._intake is None:  # it is asked for several times between two updates
            self._intake = intake(self._tracker.records, self._follower.records)
        return self._intake

    def set_depth(self, depth: Floats) -> None:
        """Set wear depths (clearance joints, 2, sectors) [m], as from a ledger.

        Raises
        ------
        LegWearError
            For another shape, or for values that are no depths.
        """
        own = self._setup.surfaces.depth
        if depth.shape != own.shape or not (np.isfinite(depth).all() and (depth >= 0.0).all()):
            raise LegWearError(f"depth: expected finite depths from 0 m up of shape {own.shape}")
        self._follower.take_surfaces(depth)

    def reset_wear(self, joint: str) -> None:
        """Fresh surfaces for a joint whose part was replaced.

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
        """Compile all that `update` needs, before the first sample; takes about a minute once.

        The motion comes last: a second process may be compiling it.
        """
        now = self.snapshot()
        self._follower.compile(self._tracker.steps)
        stamps = 1_000_000_000 + 5_000_000 * np.arange(150)
        angle = self.settings.tracker.commanded_speed_radps * 1.0e-9 * stamps
        self.update(gait_samples(stamps, crank_angle_rad=angle))
        self.restore(now)

    def update(self, samples: Samples) -> TwinUpdate:
        """Take in a block (n,) of `GAIT_SAMPLE` in order of arrival, and follow as far as can be."""
        looks: list[SampleStatistics] = []
        cycles: list[CycleStatistics] = []
        events: list[Event] = []
        self._intake = None
        for steps, n in self._tracker.update(samples):
            if n:
                looks.append(self._follower.follow(steps, n, cycles, events))
        return TwinUpdate(joined(looks, len(self.clearance_joints)), tuple(cycles), tuple(events))

    def snapshot(self) -> TwinSnapshot:
        """A copy of the whole state."""
        return TwinSnapshot(self._tracker.snapshot(), self._follower.snapshot(), self.wear_acceleration)

    def restore(self, snapshot: TwinSnapshot) -> None:
        """Go back to a snapshot of a twin of the same mechanism and settings."""
        self._intake = None
        self._tracker.restore(snapshot.tracker)
        self._follower.restore(snapshot.follower)
        self.wear_acceleration = snapshot.wear_acceleration
