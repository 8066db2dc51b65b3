"""The wear model of this leg: twin, wear in the ledger, growth, forecast, and reports of gait cycles."""

import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.estimate.cause import Change
from leg_wear_monitor.files import with_same_fields
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import bushing_of
from leg_wear_monitor.mechanism.person import PERSON_TOLERANCE
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.config.fitting import fitted, twin_settings
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecast import Forecast, JointForecast
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.ledger.entry import Audit, Entry, IdentifiedLeg, Measurement
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import ClearanceEstimate, CycleReport, JointReport
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.reference import MASS_TOLERANCE, LegParameters
from leg_wear_monitor.twin.sample import GROUND
from leg_wear_monitor.twin.statistics import CycleStatistics


class WearModel:
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
        if ledger and ledger.entry:
            self._note_coefficients(ledger.entry)
        self.last: CycleReport | None = None
        self.new_m = [self.mechanism.clearances[joint].radial_clearance for joint in self.clearance_joints]

    def _note_coefficients(self, entry: Entry) -> None:
        """Start the wear of parts again whose wear coefficient has changed since an entry."""
        joints = {part.name: part for part in entry.joints}
        for joint, now in zip(self.clearance_joints, self.twin.wear_coefficient_per_pa.tolist(), strict=True):
            if now > 0.0 and joints[joint].wear_coefficient_per_pa not in (0.0, now):
                self.accounting.note(self.forecaster.other_coefficient(joints[joint], now, entry.stamp_ns))

    @property
    def load_sigma(self) -> float:
        """Standard deviation of an estimated load, as a fraction of it; a measured load is known."""
        return self.twin.parameters.load_sigma if self.config.load.model == GROUND else 0.0

    def worn_m(self, clearance_m: Floats) -> Floats:
        """Wear of each part at some mean clearances [m]."""
        return np.asarray(clearance_m - self.new_m)

    @property
    def tolerance_m(self) -> tuple[float, ...]:
        """Standard deviation of each modelled clearance: by the fit of the part, or by its measurement."""
        by_fit = self.config.forecast.new_clearance_sigma
        return tuple(
            min(known.sigma_m, by_fit * new_m) if known else by_fit * new_m
            for known, new_m in zip(self.measured, self.new_m, strict=True)
        )

    @property
    def measured(self) -> tuple[Measurement | None, ...]:
        """Last measured clearance of each joint's present part."""
        return self.forecaster.last_measured(self.accounting.replaced_ns)

    def correct(self, change: Change) -> None:
        """Set a joint to the clearance estimated from the drive torque, and model its wear from there."""
        stamp_ns, joint = self.twin.intake.followed_stamp_ns, change.subject
        was = self.accounting.correct(joint, change.value)
        clearance_m = float(self.twin.clearance_mean_m[self.clearance_joints.index(joint)])
        wear = self.accounting.wear_of(joint)
        self.accounting.note(Audit(stamp_ns, "diagnosis", "correct_clearance", was))
        self.accounting.note(self.forecaster.corrected(wear, clearance_m, change.sigma, stamp_ns))

    def take_parameters(self, found: LegParameters) -> None:
        """Let the twin walk on with the masses, lengths and friction that the drive torque shows."""
        self.twin.set_parameters(found)
        stamp_ns = self.twin.intake.followed_stamp_ns
        self.accounting.note(IdentifiedLeg(stamp_ns, tuple(self.mechanism.bodies), found))

    def report(
        self,
        statistics: CycleStatistics,
        forecast: Forecast,
        seen: Sequence[ClearanceEstimate] | None,
        estimates: Sequence[KnownClearance | None],
    ) -> CycleReport:
        """Report of a gait cycle.

        Parameters
        ----------
        statistics : CycleStatistics
        forecast : Forecast
        seen : sequence of ClearanceEstimate or None
            Clearances by encoders; None without encoders.
        estimates : sequence of (KnownClearance or None)
            The surest estimate of each clearance.
        """
        torque, predicted_nm = statistics.torque, statistics.torque.predicted_rms_nm
        mismatch = float(torque.unexplained_rms_nm / predicted_nm) if predicted_nm > 0.0 else math.nan
        joints = range(len(self.clearance_joints))
        return with_same_fields(
            CycleReport,
            torque,
            statistics,
            cycle=self.accounting.cycles,
            joints=tuple(
                self._joint_report(k, statistics, forecast.joints[k], seen[k] if seen else None, estimates[k])
                for k in joints
            ),
            torque_samples=torque.samples,
            measured_torque_rms_nm=float(torque.measured_rms_nm),
            predicted_torque_rms_nm=float(predicted_nm),
            residual_torque_rms_nm=float(torque.residual_rms_nm),
            torque_mismatch=mismatch,
            forecast=forecast.leg,
        )

    def _joint_report(
        self,
        k: int,
        statistics: CycleStatistics,
        forecast: JointForecast,
        seen: ClearanceEstimate | None,
        estimate: KnownClearance | None,
    ) -> JointReport:
        joint, rate = self.clearance_joints[k], self.forecaster.last_rate(k)
        mean_n, p99_n = float(statistics.mean_force_n[k]), float(statistics.p99_force_n[k])
        rubbing_w = float(statistics.archard_j[k] / statistics.moving_s)
        # growth is about in proportion to the masses: a hundred simulated legs have 5 % of error in total
        masses = PERSON_TOLERANCE if self.mechanism.person_kg else MASS_TOLERANCE
        error_m = rate.error_m(math.hypot(masses, self.load_sigma)) if rate else None
        return JointReport(
            joint=joint,
            clearance_m=float(statistics.clearance_mean_m[k]),
            clearance_max_m=float(statistics.clearance_max_m[k]),
            growth_m_per_cycle=rate.per_cycle_m if rate else None,
            growth_mps=rate.per_second_m if rate else None,
            growth_error_m_per_cycle=error_m,
            forecast=forecast,
            seen=seen,
            measured=self.measured[k],
            peak_force_n=float(statistics.peak_force_n[k]),
            p99_force_n=p99_n,
            mean_force_n=mean_n,
            impacts=int(statistics.impacts[k]),
            load=self.bushings[joint].load(mean_n, p99_n, rubbing_w),
            estimated_m=estimate.clearance_m if estimate else None,
            estimated_sigma_m=estimate.sigma_m if estimate else None,
        )
