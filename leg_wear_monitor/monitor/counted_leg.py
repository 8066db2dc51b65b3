"""The wear model of this leg: the twin, its wear in the ledger, its growth, measurements and forecast."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.estimate.cause import Change
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import bushing_of
from leg_wear_monitor.mechanism.person import with_toe_force
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.config.fitting import fitted, twin_settings
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow
from leg_wear_monitor.monitor.forecast.model_error import ModelError, model_error
from leg_wear_monitor.monitor.ledger.entry import Audit, CorrectedClearance, IdentifiedLeg, Measurement
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import GROUND


class CountedLeg:
    """The wear model of this leg; observers read it, and correct it.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    ledger : Ledger or None

    Attributes
    ----------
    mechanism : Mechanism
        With the clearance joints and clearances of the configuration.
    config : MonitorConfig
        Replaced when parameters change.
    growth : tuple of GrowthWindow
    last : CycleReport or None
        The last gait cycle of this run.
    """

    def __init__(self, mechanism: Mechanism, config: MonitorConfig, ledger: Ledger | None) -> None:
        self.config, self.ledger = config, ledger
        self.mechanism = fitted(mechanism, config)
        self.clearance_joints = self.mechanism.clearance_joints
        self.twin = DigitalTwin(self.mechanism, twin_settings(config))
        self.accounting = Accounting(self.twin, ledger, config.ledger)
        self.bushings = {joint: bushing_of(self.mechanism, joint) for joint in self.clearance_joints}
        self.forecaster = Forecaster(
            self.mechanism,
            config.forecast,
            ledger.measurements if ledger else (),
            self.accounting.replaced_ns,
            ledger.corrections if ledger else (),
        )
        self.growth = tuple(GrowthWindow() for _ in self.clearance_joints)
        self.last: CycleReport | None = None
        self._error: tuple[LegParameters, ModelError] | None = None
        self.new_m = [self.mechanism.clearances[joint].radial_clearance for joint in self.clearance_joints]

    @property
    def model_error(self) -> ModelError:
        """Error of the growth from masses and from an estimated load; a measured load is known."""
        own, speed = self.twin.parameters, self.twin.settings.tracker.commanded_speed_radps
        if self._error is None or self._error[0] is not own:
            sigma = own.load_sigma if self.config.load.model == GROUND else 0.0
            leg = with_toe_force(self.mechanism, own.load) if own.load.size else self.mechanism
            self._error = own, model_error(leg, speed, self.config.wear_acceleration, sigma)
        return self._error[1]

    def worn_m(self, clearance_m: Floats) -> Floats:
        """Wear of each part at some mean clearances [m]."""
        return np.asarray(clearance_m - self.new_m)

    def grows_anew(self, joints: Sequence[str]) -> None:
        """Discard the growth of some joints, because it belongs to a different leg."""
        each = zip(self.clearance_joints, self.growth, strict=True)
        self.growth = tuple(GrowthWindow() if name in joints else window for name, window in each)

    @property
    def measured(self) -> tuple[Measurement | None, ...]:
        """Last measured clearance of each joint's present part."""
        return self.forecaster.last_measured(self.accounting.replaced_ns)

    def correct(self, change: Change) -> None:
        """Open a joint to the clearance that the drive torque shows, and count its wear from there."""
        stamp_ns, joint = self.twin.intake.followed_stamp_ns, change.subject
        was = self.accounting.correct(joint, change.value)
        now = self.accounting.wear_of(joint)
        corrected = CorrectedClearance(
            stamp_ns=stamp_ns,
            joint=joint,
            clearance_m=float(self.twin.clearance_mean_m[self.clearance_joints.index(joint)]),
            sigma_m=change.sigma,
            before_m=was.mean_m,
            wear_m=now.mean_m,
            replaced_ns=now.replaced_ns,
        )
        self.accounting.note(Audit(stamp_ns, "diagnosis", "correct_clearance", was))
        self.accounting.note(corrected)
        self.forecaster.corrected(corrected)
        self.grows_anew([joint])

    def take_parameters(self, found: LegParameters) -> None:
        """Let the twin walk on with the masses, lengths and friction that the drive torque shows."""
        self.twin.set_parameters(found)
        stamp_ns = self.twin.intake.followed_stamp_ns
        self.accounting.note(IdentifiedLeg(stamp_ns, tuple(self.mechanism.bodies), found))
        self.grows_anew(self.clearance_joints)
