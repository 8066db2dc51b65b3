"""What operators do: parts replaced and put back, clearances measured, alarms acknowledged.

First in a monitor, then in a ledger that no monitor uses, whose entry is changed in the same way.
"""

import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import Alarm, acknowledged, cleared
from leg_wear_monitor.monitor.cleared_alarms import cleared_at, eased, named_for_clearance, rested_on
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.measurement import (
    MeasurementResult,
    believed_clearance_m,
    last_measured,
)
from leg_wear_monitor.monitor.gait_evidence import NO_MISMATCH
from leg_wear_monitor.monitor.judgement import (
    evaluate_clearances,
    is_forecast_valid,
    shown,
    situation_of,
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
    clearance_limit_key,
    new_part,
    one_part,
)
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, with_forecast
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    BOTH,
    COUNTED,
    MEASURED,
    SEEN,
    SOURCES,
    JointSituation,
    KnownClearance,
    Situation,
    alarm_value,
    is_observed,
    is_surely_below,
)
from leg_wear_monitor.monitor.verdict.verdict import dated, verdict_of
from leg_wear_monitor.state import Level, Verdict


def last_reset(ledger: Ledger | None, joint: str, now: JointWear) -> tuple[Ledger, Audit, JointWear]:
    """The last reset of a joint that was not taken back, in its ledger, and the joint's wear before it.

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
    return ledger, found, found.joint


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
    if alarm_specs.MISMATCH.name() in parts.unmeasured:
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
    accounting, board = parts.accounting, parts.evaluation.board
    ledger, reset, before = last_reset(accounting.ledger, joint, accounting.wear_of(joint))
    since = accounting.put_back(joint, before)
    raised = {alarm.name: alarm for alarm in cleared_at(ledger, [reset.stamp_ns], board.alarms)}
    known = {name: alarm_specs.with_its_unit(raised[name]) for name in raised if name in board.alarms}
    board.alarms = board.alarms | known
    _part_changed(parts, joint, before.replaced_ns)
    name = alarm_specs.CLEARANCE.name(joint)
    if name in known and _ends(_situation(parts, joint), known[name]):
        board.acknowledge_one(name)  # as it was before the reset
    accounting.note(Audit(stamp_ns, who, "undo_reset", since, undoes=reset.id))
    _note_alarms(parts, stamp_ns)
    update_verdict(parts)
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
    before, board = parts.evaluation.board.alarms, parts.evaluation.board
    _compare(parts, joint, stamp_ns)
    found = attrs.evolve(found, eased=eased(before.values(), board.alarms.values(), joint))
    update_verdict(parts)
    renew_forecast(parts)  # without a remaining life, if the verdict rests on what it does not use
    parts.keep()
    return found


def renew_forecast(parts: Parts) -> CycleReport | None:
    """See `WearMonitor.renew_forecast`."""
    last = parts.state.last
    if last is None:
        return None
    forecast = parts.forecaster.renewed(
        parts.worn_m(parts.twin.clearance_mean_m),
        parts.evaluation.board.clearance_limits_m,
        is_forecast_valid(parts, verdict_report(parts).findings),
        parts.model_error,
    )
    parts.state.last = with_forecast(last, forecast, parts.measured)
    return parts.state.last


def _situation(parts: Parts, joint: str) -> JointSituation:
    return next(each for each in situation_of(parts).joints if each.joint == joint)


def _note_alarms(parts: Parts, stamp_ns: int) -> None:
    parts.accounting.note_alarms(AlarmList(stamp_ns, tuple(parts.evaluation.board.alarms.values())))


def _compare(parts: Parts, joint: str, stamp_ns: int) -> None:
    """Compare a new measurement with the limit; it ends an alarm of the clearance that it contradicts."""
    joints = situation_of(parts).joints
    for change in evaluate_clearances(parts, joints):
        parts.accounting.note_alarms(change)
    board, name = parts.evaluation.board, alarm_specs.CLEARANCE.name(joint)
    if any(each.joint == joint and _ends(each, board.alarms[name]) for each in joints):
        board.acknowledge_one(name)
        _note_alarms(parts, stamp_ns)  # that of the measurement, by which a withdrawal finds it


def _ends(joint: JointSituation, alarm: Alarm) -> bool:
    """Whether the last measurement of a joint contradicts what the alarm of its clearance rests on."""
    if joint.measured is None or alarm.cause in ("", COUNTED) or alarm.level is Level.OK:
        return False
    if alarm.cause in (MEASURED, BOTH) and not joint.is_measurement_used:
        return False  # what does not count does not end what another measurement has raised
    return is_surely_below(joint.limit_m, joint.measured.clearance_m, joint.measured.sigma_m)


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
    for alarm in entry.alarms:
        if alarm.name in gone:
            entry = _with_alarm(ledger, entry, cleared(alarm), stamp_ns)
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


def measured_in(
    ledger: Ledger, leg: Mechanism, config: MonitorConfig, found: Measurement
) -> tuple[Entry | None, str]:
    """Compare a measurement with the limit of the clearance, as a monitor does; verdict and history follow.

    It raises the alarm of the clearance at once, and ends one that it contradicts.

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
    Entry or None
        To be recorded; None if no alarm of the clearance is raised.
    str
        What became of an alarm that an earlier measurement had raised, see `MeasurementResult.eased`.
    """
    entry, known = ledger.entry, (*ledger.measurements, found)
    if entry is None:
        return None, ""
    one = _joint_in(ledger, _part_in(entry, found.joint), leg, config, known)
    now = _judged(ledger, entry, leg, config, one, known, found.stamp_ns)
    return now, eased(entry.alarms, now.alarms, found.joint) if now else ""


def withdraw_in(
    ledger: Ledger, leg: Mechanism, config: MonitorConfig, number: int, stamp_ns: int, who: str
) -> Measurement:
    """Withdraw a measurement in a ledger that no monitor uses; what it has ended is raised again.

    Parameters
    ----------
    ledger : Ledger
    leg : Mechanism
    config : MonitorConfig
    number : int
        The `id` of the measurement.
    stamp_ns : int
        Not 0.
    who : str

    Returns
    -------
    Measurement
        The withdrawn measurement.

    Raises
    ------
    LedgerError
        If there is no such measurement, it is withdrawn already, or the ledger cannot be written.
    """
    found, entry = ledger.withdraw(number, stamp_ns, who), ledger.entry
    if entry is not None and found.replaced_ns == _part_in(entry, found.joint).replaced_ns:
        one = _joint_in(ledger, _part_in(entry, found.joint), leg, config, ledger.measurements)
        name = alarm_specs.CLEARANCE.name(found.joint)
        now = {alarm.name: alarm for alarm in entry.alarms}
        stamps = [
            each.stamp_ns
            for each in ledger.measurements
            if each.is_withdrawn and (each.joint, each.replaced_ns) == (found.joint, found.replaced_ns)
        ]
        for alarm in cleared_at(ledger, stamps, now):
            if alarm.name == name and not _ends(one, alarm):  # another measurement may do so as well
                entry = _with_alarm(ledger, entry, alarm, stamp_ns)
        entry = _judged(ledger, entry, leg, config, one, ledger.measurements, stamp_ns)
    ledger.record(entry)
    return found


def _judged(
    ledger: Ledger,
    entry: Entry,
    leg: Mechanism,
    config: MonitorConfig,
    one: JointSituation,
    known: Sequence[Measurement],
    stamp_ns: int,
) -> Entry | None:
    """The entry with the alarm of a clearance evaluated; None if it is not raised, before and after.

    A verdict that is milder than that of the ledger, which knew what the drive torque shows, is noted only
    if the last measurement contradicts the alarm.
    """
    name, board = alarm_specs.CLEARANCE.name(one.joint), AlarmBoard(config, leg.clearance_joints)
    board.restore(entry.alarms)
    before, value = board.alarms[name], alarm_value(one, board.alarms[name])
    is_shown = before.present is Level.ERROR and is_observed(before, SEEN)  # only who showed it takes it back
    if value is not None and not is_shown:
        sources = {name: (value.sigma_m, value.by)}
        board.evaluate({name: value.clearance_m}, stamp_ns, config.alarms.on_delay_cycles, sources)
    is_ended = _ends(one, before)
    if is_ended:
        board.acknowledge_one(name)
    now = board.alarms[name]
    if Level.OK is before.level is now.level:
        return None
    entry = _with_alarm(ledger, entry, now, stamp_ns)
    last, verdict = ledger.last_verdict, verdict_in(ledger, entry, leg, config, stamp_ns, known)
    if is_ended or last is None or verdict.state.severity >= last.state.severity:
        ledger.note(VerdictEvent(stamp_ns, verdict))
    return entry


def clearance_limits(leg: Mechanism, config: MonitorConfig) -> dict[str, float]:
    """Limit of each clearance joint's clearance [m]."""
    joints = leg.clearance_joints
    return dict(zip(joints, AlarmBoard(config, joints).clearance_limits_m, strict=True))


def limit_in(ledger: Ledger, joint: str) -> float | None:
    """Limit of a joint's clearance [m] that a monitor last had; None if a ledger does not know it.

    A ledger of an earlier version knows it from the changes of the alarm alone.
    """
    if ledger.entry and (limit_m := ledger.entry.totals.get(clearance_limit_key(joint))):
        return limit_m
    name = alarm_specs.CLEARANCE.name(joint)
    changes = (event.alarm for event in reversed(ledger.alarm_history))
    alarms = (*(ledger.entry.alarms if ledger.entry else ()), *changes)
    known = (each.limit for each in alarms if each.name == name and not math.isnan(each.limit))
    return next(known, None)


def note_verdict_of(
    ledger: Ledger, entry: Entry, leg: Mechanism, config: MonitorConfig, stamp_ns: int
) -> None:
    """Note the verdict of an entry that an operator changed, see `verdict_in`."""
    verdict = verdict_in(ledger, entry, leg, config, stamp_ns, ledger.measurements)
    ledger.note(VerdictEvent(stamp_ns, verdict))


def verdict_in(
    ledger: Ledger,
    entry: Entry,
    leg: Mechanism,
    config: MonitorConfig,
    stamp_ns: int,
    measurements: Sequence[Measurement],
) -> Verdict:
    """The verdict of an entry, by the rules of the monitor.

    Nothing is known of the drive torque until the leg walks again.
    """
    situation = Situation(
        joints=tuple(_joint_in(ledger, part, leg, config, measurements) for part in entry.joints),
        alarms=tuple(map(alarm_specs.with_its_unit, entry.alarms)),
        quantities=alarm_specs.QUANTITIES,
        mismatch=math.nan,
    )
    return verdict_of(dated(findings(situation), (), stamp_ns))


def _joint_in(
    ledger: Ledger, part: JointWear, leg: Mechanism, config: MonitorConfig, known: Sequence[Measurement]
) -> JointSituation:
    """What a ledger says of the clearance of a part; with its measurements, what the forecast believes."""
    one = JointSituation(
        joint=part.name,
        counted_m=leg.clearances[part.name].radial_clearance + part.mean_m,
        believed_m=believed_clearance_m(leg, config.forecast, part, known, ledger.corrections),
        limit_m=clearance_limits(leg, config)[part.name],
        label=leg.joints[part.name].label,
        replaced_ns=part.replaced_ns,
        part_cycles=part.cycles,
    )
    return with_measured(one, last_measured(known, part.name, part.replaced_ns))


def undo_in(
    ledger: Ledger, leg: Mechanism, config: MonitorConfig, joint: str, stamp_ns: int, who: str
) -> JointWear:
    """Undo the last reset of a joint in a ledger that no monitor uses.

    The alarms that it has cleared are raised again; the verdict in the ledger follows.

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
    _, reset, before = last_reset(ledger, joint, since)
    part = one_part(before, since)
    entry = _with_part(entry, part)
    one = _joint_in(ledger, part, leg, config, ledger.measurements)
    for alarm in cleared_at(ledger, [reset.stamp_ns], {alarm.name: alarm for alarm in entry.alarms}):
        is_ended = alarm.name == alarm_specs.CLEARANCE.name(joint) and _ends(one, alarm)
        entry = _with_alarm(ledger, entry, acknowledged(alarm) if is_ended else alarm, stamp_ns)
    ledger.note(Audit(stamp_ns, who, "undo_reset", since, undoes=reset.id))
    note_verdict_of(ledger, entry, leg, config, stamp_ns)
    ledger.record(entry)
    return part


def wear_words(wear: JointWear) -> str:
    """Mean total wear of both surfaces, and its number of gait cycles."""
    return f"{1e6 * wear.mean_m:.4g} um of wear from {wear.cycles} gait cycles"


def _entry_with(ledger: Ledger, joint: str) -> tuple[Entry, JointWear]:
    """The ledger's entry, and the present part of a joint in it."""
    if ledger.entry is None:
        raise LegWearError(f"joint {joint}: the ledger contains no wear yet")
    return ledger.entry, _part_in(ledger.entry, joint)


def _part_in(entry: Entry, joint: str) -> JointWear:
    """The present part of a joint: the ledger is bound to the clearance joints of its leg."""
    return next(part for part in entry.joints if part.name == joint)


def _with_alarm(ledger: Ledger, entry: Entry, now: Alarm, stamp_ns: int) -> Entry:
    """The entry with an alarm as it is now; what operators see of the change is an event."""
    before = next((each for each in entry.alarms if each.name == now.name), cleared(now))
    if (before.level, before.acknowledged) != (now.level, now.acknowledged):
        ledger.note(AlarmEvent(stamp_ns, now))
    others = tuple(each for each in entry.alarms if each.name != now.name)
    return attrs.evolve(entry, alarms=(*others, now) if now.level is not Level.OK else others)


def _with_part(entry: Entry, part: JointWear) -> Entry:
    """The entry with another part of a joint; the spans stay those of the run that counted them."""
    joints = tuple(part if each.name == part.name else each for each in entry.joints)
    return attrs.evolve(entry, joints=joints, spans=())
