"""What operators do after a repair: resets of a joint, their undoing, acknowledgements.

A monitor does it in its own state. Without a monitor, the entry of a ledger is changed in the same way.
"""

import json
import math
from collections.abc import Iterable, Sequence

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.accounting import verdict_event
from leg_wear_monitor.monitor.alarms import Alarm, acknowledged
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.measurement import last_measured
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    Entry,
    JointWear,
    Measurement,
    new_part,
    one_part,
)
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import VerdictReport
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    COUNTED,
    OF_A_JOINT,
    SEEN,
    JointSituation,
    KnownClearance,
    Situation,
    is_surely_below,
)
from leg_wear_monitor.monitor.verdict.verdict import Finding, dated
from leg_wear_monitor.state import Level


@attrs.frozen(eq=False)
class Reset:
    """A reset that can be taken back: its row in the ledger, and the joint's wear before it."""

    id: int
    before: JointWear


def last_reset(ledger: Ledger | None, joint: str, now: JointWear) -> Reset:
    """The last reset of a joint that was not taken back.

    Parameters
    ----------
    ledger : Ledger or None
    joint : str
    now : JointWear
        The joint, as the monitor counts it.

    Raises
    ------
    LegWearError
        If there is none, or it is of other surfaces.
    """
    if ledger is None:
        raise LegWearError(f"joint {joint}: no ledger is used, so the wear before a reset is not stored")
    if ledger.fault:
        raise LegWearError(f"joint {joint}: the ledger was not written: {ledger.fault}; try again when it is")
    found = ledger.last_reset(joint)
    if found is None or found.joint is None:
        raise LegWearError(f"joint {joint}: the ledger has no reset to undo")
    if found.joint.depth.shape != now.depth.shape:
        raise LegWearError(f"joint {joint}: had {found.joint.depth.shape[1]} sectors when it was reset")
    return Reset(found.id, found.joint)


def rested_on(alarms: Iterable[Alarm], joint: str, named: Iterable[str] = ()) -> tuple[str, ...]:
    """Names of the raised alarms that rested on the part of a joint that was replaced.

    The joint's own ones; and the torque mismatch if this joint explains it: if its clearance was at a limit,
    or the verdict named it for its clearance.

    Parameters
    ----------
    alarms : iterable of Alarm
    joint : str
    named : iterable of str
        Joints that the verdict named for their clearance.
    """
    raised = [alarm for alarm in alarms if alarm.level is not Level.OK]
    own = [alarm for alarm in raised if alarm.kind in OF_A_JOINT and alarm.subject == joint]
    explains = joint in named or any(alarm.kind == alarm_specs.CLEARANCE.kind for alarm in own)
    mismatch = [alarm for alarm in raised if explains and alarm.kind == alarm_specs.MISMATCH.kind]
    return tuple(alarm.name for alarm in (*own, *mismatch))


def named_for_clearance(findings: Iterable[Finding]) -> frozenset[str]:
    """Joints that findings name for their clearance."""
    of_clearance = (each for each in findings if each.code.startswith("CLEARANCE"))
    return frozenset(joint for each in of_clearance for joint in each.joints)


@attrs.frozen(eq=False)
class Acknowledged:
    """What an acknowledgement or a replaced part made of the raised alarms.

    Attributes
    ----------
    cleared, kept : tuple of str
        Names of the alarms that cleared, and of those that are still raised.
    """

    cleared: tuple[str, ...]
    kept: tuple[str, ...]

    @property
    def words(self) -> str:
        """Both kinds in one line."""
        return (
            f"cleared: {', '.join(self.cleared) or 'none'}; still present: {', '.join(self.kept) or 'none'}"
        )


def reset_in(
    ledger: Ledger, leg: Mechanism, config: MonitorConfig, joint: str, stamp_ns: int, who: str
) -> tuple[JointWear, Acknowledged]:
    """Enter a replaced part into a ledger that no monitor uses; its history stays.

    What rested on the former part is acknowledged and clears; the verdict in the ledger follows.

    Returns
    -------
    JointWear
        The wear of the former part.
    Acknowledged

    Raises
    ------
    LegWearError
        If the ledger has no wear of this joint, or cannot be written.
    """
    entry, was = _entry_with(ledger, joint)
    last = ledger.last_verdict
    is_named = last is not None and last.fault_code.startswith("CLEARANCE")
    gone = rested_on(entry.alarms, joint, json.loads(last.joints) if last and is_named else ())
    entry = attrs.evolve(entry, alarms=tuple(alarm for alarm in entry.alarms if alarm.name not in gone))
    entry = _with_part(entry, attrs.evolve(new_part(joint), replaced_ns=stamp_ns))
    ledger.note(Audit(stamp_ns, who, "reset_wear", was))
    note_verdict_of(ledger, entry, leg, config, stamp_ns)
    ledger.record(entry)
    return was, Acknowledged(gone, tuple(alarm.name for alarm in entry.alarms))


def acknowledge_in(ledger: Ledger, leg: Mechanism, config: MonitorConfig, stamp_ns: int) -> Acknowledged:
    """Acknowledge all alarms of a ledger that no monitor uses, and the interruption of its last run.

    Raises
    ------
    LegWearError
        If the ledger contains no wear yet, or cannot be written.
    """
    entry = ledger.entry
    if entry is None:
        raise LegWearError("the ledger contains no wear yet")
    now = [acknowledged(alarm) for alarm in entry.alarms]
    cleared = tuple(alarm.name for alarm in now if alarm.level is Level.OK)
    entry = attrs.evolve(entry, alarms=tuple(alarm for alarm in now if alarm.level is not Level.OK))
    for alarm in now:
        ledger.note(AlarmEvent(stamp_ns, alarm))
    ledger.cut_off_s = None
    note_verdict_of(ledger, entry, leg, config, stamp_ns)
    ledger.record(entry)
    return Acknowledged(cleared, tuple(alarm.name for alarm in entry.alarms))


def shown_in(ledger: Ledger, joint: str) -> KnownClearance | None:
    """What encoders or the drive torque showed of a joint when the alarm in a ledger was raised."""
    name = alarm_specs.CLEARANCE.name(joint)
    alarms = ledger.entry.alarms if ledger.entry else ()
    own = next((alarm for alarm in alarms if alarm.name == name and alarm.cause in SEEN), None)
    return KnownClearance(own.cause, own.worst, own.sigma) if own else None


def overrule_in(ledger: Ledger, leg: Mechanism, config: MonitorConfig, found: Measurement) -> Entry | None:
    """Acknowledge the alarm of a clearance that a measurement contradicts; None if there is none such.

    Parameters
    ----------
    ledger : Ledger
        That no monitor uses.
    leg : Mechanism
    config : MonitorConfig
    found : Measurement
        Noted already.

    Returns
    -------
    Entry
        To be recorded.
    """
    entry, limits_m = ledger.entry, clearance_limits(leg, config)
    if entry is None or not is_surely_below(limits_m[found.joint], found.clearance_m, found.sigma_m):
        return None
    name = alarm_specs.CLEARANCE.name(found.joint)
    own = next((alarm for alarm in entry.alarms if alarm.name == name), None)
    if own is None or own.cause in ("", COUNTED):
        return None
    present = own.present if own.cause in SEEN else Level.OK  # an earlier measurement does not last
    now = acknowledged(attrs.evolve(own, present=present))
    alarms = tuple(now if alarm is own else alarm for alarm in entry.alarms)
    entry = attrs.evolve(entry, alarms=tuple(alarm for alarm in alarms if alarm.level is not Level.OK))
    ledger.note(AlarmEvent(found.stamp_ns, now))
    note_verdict_of(ledger, entry, leg, config, found.stamp_ns, (*ledger.measurements, found))
    return entry


def clearance_limits(leg: Mechanism, config: MonitorConfig) -> dict[str, float]:
    """Limit of each clearance joint's clearance [m]."""
    joints = leg.clearance_joints
    return dict(zip(joints, AlarmBoard(config, joints).clearance_limits_m, strict=True))


def note_verdict_of(
    ledger: Ledger,
    entry: Entry,
    leg: Mechanism,
    config: MonitorConfig,
    stamp_ns: int,
    measurements: Sequence[Measurement] | None = None,
) -> None:
    """Note the verdict of an entry that an operator changed, by the rules of the monitor.

    Nothing is known of the drive torque until the leg walks again.
    """
    known, limits_m = (
        ledger.measurements if measurements is None else measurements,
        clearance_limits(leg, config),
    )
    joints = []
    for part in entry.joints:
        last = last_measured(known, part.name, part.replaced_ns)
        by = KnownClearance("measured", last.clearance_m, last.sigma_m) if last else None
        joints.append(
            JointSituation(
                joint=part.name,
                counted_m=leg.clearances[part.name].radial_clearance + part.mean_m,
                limit_m=limits_m[part.name],
                measured=by,
                label=leg.joints[part.name].label,
                replaced_ns=part.replaced_ns,
                part_cycles=part.cycles,
            )
        )
    situation = Situation(
        joints=tuple(joints), alarms=entry.alarms, quantities=alarm_specs.QUANTITIES, mismatch=math.nan
    )
    ledger.note(verdict_event(VerdictReport(stamp_ns, dated(findings(situation), (), stamp_ns))))


def undo_in(ledger: Ledger, joint: str, stamp_ns: int, who: str) -> JointWear:
    """Undo the last reset of a joint in a ledger that no monitor uses.

    Returns
    -------
    JointWear
        Sum of the wear before the reset and since.

    Raises
    ------
    LegWearError
        If there is no reset to undo, or the ledger cannot be written.
    """
    entry, since = _entry_with(ledger, joint)
    reset = last_reset(ledger, joint, since)
    part = one_part(reset.before, since)
    ledger.note(Audit(stamp_ns, who, "undo_reset", since, undoes=reset.id))
    ledger.record(_with_part(entry, part))
    return part


def wear_words(wear: JointWear) -> str:
    """Mean total wear of both surfaces, and its number of gait cycles."""
    return f"{1e6 * wear.mean_m:.4g} um of wear from {wear.cycles} gait cycles"


def _entry_with(ledger: Ledger, joint: str) -> tuple[Entry, JointWear]:
    """The ledger's entry, and the present part of a joint in it."""
    parts = {part.name: part for part in ledger.entry.joints} if ledger.entry else {}
    if ledger.entry is None or joint not in parts:
        raise LegWearError(f"joint {joint}: the ledger contains no wear yet")
    return ledger.entry, parts[joint]


def _with_part(entry: Entry, part: JointWear) -> Entry:
    """The entry with another part of a joint; the spans stay those of the run that counted them."""
    joints = tuple(part if each.name == part.name else each for each in entry.joints)
    return attrs.evolve(entry, joints=joints, spans=(), span_epochs=())
