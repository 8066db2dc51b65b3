"""State of a leg as its ledger has it, for views that do not run a monitor."""

from pathlib import Path

from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.measurement import last_measured
from leg_wear_monitor.monitor.judgement import joint_clearance, leg_alarm, with_measured
from leg_wear_monitor.monitor.ledger.entry import JointWear, binding_of, clearance_limit_key
from leg_wear_monitor.monitor.ledger.ledger import LedgerContent, read_ledger
from leg_wear_monitor.monitor.verdict.situation import JointSituation
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE
from leg_wear_monitor.state import Figure, JointClearance, LegAlarms, LegState, LifeHours, State, Verdict

NO_VERDICT = Verdict(
    state=State.NOT_MONITORED,
    joints=(),
    why="there is no verdict on the leg yet",
    since_ns=0,
    do="let the leg walk with the monitor running",
    evidence=(),
    not_valid=(),
    fault_code=NO_GAIT_CYCLE,
)


def content_of(path: Path, mechanism: Mechanism, config: MonitorConfig) -> LedgerContent:
    """Content of a ledger of this leg, from a copy; see `read_ledger`.

    Parameters
    ----------
    path : pathlib.Path
    mechanism : Mechanism
        As `fitted` returned it.
    config : MonitorConfig
    """
    return read_ledger(path, binding_of(mechanism, config))


def state_in_ledger(found: LedgerContent, mechanism: Mechanism, config: MonitorConfig) -> LegState:
    """State of the leg by its ledger alone.

    It has the wear, alarms, measurements, last verdict and last forecasts. It has no drive, load or
    diagnosis, and no torque estimate without an alarm, because the ledger does not keep them.
    """
    verdict, entry = found.verdict or NO_VERDICT, found.entry
    parts = {part.name: part for part in entry.joints} if entry else {}
    joints = mechanism.clearance_joints
    limits_m = dict(zip(joints, AlarmBoard(config, joints).clearance_limits_m, strict=True))
    is_doubted = Figure.FORECAST in verdict.not_valid
    known = [parts[joint] for joint in joints if joint in parts]
    return LegState(
        verdict=verdict,
        clearances={
            part.name: _clearance(
                found,
                part,
                float(mechanism.clearances[part.name].radial_clearance),
                limits_m[part.name],
                verdict,
            )
            for part in known
        },
        life={part.name: None if is_doubted else _life(found, part) for part in known},
        alarms=LegAlarms(now=tuple(map(leg_alarm, entry.alarms if entry else ()))),
        stamp_ns=entry.stamp_ns if entry else 0,
        life_cycles=found.cycles,
    )


def _clearance(
    found: LedgerContent, part: JointWear, new_m: float, limit_m: float, verdict: Verdict
) -> JointClearance:
    joint, totals = part.name, found.entry.totals if found.entry else {}
    limit_m = totals.get(clearance_limit_key(joint), limit_m)
    last = last_measured(found.measurements, joint, part.replaced_ns)
    situation = JointSituation(joint=joint, modelled_m=new_m + part.mean_m, limit_m=limit_m)
    alarms = found.entry.alarms if found.entry else ()
    own = next((each for each in alarms if (each.kind, each.subject) == ("clearance", joint)), None)
    return joint_clearance(with_measured(situation, last), own, [verdict], new_m)


def _life(found: LedgerContent, part: JointWear) -> LifeHours | None:
    """Hours of walking from the last forecast on, with the part's own mean duration of a gait cycle.

    It is not known after a later measurement, because the forecast does not contain it.
    """
    point = found.forecasts.get(part.name)
    if point is None or not part.cycles or point.stamp_ns < part.replaced_ns:
        return None
    last = last_measured(found.measurements, part.name, part.replaced_ns)
    if last is not None and last.counts and last.stamp_ns > point.stamp_ns:
        return None
    since = max(0, found.cycles - point.cycle)
    hours = part.moving_s / part.cycles / 3600.0
    p10, p50, p90 = (
        hours * max(0.0, cycles - since) for cycles in (point.p10_cycles, point.p50_cycles, point.p90_cycles)
    )
    return LifeHours(p10_h=p10, p50_h=p50, p90_h=p90)
