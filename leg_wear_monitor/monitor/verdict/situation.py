"""What a verdict depends on, and nothing else; the defaults are those of a leg without a fault."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.estimate.cause import NamedCause, TorqueExplanation
from leg_wear_monitor.mechanism.materials.load import BushingLoad
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.config.inputs import Crank, DriveTorque
from leg_wear_monitor.monitor.diagnosis.diagnosis import Diagnosis


@attrs.frozen
class SeenClearance:
    """A clearance that measurements show.

    Attributes
    ----------
    by : str
        ``encoders``, ``torque``, or ``measurement`` for what a person measured.
    clearance_m, sigma_m : float
    """

    by: str
    clearance_m: float
    sigma_m: float


@attrs.frozen(kw_only=True)
class JointSituation:
    """A clearance joint.

    Attributes
    ----------
    joint : str
    label : str
        What operators call the joint, such as ``knee``; empty if it has no label.
    counted_m, limit_m : float
        Counted mean radial clearance, and its limit.
    believed_m : float
        Median of what the forecast believes of the clearance; NaN before the first forecast.
    measured : SeenClearance or None
        What a person measured last on the present part.
    seen : tuple of SeenClearance
        Estimates from measurements, as far as there are any.
    is_used : bool
        Whether the forecast rests on what encoders show of this joint.
    is_measurement_used : bool
        Whether it rests on `measured`; not on one that contradicts the model.
    replaced_ns, part_cycles : int
        When its part was replaced, 0 if it never was, and the gait cycles of this part.
    load : BushingLoad or None
        That of the last gait cycle; None before it.
    """

    joint: str
    counted_m: float
    limit_m: float
    believed_m: float = math.nan
    measured: SeenClearance | None = None
    seen: tuple[SeenClearance, ...] = ()
    is_used: bool = False
    is_measurement_used: bool = False
    replaced_ns: int = 0
    part_cycles: int = 0
    label: str = ""
    load: BushingLoad | None = None


@attrs.frozen(kw_only=True)
class Situation:
    """The monitor's results at one instant.

    Attributes
    ----------
    joints : tuple of JointSituation
    alarms : tuple of Alarm
    quantities : mapping of str to str
        Noun of each alarm's value, by the alarm's name; by its kind for an alarm of a joint.
    has_cycle : bool
        Whether a whole gait cycle was monitored in this run.
    is_all_counted : bool
        Whether the ledger already contained the wear of all samples of this run.
    has_torque : bool
        Whether the last gait cycle has samples of the drive torque.
    mismatch, mismatch_limit : float
        Part of the drive torque that is not explained, as a fraction of the predicted RMS; NaN if it is not
        known.
    torque_causes : mapping of str to NamedCause
        Causes of an impossible bias, drift or lag of the torque, by the alarm.
    without_zero : str
        Why nothing is monitored while the crank's zero is not known; empty if it is.
    unfollowed : str
        Why the crank is not followed at present; empty if it is.
    input_causes : tuple of str
        Sentences on unused samples.
    is_out_of_step : bool
        Whether the cadence is outside of its tolerance.
    cadence_rpm, commanded_rpm, tolerance_rpm : float
    doubts : tuple of str
        Why the last gait cycle is unlikely to be one of this leg.
    encoder_faults : tuple of str
    diagnosis : Diagnosis or None
        What the drive torque shows; None without an estimator.
    explained : TorqueExplanation or None
        What explains a torque mismatch; None without one, and in its first gait cycles.
    crank, drive_torque : Crank, DriveTorque
        Present parameters, which a remedy changes.
    """

    joints: tuple[JointSituation, ...] = ()
    alarms: tuple[Alarm, ...] = ()
    quantities: Mapping[str, str] = attrs.field(factory=dict)
    has_cycle: bool = True
    is_all_counted: bool = False
    has_torque: bool = True
    mismatch: float = 0.0
    mismatch_limit: float = math.nan
    torque_causes: Mapping[str, NamedCause] = attrs.field(factory=dict)
    without_zero: str = ""
    unfollowed: str = ""
    input_causes: tuple[str, ...] = ()
    is_out_of_step: bool = False
    cadence_rpm: float = math.nan
    commanded_rpm: float = math.nan
    tolerance_rpm: float = math.nan
    doubts: tuple[str, ...] = ()
    encoder_faults: tuple[str, ...] = ()
    diagnosis: Diagnosis | None = None
    explained: TorqueExplanation | None = None
    crank: Crank = Crank()
    drive_torque: DriveTorque = DriveTorque()

    def joint_words(self, joint: str) -> str:
        """A joint with its label, such as ``G (knee)``."""
        label = next((each.label for each in self.joints if each.joint == joint), "")
        return f"{joint} ({label})" if label else joint

    def alarm_of(self, joint: str) -> Alarm | None:
        """The alarm of a joint's clearance; None if it is not listed."""
        own = (each for each in self.alarms if each.kind == "clearance" and each.subject == joint)
        return next(own, None)

    def quantity(self, alarm: Alarm) -> str:
        """Noun of an alarm's value; its name where there is none."""
        noun = self.quantities.get(alarm.name) or self.quantities.get(alarm.kind)
        return noun or alarm.name.replace("_", " ")

    @property
    def unobserved(self) -> tuple[str, ...]:
        """Clearance joints that no encoder shows."""
        return tuple(
            joint.joint for joint in self.joints if not any(seen.by == "encoders" for seen in joint.seen)
        )
