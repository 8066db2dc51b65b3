"""One leg at a glance, from the records of its recordings."""

from collections.abc import Iterable, Mapping
from typing import Any

import attrs

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.fleet.chain.record import Outcome
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory, Line
from leg_wear_monitor.fleet.overview.parts import BadRecording, LegChange, LegOverview, RecordingHealth
from leg_wear_monitor.fleet.tables.used import used_fraction
from leg_wear_monitor.monitor.verdict.verdict import Verdict
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours

_MOST_BAD = 10


def leg_overview(
    leg: FleetLeg, directory: LegDirectory, before: LegOverview | None, fault: str = ""
) -> LegOverview:
    """A leg at a glance.

    Parameters
    ----------
    leg : FleetLeg
    directory : LegDirectory
    before : LegOverview or None
        The leg after an earlier update.
    fault : str
        Why this update could not count all of its recordings.
    """
    lines = {line["key"]: line for line in directory.lines()}  # the last one of each recording
    counted = [line for line in lines.values() if line["outcome"] == Outcome.COUNTED.value]
    health = _health(lines.values(), counted, len(leg.recordings))
    factor = leg.config.wear_acceleration
    now = LegOverview(id=leg.id, lot=leg.lot, recordings=health, fault=fault, wear_acceleration=factor)
    if counted:
        source = str(directory.records)
        joints = structure(counted[-1]["clearances"], dict[str, JointClearance], source, "clearances")
        now = attrs.evolve(
            now,
            verdict=structure(counted[-1]["verdict"], Verdict, source, "verdict"),
            clearances=joints,
            used_fraction={name: _used(joint) for name, joint in joints.items()},
            life=_life(counted[-1]["life"], source),
        )
    return attrs.evolve(now, change=_change(now, before))


def _used(joint: JointClearance) -> float:
    """Fraction of the clearance that is used up, by the believed clearance."""
    clearance_m = joint.believed_m
    if clearance_m is None:  # nothing is valid, or it is a line of an older version
        clearance_m = joint.counted_m if joint.seen_m is None else joint.seen_m
    return used_fraction(clearance_m, joint.new_m, joint.limit_m)


def _life(given: Mapping[str, Any], source: str) -> dict[str, LifeHours | None]:
    return {
        name: None if hours is None else structure(hours, LifeHours, source, f"life.{name}")
        for name, hours in given.items()
    }


def _health(lines: Iterable[Line], counted: list[Line], found: int) -> RecordingHealth:
    lines = list(lines)
    outcomes = [line["outcome"] for line in lines]
    bad = [
        BadRecording(file=line["file"], outcome=line["outcome"], why=next(iter(line["findings"]), ""))
        for line in lines
        if line["is_partial"] or line["outcome"] == Outcome.NO_GAIT.value
    ]
    return RecordingHealth(
        found=found,
        **{outcome.value: outcomes.count(outcome.value) for outcome in Outcome},
        partial=sum(line["is_partial"] for line in counted),
        begin_ns=min((line["begin_ns"] for line in counted), default=0),
        end_ns=max((line["end_ns"] for line in counted), default=0),
        counted_h=sum(line["duration_s"] for line in counted) / 3600.0,
        cycles=sum(line["cycles"] for line in counted),
        unmonitored_s=sum(line["lost"]["unmonitored_s"] for line in counted),
        bad=tuple(reversed(bad[-_MOST_BAD:])),
    )


def _change(now: LegOverview, before: LegOverview | None) -> LegChange:
    """What is new; that of the update before if nothing was counted since."""
    if before is None:
        return LegChange(recordings=now.recordings.counted)
    if before.recordings.counted == now.recordings.counted:
        return before.change
    return LegChange(
        recordings=now.recordings.counted - before.recordings.counted,
        state=before.state if before.verdict else "",
        fault_code=before.verdict.fault_code if before.verdict else "",
        used_fraction={
            joint: used - before.used_fraction[joint]
            for joint, used in now.used_fraction.items()
            if joint in before.used_fraction
        },
    )
