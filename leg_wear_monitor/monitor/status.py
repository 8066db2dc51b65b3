"""The monitor's own state, as /diagnostics shows it: stable names, numbers only as values."""

import math
from collections.abc import Iterable, Sequence

import attrs

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.alarms import (
    ADVICE,
    CRANK_ZERO,
    LEDGER_INTERRUPTED,
    LEDGER_NOT_WRITTEN,
    TRACKING_LOST,
    Alarm,
    amount,
    code_of,
    worst_code,
)
from leg_wear_monitor.monitor.evaluation import AlarmEvaluation
from leg_wear_monitor.monitor.forecast.forecast import UNKNOWN, answer_words, lifetime_values
from leg_wear_monitor.monitor.input_health import InputFault, kind_of
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.reports import Status, VerdictReport
from leg_wear_monitor.monitor.verdict.situation import SOURCES, KnownClearance
from leg_wear_monitor.monitor.verdict.verdict import (
    estimate,
    level_of,
    rules,
    with_unit,
)
from leg_wear_monitor.state import JointClearance, Level, State, Verdict
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.statistics import Tracking

# All statuses, each from the part of the monitor that it is about.


_INPUT = tuple(spec.name() for spec in alarm_specs.OF_INPUT)
"""Names of the alarms of the input."""
_OF_CYCLE = (
    "growth_m_per_cycle", "growth_mps", "peak_force_n", "p99_force_n", "mean_force_n", "impacts",
)  # fmt: skip
"""Values of a joint in a gait cycle."""


def statuses(leg: MonitoredLeg, report: VerdictReport) -> tuple[Status, ...]:
    """All statuses, verdict first, then gait, input, observers, joints, alarms and ledger.

    Parameters
    ----------
    parts : MonitoredLeg
    report : VerdictReport
        The verdict now, with the state of the leg.
    """
    clearances, names = report.state.clearances, leg.clearance_joints
    findings = [[one for one in report.findings if name in one.joints] for name in names]
    return (
        verdict_status(report.verdict),
        _gait(leg),
        _input(leg),
        *(status for each in leg.observers for status in each.statuses),
        *(_joint(leg, k, clearances[name], findings[k]) for k, name in enumerate(names)),
        alarms_status(leg.evaluation.board.alarms.values()),
        _ledger(leg.accounting),
    )


def verdict_status(verdict: Verdict) -> Status:
    """The verdict: severity, start, a 1 for each joint and kind of value concerned, evidence."""
    values = {"severity": float(verdict.state.severity), "since_s": verdict.since_ns / 1e9}
    values |= {f"joint_{joint}": 1.0 for joint in verdict.joints}
    values |= {f"not_valid_{figure.value}": 1.0 for figure in verdict.not_valid}
    for each in verdict.evidence:
        name = each.name.replace(" ", "_")
        values[with_unit(name, each.unit)] = or_nan(each.value)
        values[with_unit(f"{name}_limit", each.unit)] = or_nan(each.limit)
    return Status("verdict", level_of(verdict), verdict.words, values, verdict.fault_code)


def _gait(leg: MonitoredLeg) -> Status:
    """True if the crank is tracked, the cadence, and the totals of all walking."""
    tracking, event, last = leg.twin.tracking, leg.happened, leg.last
    cadence = leg.evaluation.board.alarms[alarm_specs.CADENCE.name()]
    message, level, code = tracking.name.lower().replace("_", " "), cadence.level, code_of(cadence)
    if leg.guard.cause:
        message, level, code = "not monitored: see input", Level.ERROR, TRACKING_LOST
    elif any(CRANK_ZERO in each.notes for each in leg.observers):
        message, level, code = "not monitored: see crank zero", max(level, Level.WARN), CRANK_ZERO
    elif event and tracking in (Tracking.STARTING, Tracking.OUT_OF_STEP):
        message += f", last {event.what.value.replace('_', ' ')}"
    if leg.config.wear_acceleration != 1.0:
        message += "; wear is accelerated for a demonstration"
    values = {
        "cadence_rpm": leg.twin.speed_radps * 30.0 / math.pi,
        "commanded_rpm": leg.config.cadence.commanded_rpm,
        "wear_acceleration": leg.config.wear_acceleration,
        **leg.accounting.totals,
        "cycle_moving_s": last.moving_s if last else math.nan,
    }
    return Status("gait", level, message, values, code)


def _input(leg: MonitoredLeg) -> Status:
    """Samples that were received, used and refused, by reason; rates of the last evaluation period."""
    evaluation, guard = leg.evaluation, leg.guard
    counts = attrs.asdict(leg.twin.intake)
    faulty, used = counts.pop("faulty"), counts.pop("used")
    for stamp in ("newest_stamp_ns", "followed_stamp_ns"):
        counts.pop(stamp)
    values = (
        evaluation.health
        | {"received": counts.pop("received")}
        | {f"{name}_used": count for name, count in used.items()}
    )
    # the other counters of the intake by their names, such as duplicates and gaps_lost
    values |= counts | {"already_counted": leg.accounting.skipped}
    values |= {name: getattr(guard, name) for name in ("conflicting", "implausible", "torque_outliers")}
    values |= {f"faulty_{name}": count for name, count in faulty.items()}
    level, code = evaluation.board.level(*_INPUT), _code(evaluation, _INPUT)
    bad = [name for name in _INPUT if evaluation.board.alarms[name].level is not Level.OK]
    faults = leg.judge.faults
    messages = [*map(_sentence, faults), *evaluation.causes, *([f"see: {', '.join(bad)}"] if bad else [])]
    message = "; ".join(messages) or "in order"
    if faults:
        is_blind = any(kind_of(one.code) == CRANK for one in faults)
        level, code = max(level, Level.ERROR if is_blind else Level.WARN), faults[0].code
    if guard.cause:
        level, code = Level.ERROR, TRACKING_LOST
    return Status("input", level, message, {name: float(value) for name, value in values.items()}, code)


def _sentence(fault: InputFault) -> str:
    """A fault of the input, and the remedy."""
    rule = rules()[fault.code]
    return f"{rule.why}. {rule.do[0].upper()}{rule.do[1:]}".format(**fault.texts)


def _code(evaluation: AlarmEvaluation, names: Iterable[str]) -> str:
    """Code of the worst alarm."""
    return worst_code(evaluation.board.alarms[name] for name in names)


def _joint(leg: MonitoredLeg, k: int, known: JointClearance, findings: Sequence[Verdict]) -> Status:
    """Clearance, growth, forces and forecast of joint k, with its worst alarm or the worst finding on it."""
    joint, board, measured = leg.clearance_joints[k], leg.evaluation.board, leg.measured[k]
    report = leg.last.joints[k] if leg.last else None
    forecast = report.forecast if report else None
    names = [spec.name(joint) for spec in alarm_specs.JOINT]
    level, code = board.level(*names), _code(leg.evaluation, names)
    values, words = dict[str, float](), list[str]()
    if known.best_estimate_m is not None:
        by, sigma_m = known.best_estimate_source or "", or_nan(known.best_estimate_sigma_m)
        values |= {"best_estimate_m": known.best_estimate_m, f"best_estimate_source_{by}": 1.0}
        if not math.isnan(sigma_m):
            values["best_estimate_sigma_m"] = sigma_m
        words.append(f"{KnownClearance(by, known.best_estimate_m, sigma_m).words} according to {SOURCES[by]}")
    values |= {
        "clearance_m": known.modelled_m,
        "clearance_max_m": float(leg.twin.clearance_max_m[k]),
        "clearance_limit_m": known.limit_m,
    }
    if report:
        values |= {name: float(or_nan(getattr(report, name))) for name in _OF_CYCLE}
        values |= _load_values(report.load) if report.load else {}
    if forecast:
        values |= UNKNOWN | lifetime_values(forecast)
        if forecast.prior:
            values["wear_coefficient_sigma"] = forecast.prior.sigma
        words.append(answer_words(forecast))
    else:
        words.append("no forecast yet" if report else "no whole gait cycle yet")
    if measured:
        values |= {"measured_clearance_m": measured.clearance_m, "measured_sigma_m": measured.sigma_m}
        unused = "" if measured.counts else " (contradicts the model, so the forecast does not use it)"
        size = estimate(measured.clearance_m, measured.sigma_m, "m")
        words.append(f"{size} was measured{unused}, {amount(known.modelled_m, 'm')} is modelled")
    worst = max(findings, key=lambda finding: finding.state.severity, default=None)
    # a finding counts that is worse than the joint's own alarms; of equals, one that asks to inspect or stop
    if worst and (level_of(worst), worst.state in (State.INSPECT, State.STOP)) > (level, False):
        level, code = level_of(worst), worst.fault_code
        words[0] = f"{worst.state.words}: {words[0]}"
    return Status(f"joint {joint}", level, "; ".join(words), values, code)


def _load_values(load: BushingLoad) -> dict[str, float]:
    """Pressure and sliding speed, and the limits that the material gives."""
    values = attrs.asdict(load)
    return {name: value for name, value in values.items() if isinstance(value, float)}


def alarms_status(alarms: Iterable[Alarm]) -> Status:
    """The raised alarms of a list by name, and how many are not acknowledged."""
    raised = [alarm for alarm in alarms if alarm.level is not Level.OK]
    waiting = sum(not alarm.acknowledged for alarm in raised)
    level = max((alarm.level for alarm in raised), default=Level.OK)
    message = f"raised: {', '.join(alarm.name for alarm in raised)}" if raised else f"none; {ADVICE}"
    values = {"raised": float(len(raised)), "unacknowledged": float(waiting)}
    return Status("alarms", level, message, values, worst_code(raised))


def _ledger(accounting: Accounting) -> Status:
    """True if the wear is on the disk; ``not_kept_s``: time of walking that is not on the disk yet."""
    ledger = accounting.ledger
    if ledger is None:
        return Status("ledger", Level.OK, "no ledger: the wear is lost when the monitor ends", {})
    values = {"not_kept_s": accounting.not_kept_s}
    if ledger.fault:
        message = f"not written: {ledger.fault}; trying again"
        return Status("ledger", Level.ERROR, message, values, LEDGER_NOT_WRITTEN)
    if ledger.cut_off_s is not None:
        values["cut_off_s"] = ledger.cut_off_s
        message = "an earlier run was interrupted; the wear of its last seconds is lost"
        return Status("ledger", Level.WARN, message, values, LEDGER_INTERRUPTED)
    message = "will be written at the end of the recording" if ledger.at_end else "kept"
    return Status("ledger", Level.OK, message, values)
