"""Counts of samples and times from the state of tracker and follower."""

from collections.abc import Iterable

from leg_wear_monitor.record import Records, values_of
from leg_wear_monitor.twin.kinds import KINDS
from leg_wear_monitor.twin.sample import FAULTS, NO_FAULT
from leg_wear_monitor.twin.statistics import Intake


def intake(tracker: Records, leg: Records, kinds: Iterable[int] = KINDS) -> Intake:
    """Counts of a tracker's `TRACKER_STATE` and a follower's `LEG_STATE`, of the kinds that are read."""
    count, clock = values_of(tracker["counts"]), values_of(tracker["clock"])
    motion = values_of(leg["motion"])
    out = clock["out_since_ns"] != 0 and not clock["followed"]
    return Intake(
        received=count["received"],
        faulty={name: int(count["faults"][fault]) for fault, name in FAULTS.items() if fault != NO_FAULT},
        used={KINDS[code].name: int(count["used"][code]) for code in kinds},
        duplicates=count["duplicates"],
        late=count["late"],
        stray_stamps=count["stray_stamps"],
        outliers=count["outliers"],
        velocity_outliers=count["velocity_outliers"],
        gaps_bridged=count["gaps_bridged"],
        lost=count["lost"],
        backward_jumps=count["backward_jumps"],
        reversals=count["reversals"],
        failures=motion["failures"],
        bridged_s=count["bridged_ns"] * 1.0e-9,
        moving_s=motion["moving_ns"] * 1.0e-9,
        standing_s=count["standing_ns"] * 1.0e-9,
        unmonitored_s=(count["unmonitored_ns"] + motion["failed_ns"]) * 1.0e-9,
        out_s=(clock["released_ns"] - clock["out_since_ns"]) * 1.0e-9 if out else 0.0,
        newest_stamp_ns=clock["newest_ns"],
        followed_stamp_ns=clock["last_node_ns"],
    )
