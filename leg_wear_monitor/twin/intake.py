"""What was taken in, as counts with names."""

from leg_wear_monitor.record import Record
from leg_wear_monitor.twin.follower.state import FAILED_NS, FAILURES, MOVING_NS, LegState
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT
from leg_wear_monitor.twin.statistics import Intake


def intake(tracker: Record, leg: LegState) -> Intake:
    """Counts of a tracker, `TRACKER_STATE`, and of the leg that follows it."""
    count, clock, mark = tracker.counts, tracker.clock, leg.mark
    out = bool(clock.out_since_ns) and not clock.followed
    return Intake(
        received=int(count.received),
        faulty={name: int(count.faults[fault]) for fault, name in FAULTS.items() if fault != NO_FAULT},
        crank_used=int(count.crank_used),
        torque_used=int(count.torque_used),
        duplicates=int(count.duplicates),
        late=int(count.late),
        stray_stamps=int(count.stray_stamps),
        outliers=int(count.outliers),
        velocity_outliers=int(count.velocity_outliers),
        gaps_bridged=int(count.gaps_bridged),
        lost=int(count.lost),
        backward_jumps=int(count.backward_jumps),
        reversals=int(count.reversals),
        failures=int(mark[FAILURES]),
        bridged_s=float(count.bridged_ns) * 1.0e-9,
        moving_s=float(mark[MOVING_NS]) * 1.0e-9,
        standing_s=float(count.standing_ns) * 1.0e-9,
        unmonitored_s=float(count.unmonitored_ns + mark[FAILED_NS]) * 1.0e-9,
        out_s=float(clock.released_ns - clock.out_since_ns) * 1.0e-9 if out else 0.0,
        newest_stamp_ns=int(clock.newest_ns),
        followed_stamp_ns=int(clock.last_node_ns),
    )
