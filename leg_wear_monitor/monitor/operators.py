"""What operators do: parts replaced and put back, clearances measured, alarms acknowledged.

First in a monitor, then in a ledger that no monitor uses, whose entry is changed in the same way.
"""

import math
from collections.abc import Iterable, Sequence

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import Alarm, acknowledged, joint_of
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.measurement import MeasurementResult, last_measured
from leg_wear_monitor.monitor.gait_evidence import NO_MISMATCH
from leg_wear_monitor.monitor.judgement import (
    evaluate_clearances,
    is_forecast_valid,
    joint_situations,
    shown,
    update_verdict,
    verdict_report,
    with_measured,
)
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    Entry,
    JointWear,
    Measurement,
    VerdictEvent,
    new_part,
    one_part,
)
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, with_forecast
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    COUNTED,
    SEEN,
    SOURCES,
    JointSituation,
    KnownClearance,
    Situation,
    is_surely_below,
)
from leg_wear_monitor.monitor.verdict.verdict import Finding, dated, verdict_of
from leg_wear_monitor.state import Level


def last_reset(ledger: Ledger | None, joint: str, now: JointWear) -> tuple[int, JointWear]:
    """The last reset of a joint that was not taken back: its row, and the joint's wear before it.

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
    return found.id, found.joint


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
    own = [alarm for alarm in raised if joint_of(alarm.name) == joint]
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


# In a monitor.


def acknowledge(parts: Parts, stamp_ns: int) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
    """See `WearMonitor.acknowledge`."""
    cleared, kept = parts.evaluation.board.acknowledge(parts.unmeasured)
    if parts.unmeasured:
        parts.state.mismatch = NO_MISMATCH
    ledger = parts.accounting.ledger
    has_lost = ledger is not None and ledger.acknowledge_loss()
    _note_alarms(parts, stamp_ns)
    update_verdict(parts)
    if cleared or kept or has_lost:
        parts.keep()
    return cleared, kept


def reset_wear(parts: Parts, joint: str, stamp_ns: int, who: str) -> Acknowledged:
    """See `WearMonitor.reset_wear`."""
    board, state = parts.evaluation.board, parts.state
    was = parts.accounting.replace(joint, stamp_ns)
    gone = rested_on(board.alarms.values(), joint, named_for_clearance(state.findings))
    board.clear(gone)
    if alarm_specs.MISMATCH.name() in gone:
        state.mismatch = NO_MISMATCH
    _part_changed(parts, joint, stamp_ns)
    parts.accounting.note(Audit(stamp_ns, who, "reset_wear", was))
    _note_alarms(parts, stamp_ns)
    update_verdict(parts)
    parts.keep()
    kept = tuple(alarm.name for alarm in board.alarms.values() if alarm.level is not Level.OK)
    return Acknowledged(gone, kept)


def undo_reset(parts: Parts, joint: str, stamp_ns: int, who: str) -> JointWear:
    """See `WearMonitor.undo_reset`."""
    accounting = parts.accounting
    row, before = last_reset(accounting.ledger, joint, accounting.wear_of(joint))
    since = accounting.put_back(joint, before)
    _part_changed(parts, joint, before.replaced_ns)
    accounting.note(Audit(stamp_ns, who, "undo_reset", since, undoes=row))
    parts.keep()
    return accounting.wear_of(joint)


def measure(
    parts: Parts, joint: str, clearance_m: float, sigma_m: float, stamp_ns: int, who: str, accept: bool
) -> MeasurementResult:
    """See `WearMonitor.measure`."""
    accounting, joint = parts.accounting, parts.mechanism.clearance_joint(joint)
    wear, best = accounting.wear_of(joint), shown(parts, _situation(parts, joint))
    found = parts.forecaster.measured(
        wear,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        stamp_ns=stamp_ns,
        who=who,
        kept_ns=accounting.ledger.kept_ns if accounting.ledger else 0,
        accept=accept,
    )
    if best:
        found = attrs.evolve(
            found, shown_m=best.clearance_m, shown_sigma_m=best.sigma_m, shown_by=SOURCES[best.by]
        )
    accounting.note(found.measurement)
    if parts.encoders:
        parts.encoders.state.updated_ns = 0  # the next estimate updates the forecast again
    renew_forecast(parts)
    for change in _compared(parts, joint):
        accounting.note_alarms(change)
    update_verdict(parts)
    parts.keep()
    return found


def renew_forecast(parts: Parts) -> CycleReport | None:
    """See `WearMonitor.renew_forecast`."""
    last = parts.state.last
    if last is None:
        return None
    sigma_m = parts.accounting.sampling_sigma_m
    forecast = parts.forecaster.renewed(
        parts.worn_m(parts.twin.clearance_mean_m),
        parts.evaluation.board.clearance_limits_m,
        is_forecast_valid(parts, verdict_report(parts).findings),
        sigma_m,
        parts.model_error,
    )
    parts.state.last = with_forecast(last, forecast, parts.measured, sigma_m.tolist())
    return parts.state.last


def _situation(parts: Parts, joint: str) -> JointSituation:
    return next(each for each in joint_situations(parts) if each.joint == joint)


def _note_alarms(parts: Parts, stamp_ns: int) -> None:
    parts.accounting.note_alarms(AlarmList(stamp_ns, tuple(parts.evaluation.board.alarms.values())))


def _compared(parts: Parts, joint: str) -> tuple[AlarmList, ...]:
    """Compare a new measurement with the limit; it ends an alarm of the clearance that it contradicts."""
    changes, board = evaluate_clearances(parts), parts.evaluation.board
    name = alarm_specs.CLEARANCE.name(joint)
    own, before = _situation(parts, joint), board.alarms[name]
    if own.measured is None or before.cause in ("", COUNTED) or before.level is Level.OK:
        return changes
    if is_surely_below(own.limit_m, own.measured.clearance_m, own.measured.sigma_m):
        board.acknowledge_one(name)
        changes = (*changes, AlarmList(parts.twin.intake.stamp_ns, tuple(board.alarms.values())))
    return changes


def _part_changed(parts: Parts, joint: str, replaced_ns: int) -> None:
    """Discard the growth and the estimates of the former part, and renew the forecast."""
    parts.grows_anew([joint])
    parts.forecaster.replaced(joint, replaced_ns)
    last = parts.state.last
    if last:  # what was estimated is of the former part
        joints = [
            attrs.evolve(each, seen=None, shown=None) if each.joint == joint else each for each in last.joints
        ]
        parts.state.last = attrs.evolve(last, joints=tuple(joints))
    if parts.encoders:
        parts.encoders.replaced()
    if parts.torque:
        parts.torque.replaced(parts.twin.clearance_mean_m)
    renew_forecast(parts)


# In a ledger that no monitor uses.


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
    gone = rested_on(entry.alarms, joint, last.joints if last and is_named else ())
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
    ledger.acknowledge_loss()
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
    known = ledger.measurements if measurements is None else measurements
    limits_m = clearance_limits(leg, config)
    joints = []
    for part in entry.joints:
        one = JointSituation(
            joint=part.name,
            counted_m=leg.clearances[part.name].radial_clearance + part.mean_m,
            limit_m=limits_m[part.name],
            label=leg.joints[part.name].label,
            replaced_ns=part.replaced_ns,
            part_cycles=part.cycles,
        )
        joints.append(with_measured(one, last_measured(known, part.name, part.replaced_ns)))
    situation = Situation(
        joints=tuple(joints), alarms=entry.alarms, quantities=alarm_specs.QUANTITIES, mismatch=math.nan
    )
    verdict = verdict_of(dated(findings(situation), (), stamp_ns))
    ledger.note(VerdictEvent(stamp_ns, verdict))


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
    row, before = last_reset(ledger, joint, since)
    part = one_part(before, since)
    ledger.note(Audit(stamp_ns, who, "undo_reset", since, undoes=row))
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
    return attrs.evolve(entry, joints=joints, spans=())
