"""What was taken in, as counts with names."""

from leg_wear_monitor.twin.follower.state import FAILED_NS, FAILURES, MOVING_NS, LegState
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT
from leg_wear_monitor.twin.statistics import Intake
from leg_wear_monitor.twin.tracker import state as t


def intake(tracker: t.TrackerState, leg: LegState) -> Intake:
    """Counts of a tracker and of the leg that follows it."""
    count, clock, mark = tracker.counts, tracker.clock, leg.mark
    out = bool(clock[t.OUT_SINCE]) and not clock[t.FOLLOWED]
    return Intake(
        received=int(count[t.RECEIVED]),
        faulty={name: int(count[t.FAULTY + fault]) for fault, name in FAULTS.items() if fault != NO_FAULT},
        crank_used=int(count[t.CRANKS]),
        torque_used=int(count[t.TORQUES]),
        duplicates=int(count[t.DUPLICATES]),
        late=int(count[t.LATE]),
        stray_stamps=int(count[t.STRAY]),
        outliers=int(count[t.OUTLIERS]),
        velocity_outliers=int(count[t.VELOCITY_OUTLIERS]),
        gaps_bridged=int(count[t.GAPS]),
        lost=int(count[t.LOST_TIMES]),
        backward_jumps=int(count[t.JUMPS]),
        reversals=int(count[t.REVERSALS]),
        failures=int(mark[FAILURES]),
        bridged_s=float(count[t.BRIDGED_NS]) * 1.0e-9,
        moving_s=float(mark[MOVING_NS]) * 1.0e-9,
        standing_s=float(count[t.STANDING_NS]) * 1.0e-9,
        unmonitored_s=float(count[t.UNMONITORED_NS] + mark[FAILED_NS]) * 1.0e-9,
        out_s=float(clock[t.RELEASED] - clock[t.OUT_SINCE]) * 1.0e-9 if out else 0.0,
        newest_stamp_ns=int(clock[t.NEWEST]),
        followed_stamp_ns=int(clock[t.LAST_SPLINE_NODE]),
    )
