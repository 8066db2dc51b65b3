"""State of a leg: verdict, best estimate of each clearance, drive, load, diagnosis, remaining life.

The monitor makes it, and every display of a leg is a view of it. SI units; None for unknown values.
"""

import re
from collections.abc import Mapping
from enum import Enum, IntEnum
from html import escape
from typing import Any, Self

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.files import finite_or_none, json_text

SCHEMA_VERSION = 4
"""Version of the JSON; counts up when a field is renamed, removed or means something else."""


class Level(IntEnum):
    """Level of an alarm; numbers as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class _Word(Enum):
    """Members that have the word in files as their value."""

    @property
    def words(self) -> str:
        """The word as operators read it."""
        return str(self.value).replace("_", " ")


class State(_Word):
    """State of the leg, from the mildest to the most severe; the value is the word that files contain.

    *Not monitored* is more severe than *watch* and milder than *inspect*, because a failing input must not
    end a reason to inspect or to stop.
    """

    HEALTHY = "healthy"
    WATCH = "watch"
    NOT_MONITORED = "not_monitored"
    INSPECT = "inspect"
    STOP = "stop"

    @property
    def severity(self) -> int:
        """Rank in the order above, from 0."""
        return list(State).index(self)


class Figure(_Word):
    """Kinds of values that may not be valid; the value is the word that files contain."""

    CLEARANCES = "clearances"
    GROWTH = "growth"
    IMPACT_FORCES = "impact_forces"
    FORECAST = "forecast"

    @property
    def words(self) -> str:
        """Words for operators; they exclude a clearance measured by torque, by encoders or by hand."""
        return "modelled clearances" if self is Figure.CLEARANCES else super().words


def as_plain(text: str) -> str:
    """A text of a verdict for a terminal or a message: without the backticks around its commands."""
    return text.replace("`", "")


@attrs.frozen
class Evidence:
    """A value that a finding rests on, and its limit.

    Attributes
    ----------
    name : str
        Name of the alarm, or of the observed quantity.
    value : float or None
        Value of this quantity; None if it is not known.
    limit : float or None
        Limit of this quantity; None if there is no limit.
    unit : str
        SI unit of value and limit; empty for a fraction.
    """

    name: str
    value: float | None = attrs.field(converter=finite_or_none)
    limit: float | None = attrs.field(converter=finite_or_none)
    unit: str


@attrs.frozen(kw_only=True)
class Verdict:
    """Conclusion of the monitor on the leg.

    Attributes
    ----------
    state : State
        State of the leg.
    joints : tuple of str
        The joints that the reason concerns; empty if they are not known, or if there are none.
    why : str
        The reason, with values and units.
    since_ns : int
        Stamp since which the reason has been valid; 0 if it is not known.
    do : str
        Next action for the operator; commands stand between backticks, as they may in ``why``.
    evidence : tuple of Evidence
        Evidence of all findings; the evidence of the reason comes first.
    not_valid : tuple of Figure
        Kinds of values that are not valid meanwhile.
    fault_code : str
        Stable name of the reason, such as ``CLEARANCE_G``; ``NONE`` for a healthy leg.
    """

    state: State
    joints: tuple[str, ...]
    why: str
    since_ns: int
    do: str
    evidence: tuple[Evidence, ...]
    not_valid: tuple[Figure, ...]
    fault_code: str

    @property
    def words(self) -> str:
        """State, joints, reason and action in one line."""
        whose = f" joint {', '.join(self.joints)}" if self.joints else ""
        return as_plain(f"{self.state.words}{whose}: {self.why}. To do: {self.do}")

    def with_files(self, files: Mapping[str, object]) -> Self:
        """The same verdict, whose commands name files in place of ``FILE``, by option; None is not known."""
        do = self.do
        for option, path in files.items():
            do = do.replace(f"{option} FILE", f"{option} {path}") if path is not None else do
        return attrs.evolve(self, do=do)

    def _repr_html_(self) -> str:
        """HTML for a notebook, without scripts."""
        whose = f" (joint {', '.join(self.joints)})" if self.joints else ""
        lines = [f"{self.why} [{self.fault_code}]", f"to do: {self.do}"]
        if self.not_valid:
            lines.append(f"not valid: {', '.join(figure.words for figure in self.not_valid)}")
        paragraphs = (re.sub(r"`(.+?)`", r"<code>\1</code>", escape(line)) for line in lines)
        heading = f"<p><strong>Verdict: {escape(self.state.words + whose)}</strong></p>"
        return f"<div>{heading}{''.join(f'<p>{line}</p>' for line in paragraphs)}</div>"

    def to_dict(self) -> dict[str, Any]:
        """Plain data as in summary.json; an unknown value is None."""
        return dict(part_document(self))


@attrs.frozen(kw_only=True)
class JointClearance:
    """Mean radial clearance of a joint [m].

    Attributes
    ----------
    best_estimate_m : float or None
        The clearance that the verdict rests on; None if no known value of the joint is valid.
    best_estimate_sigma_m : float or None
        Its standard deviation.
    best_estimate_source : str or None
        Its source: ``modelled``, ``torque``, ``encoders``, ``measured``, or ``wear_and_measurement`` if
        modelled wear and measurements give it together.
    modelled_m : float
        Clearance when new, plus the modelled wear since.
    estimated_m : float or None
        Clearance estimated from measurements of the gait.
    estimated_sigma_m : float or None
        Its standard deviation.
    estimated_by : tuple of str
        Sources of this estimate, such as ``encoders``.
    change_m : float or None
        Change since the baseline, estimated from the drive torque; None without a baseline.
    change_sigma_m : float or None
        Its standard deviation, without the error of the clearance in the baseline.
    measured_m : float or None
        Clearance from the last measurement by hand on this part.
    measured_sigma_m : float or None
        Its standard deviation.
    new_m : float
        Clearance when new.
    limit_m : float
        Limit of the clearance.
    status : State
        State of the joint by the verdict's findings; ``not_monitored`` if no known value of it is valid.
    """

    best_estimate_m: float | None = None
    best_estimate_sigma_m: float | None = None
    best_estimate_source: str | None = None
    modelled_m: float
    estimated_m: float | None = None
    estimated_sigma_m: float | None = None
    estimated_by: tuple[str, ...] = ()
    change_m: float | None = None
    change_sigma_m: float | None = None
    measured_m: float | None = None
    measured_sigma_m: float | None = None
    new_m: float
    limit_m: float
    status: State = State.NOT_MONITORED


@attrs.frozen(kw_only=True)
class Estimate:
    """A value that is estimated from measurements.

    Attributes
    ----------
    value : float
        The estimate.
    sigma : float or None
        Its standard deviation.
    """

    value: float
    sigma: float | None = attrs.field(default=None, converter=finite_or_none)


@attrs.frozen(kw_only=True)
class Drive:
    """The drive and its torque sensor, as the drive torque shows them.

    Attributes
    ----------
    scale : Estimate or None
        Measured over actual torque; None while the torque residual does not show that it differs from 1.
    lag_s : Estimate or None
        Delay of the measured torque.
    coulomb_nm : Estimate or None
        Constant friction; at one cadence it contains the viscous friction.
    viscous_nms : Estimate or None
        Viscous friction; None while gait cycles of one cadence do not separate it.
    load_friction : Estimate or None
        Friction over the size of the torque that the drive transmits.
    bandwidth_hz : Estimate or None
        Corner frequency of the low-pass between the leg and the torque; None if none is detected.
    temperature_c : Estimate or None
        Temperature of the drive [°C]; None if it is not measured.
    """

    scale: Estimate | None = None
    lag_s: Estimate | None = None
    coulomb_nm: Estimate | None = None
    viscous_nms: Estimate | None = None
    load_friction: Estimate | None = None
    bandwidth_hz: Estimate | None = None
    temperature_c: Estimate | None = None


@attrs.frozen(kw_only=True)
class FootLoad:
    """The load at the foot over the last gait cycles.

    Attributes
    ----------
    source : str
        Source of the load: ``measured``, ``estimated`` from the drive torque, or ``none``.
    peak_n : float or None
        Largest vertical force in the mean over gait cycles.
    peak_sigma_n : float or None
        Its standard deviation: if measured, from step to step.
    heel_strike_phase, toe_off_phase : float or None
        Crank angles at which the foot strikes and leaves the ground, as fractions of a turn.
    heel_strike_sigma, toe_off_sigma : float or None
        Their standard deviations from step to step.
    cycles : int
        Number of gait cycles in the estimate.
    """

    source: str = "none"
    peak_n: float | None = None
    peak_sigma_n: float | None = None
    heel_strike_phase: float | None = None
    toe_off_phase: float | None = None
    heel_strike_sigma: float | None = None
    toe_off_sigma: float | None = None
    cycles: int = 0


@attrs.frozen(kw_only=True)
class TorqueDiagnosis:
    """Diagnosis of the leg from the drive torque.

    Attributes
    ----------
    state : str
        ``off``, ``waiting``, ``as_modelled`` or ``changed``.
    reason : str
        Reason why there is no estimate yet, or why it is not valid now; empty otherwise.
    cycles_used : int
        Gait cycles in the estimate.
    cycles_not_used : dict of str to int
        Gait cycles that were not used, by reason.
    misfit : float or None
        RMS of the torque that load, friction and lag do not explain, as a fraction of the predicted RMS.
    cause : str or None
        Explanation of the residual, such as ``clearance`` or ``lag``; None without a residual, or if more
        than one cause explains it.
    cause_subject : str
        The joint or the body concerned; empty if there is none.
    cause_value : float or None
        Value of the cause [SI].
    cause_sigma : float or None
        Its standard deviation.
    """

    state: str = "off"
    reason: str = ""
    cycles_used: int = 0
    cycles_not_used: dict[str, int] = attrs.Factory(dict)
    misfit: float | None = attrs.field(default=None, converter=finite_or_none)
    cause: str | None = None
    cause_subject: str = ""
    cause_value: float | None = attrs.field(default=None, converter=finite_or_none)
    cause_sigma: float | None = attrs.field(default=None, converter=finite_or_none)


@attrs.frozen(kw_only=True)
class LifeHours:
    """Remaining hours of walking, as quantiles.

    Attributes
    ----------
    p10_h : float
        Hours that are not exceeded with a probability of 10 %.
    p50_h : float
        Hours that are not exceeded with a probability of 50 %.
    p90_h : float
        Hours that are not exceeded with a probability of 90 %.
    """

    p10_h: float
    p50_h: float
    p90_h: float


@attrs.frozen(kw_only=True)
class LegAlarm:
    """An alarm as operators see it.

    Attributes
    ----------
    name : str
        Kind and subject, such as ``clearance A``.
    level : Level
        Level that is shown; a latched alarm keeps its highest one.
    state : str
        Present or latched, and acknowledged or not.
    value : float or None
        Last value, in ``unit``.
    limit : float or None
        Limit of the level ERROR, in ``unit``.
    worst : float or None
        Worst value since it was raised, in ``unit``; of estimates and measurements of a clearance, the last.
    unit : str
        Unit of the values, SI; empty for a fraction.
    raised_ns : int
        Stamp at which the level last rose [ns]; 0 before.
    """

    name: str
    level: Level
    state: str
    value: float | None = attrs.field(converter=finite_or_none)
    limit: float | None = attrs.field(converter=finite_or_none)
    unit: str
    worst: float | None = attrs.field(converter=finite_or_none)
    raised_ns: int


@attrs.frozen(kw_only=True)
class AlarmChange:
    """An alarm after a change.

    Attributes
    ----------
    stamp_ns : int
        Stamp of the change [ns].
    alarm : LegAlarm
        The alarm then.
    """

    stamp_ns: int
    alarm: LegAlarm = attrs.field(metadata={"flat": True})


@attrs.frozen(kw_only=True)
class LegAlarms:
    """All alarms.

    Attributes
    ----------
    now : tuple of LegAlarm
        All of them.
    changes : tuple of AlarmChange
        First ten thousand changes of a replay; otherwise empty.
    """

    now: tuple[LegAlarm, ...] = ()
    changes: tuple[AlarmChange, ...] = ()


@attrs.frozen(kw_only=True)
class LegState:
    """All knowledge of a leg at one instant.

    Attributes
    ----------
    verdict : Verdict
        Conclusion of the monitor on the leg.
    clearances : dict of str to JointClearance
        Clearance of each clearance joint.
    drive : Drive
        The drive and its torque sensor.
    load : FootLoad
        Load at the foot over the last gait cycles.
    diagnosis : TorqueDiagnosis
        Diagnosis of the leg from the drive torque.
    life : dict of str to LifeHours or None
        Remaining life of each joint, and of the ``leg``; None if it is not known or not valid.
    life_answers : dict of str to str
        Statement on the remaining life of each joint, and of the ``leg``.
    first_probability : dict of str to float
        Probability of each joint to be the first at its limit; empty unless known.
    alarms : LegAlarms
        All alarms.
    stamp_ns : int
        The instant; 0 before the first sample.
    life_cycles : int
        Gait cycles over the leg's whole life in the ledger.
    """

    verdict: Verdict
    clearances: dict[str, JointClearance]
    drive: Drive = Drive()
    load: FootLoad = FootLoad()
    diagnosis: TorqueDiagnosis = TorqueDiagnosis()
    life: dict[str, LifeHours | None] = attrs.Factory(dict)
    life_answers: dict[str, str] = attrs.Factory(dict)
    first_probability: dict[str, float] = attrs.Factory(dict)
    alarms: LegAlarms = LegAlarms()
    stamp_ns: int = 0
    life_cycles: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Plain object; null for unknown values."""
        changes = [
            {"stamp_ns": change.stamp_ns, **part_document(change.alarm)} for change in self.alarms.changes
        ]
        found = {"schema_version": SCHEMA_VERSION, **part_document(self)}
        return {**found, "alarms": {**found["alarms"], "changes": changes}}

    def to_json(self) -> str:
        """Text of the plain object."""
        return json_text(self.to_dict())
