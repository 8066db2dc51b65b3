"""Operator actions: parts replaced and put back, clearances measured, alarms acknowledged.

The command line opens a monitor on a ledger for them, as the node does.
"""

import math
from collections.abc import Iterable, Mapping

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.alarms import Alarm, joint_of
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.forecaster import MeasurementResult
from leg_wear_monitor.monitor.gait_evidence import MismatchWindow
from leg_wear_monitor.monitor.ledger.entry import Audit, JointWear, Measurement, VerdictEvent
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, with_forecast
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    BOTH,
    COUNTED,
    MEASURED,
    SOURCES,
    JointSituation,
    Situation,
    is_surely_below,
)
from leg_wear_monitor.monitor.verdict.verdict import dated, verdict_of
from leg_wear_monitor.state import Level

Cleared = tuple[tuple[Alarm, ...], tuple[Alarm, ...]]
"""Alarms that an acknowledgement or a replaced part cleared, and alarms that are still raised."""


def alarm_words(cleared: Iterable[Alarm], kept: Iterable[Alarm]) -> str:
    """Alarms that cleared, and alarms that are still raised, in one line."""
    names = [", ".join(alarm.name for alarm in alarms) or "none" for alarms in (cleared, kept)]
    return f"cleared: {names[0]}; still present: {names[1]}"


class OperatorActions:
    """Actions of an operator on a monitor."""

    _leg: MonitoredLeg

    def acknowledge(self, stamp_ns: int) -> Cleared:
        """Acknowledge all alarms, and the interruption of the previous run.

        Returns
        -------
        cleared, kept : tuple of Alarm
            Alarms that had returned to normal, and alarms that stay until they do.
        """
        leg, stamp_ns = self._leg, int(stamp_ns)
        cleared, kept = leg.evaluation.board.acknowledge(leg.unmeasured)
        if alarm_specs.MISMATCH.name() in leg.unmeasured:
            leg.torque.mismatch = MismatchWindow()
        ledger = leg.accounting.ledger
        has_lost = ledger is not None and ledger.acknowledge_loss()
        _note_alarms(leg, stamp_ns)
        note_verdict(leg, stamp_ns)
        if cleared or kept or has_lost:
            leg.keep()
        return cleared, kept

    def reset_wear(self, joint: str, stamp_ns: int, who: str) -> Cleared:
        """Reset the wear of a joint whose part was replaced; its history stays in the ledger.

        Alarms of the former part are acknowledged and clear.

        Returns
        -------
        cleared, kept : tuple of Alarm
            Alarms that cleared, and alarms that are still raised.

        Raises
        ------
        LegWearError
            For a joint without clearance.
        """
        leg, stamp_ns = self._leg, int(stamp_ns)
        board = leg.evaluation.board
        was = leg.accounting.replace(joint, stamp_ns)
        gone = _rested_on(board.alarms.values(), joint, _named_for_clearance(leg))
        cleared = tuple(board.alarms[name] for name in gone)
        board.clear(gone)
        if alarm_specs.MISMATCH.name() in gone:
            leg.torque.mismatch = MismatchWindow()
        self._part_changed(joint, stamp_ns)
        leg.accounting.note(Audit(stamp_ns, who, "reset_wear", was, cleared))
        _note_alarms(leg, stamp_ns)
        note_verdict(leg, stamp_ns)
        leg.keep()
        return cleared, tuple(alarm for alarm in board.alarms.values() if alarm.level is not Level.OK)

    def undo_reset(self, joint: str, stamp_ns: int, who: str) -> JointWear:
        """Undo the last `reset_wear` of a joint whose part was not replaced.

        Returns
        -------
        JointWear
            Sum of the wear before the reset and since.

        Raises
        ------
        LegWearError
            For a joint without clearance, or if the ledger has no reset to undo.
        """
        leg, stamp_ns = self._leg, int(stamp_ns)
        accounting, board = leg.accounting, leg.evaluation.board
        reset, before = _last_reset(accounting, joint)
        since = accounting.put_back(joint, before)
        _raise_again(board, reset.alarms)
        self._part_changed(joint, before.replaced_ns)
        accounting.note(Audit(stamp_ns, who, "undo_reset", since))
        _note_alarms(leg, stamp_ns)
        note_verdict(leg, stamp_ns)
        leg.keep()
        return accounting.wear_of(joint)

    def measure(
        self, joint: str, clearance_m: float, sigma_m: float, stamp_ns: int, who: str, accept: bool = False
    ) -> MeasurementResult:
        """Add a measured clearance to the ledger; forecast, alarms and verdict follow at once.

        The modelled clearance stays as it is.

        Parameters
        ----------
        joint : str
            Its name or its label.
        clearance_m, sigma_m : float
            Mean radial clearance, and its standard deviation.
        stamp_ns : int
        who : str
        accept : bool
            True if the measurement counts even if it contradicts the model.

        Raises
        ------
        LegWearError
            For a joint without clearance, or impossible values.
        """
        leg, stamp_ns = self._leg, int(stamp_ns)
        accounting, joint = leg.accounting, leg.mechanism.clearance_joint(joint)
        wear, best = accounting.wear_of(joint), leg.estimate_of(_situation(leg, joint))
        found = leg.forecaster.measured(
            wear,
            clearance_m=float(clearance_m),
            sigma_m=float(sigma_m),
            stamp_ns=stamp_ns,
            who=who,
            accept=accept,
            limit_m=leg.evaluation.board.clearance_limits_m[leg.clearance_joints.index(joint)],
        )
        if best:
            found = attrs.evolve(
                found, shown_m=best.clearance_m, shown_sigma_m=best.sigma_m, shown_by=SOURCES[best.by]
            )
        accounting.note(found.measurement)
        self.renew_forecast()
        before, board = leg.evaluation.board.alarms, leg.evaluation.board
        is_ended = _compare(leg, joint, stamp_ns)
        was, now = (alarms[alarm_specs.CLEARANCE.name(joint)] for alarms in (before, board.alarms))
        if now.level < was.level or (now.acknowledged and not was.acknowledged):
            accounting.note(Audit(stamp_ns, who, "measure", alarms=(was,)))  # a withdrawal raises it again
            found = attrs.evolve(found, eased=_eased(was, now))
        _note_clearance_verdict(leg, before, joint, stamp_ns, is_ended)
        self.renew_forecast()  # without a remaining life, if the verdict rests on data that it does not use
        leg.keep()
        return found

    def withdraw(self, measurement: int, stamp_ns: int, who: str) -> Measurement:
        """Withdraw a measurement: it stays in the ledger unused, and a stop that it ended returns.

        Parameters
        ----------
        measurement : int
            Its `id`.
        stamp_ns : int
            Not 0.
        who : str

        Raises
        ------
        LegWearError
            If the ledger has no such measurement, or it is withdrawn already.
        """
        leg, stamp_ns = self._leg, int(stamp_ns)
        accounting, board = leg.accounting, leg.evaluation.board
        found = leg.forecaster.withdrawn(measurement, stamp_ns, who)
        accounting.note(found)
        if found.replaced_ns == accounting.wear_of(found.joint).replaced_ns:
            leg.forecaster.estimate_anew(found.joint, found.replaced_ns)
            before, joint = board.alarms, _situation(leg, found.joint)
            for alarm in _eased_by_withdrawn(leg, found):
                if not _ends(joint, alarm):  # a different measurement may end it as well
                    _raise_again(board, [alarm])
            is_ended = _compare(leg, found.joint, stamp_ns)
            _note_alarms(leg, stamp_ns)
            _note_clearance_verdict(leg, before, found.joint, stamp_ns, is_ended)
        leg.keep()
        return found

    def renew_forecast(self) -> CycleReport | None:
        """Renew the forecast now; otherwise it may be a minute old.

        Returns
        -------
        CycleReport or None
            The last gait cycle with the new forecast; None before the first.
        """
        leg, last = self._leg, self._leg.last
        if last is None:
            return None
        forecast = leg.forecaster.renewed(
            leg.worn_m(leg.twin.clearance_mean_m),
            leg.evaluation.board.clearance_limits_m,
            leg.is_forecast_valid(leg.verdict_report().findings),
            leg.load_sigma,
        )
        leg.last = with_forecast(last, forecast, leg.measured)
        return leg.last

    def _part_changed(self, joint: str, replaced_ns: int) -> None:
        """Discard the estimates of the former part, and renew the forecast."""
        leg, last = self._leg, self._leg.last
        leg.forecaster.replaced(joint, replaced_ns)
        if last:  # the estimate belongs to the former part
            joints = [
                attrs.evolve(each, seen=None, estimated_m=None, estimated_sigma_m=None)
                if each.joint == joint
                else each
                for each in last.joints
            ]
            leg.last = attrs.evolve(last, joints=tuple(joints))
        for observer in leg.observers:
            observer.replaced(leg.clearance_joints.index(joint))
        self.renew_forecast()


def _last_reset(accounting: Accounting, joint: str) -> tuple[Audit, JointWear]:
    """The last reset of a joint, and the wear before it; earlier events cannot be undone."""
    if accounting.ledger is None:
        raise LegWearError(f"joint {joint}: no ledger is used, so the wear before a reset is not stored")
    own = [one for one in accounting.ledger.audits if one.joint and one.joint.name == joint]
    resets = [one for one in own if one.what in ("reset_wear", "undo_reset")]
    if not resets or resets[-1].joint is None or resets[-1].what != "reset_wear":
        raise LegWearError(f"joint {joint}: the ledger has no reset to undo")
    return resets[-1], resets[-1].joint


def _raise_again(board: AlarmBoard, alarms: Iterable[Alarm]) -> None:
    """Set alarms as they were before an action that is taken back, unless they are more severe now."""
    now = board.alarms
    known = [alarm for alarm in alarms if alarm.name in now and alarm.level >= now[alarm.name].level]
    board.alarms = now | {alarm.name: alarm for alarm in known}


def _eased_by_withdrawn(leg: MonitoredLeg, like: Measurement) -> tuple[Alarm, ...]:
    """The alarm before the first withdrawn measurement of a part eased it."""
    part, ledger = (like.joint, like.replaced_ns), leg.accounting.ledger
    withdrawn = [one for one in leg.forecaster.measurements if one.is_withdrawn]
    stamps = {one.stamp_ns for one in withdrawn if (one.joint, one.replaced_ns) == part}
    audits = [one for one in ledger.audits if one.what == "measure"] if ledger else []
    eased = (alarm for one in audits if one.stamp_ns in stamps for alarm in one.alarms)
    return tuple(alarm for alarm in eased if alarm.subject == like.joint)[:1]


def _eased(was: Alarm, now: Alarm) -> str:
    """Sentence on an earlier measurement's alarm that this measurement ends; empty without such an alarm."""
    if was.cause not in (MEASURED, BOTH):
        return ""
    if now.level < was.level:
        return "alarm_lowered" if now.level is not Level.OK else "alarm_ends"
    return "alarm_acknowledged"


def _situation(leg: MonitoredLeg, joint: str) -> JointSituation:
    return next(each for each in leg.situation().joints if each.joint == joint)


def _note_alarms(leg: MonitoredLeg, stamp_ns: int) -> None:
    leg.accounting.note_alarms(AlarmList(stamp_ns, tuple(leg.evaluation.board.alarms.values())))


def _rested_on(alarms: Iterable[Alarm], joint: str, named: Iterable[str]) -> tuple[str, ...]:
    """Names of the raised alarms that the replaced part of a joint caused.

    The joint's own alarms; and the torque residual if this joint explains it: if its clearance was at a
    limit, or the verdict named it for its clearance.

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


def _named_for_clearance(leg: MonitoredLeg) -> frozenset[str]:
    """Joints that the last verdict named for their clearance: of this run, or else of the ledger."""
    ledger = leg.accounting.ledger
    last = ledger.verdict if ledger else None
    found = leg.findings or ((last,) if last else ())
    of_clearance = (one for one in found if one.fault_code.startswith("CLEARANCE"))
    return frozenset(joint for one in of_clearance for joint in one.joints)


def note_verdict(leg: MonitoredLeg, stamp_ns: int, milder: bool = True) -> None:
    """Bring the verdict up to date.

    A run that has not evaluated its input yet has no verdict: the ledger then gets the verdict of its alarms
    and clearances, because it knows nothing of the drive torque until the leg walks again. With ``milder``
    False, it keeps a more severe verdict.
    """
    if leg.findings or leg.accounting.ledger is None:
        leg.update_verdict()
        return
    now = leg.situation()
    known = Situation(joints=now.joints, alarms=now.alarms, mismatch=math.nan)
    verdict, last = verdict_of(dated(findings(known), (), stamp_ns)), leg.accounting.ledger.verdict
    if milder or last is None or verdict.state.severity >= last.state.severity:
        leg.accounting.note(VerdictEvent(stamp_ns, verdict))


def _note_clearance_verdict(
    leg: MonitoredLeg, before: Mapping[str, Alarm], joint: str, stamp_ns: int, is_ended: bool
) -> None:
    """Update the verdict after a measurement, if the alarm of the clearance is or was raised."""
    name = alarm_specs.CLEARANCE.name(joint)
    levels = {alarms[name].level for alarms in (before, leg.evaluation.board.alarms)}
    if leg.findings or levels != {Level.OK}:
        note_verdict(leg, stamp_ns, milder=is_ended)


def _compare(leg: MonitoredLeg, joint: str, stamp_ns: int) -> bool:
    """Compare a new measurement with the limit; return whether it ends an alarm that it contradicts."""
    joints = leg.situation().joints
    board, name = leg.evaluation.board, alarm_specs.CLEARANCE.name(joint)
    is_ended = any(each.joint == joint and _ends(each, board.alarms[name]) for each in joints)
    for change in leg.evaluate_clearances(joints, stamp_ns):
        leg.accounting.note_alarms(change)
    if is_ended:
        board.acknowledge_one(name)
        _note_alarms(leg, stamp_ns)
    return is_ended


def _ends(joint: JointSituation, alarm: Alarm) -> bool:
    """True if the last measurement of a joint contradicts the basis of the alarm of its clearance."""
    if joint.measured is None or alarm.cause in ("", COUNTED) or alarm.level is Level.OK:
        return False
    if alarm.cause in (MEASURED, BOTH) and not joint.is_measurement_used:
        return False  # an unused measurement does not end an alarm of an earlier measurement
    return is_surely_below(joint.limit_m, joint.measured)


def wear_words(wear: JointWear) -> str:
    """Mean total wear of both surfaces, and its number of gait cycles."""
    return f"{1e6 * wear.mean_m:.4g} µm of wear from {wear.cycles} gait cycles"
