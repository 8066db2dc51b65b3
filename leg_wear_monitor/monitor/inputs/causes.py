"""Sentences on unused samples: how many of how many, the fault, and what to do."""

from collections.abc import Mapping

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.inputs.health import of_other_joints
from leg_wear_monitor.twin.sample import FAULTS, MISSING_JOINT
from leg_wear_monitor.twin.statistics import Intake

_WORTH_TELLING = 0.01  # fraction of the samples; smaller ones are visible in the counters only

_DROPPED = ("duplicates", "late", "stray_stamps", "outliers")

_SENTENCES = {
    "zero_stamp": "have a zero stamp: set header.stamp",
    "missing_joint": "do not name the crank {crank!r}: set crank_joint to its name in joint_states",
    "empty": "have no name or no position",
    "wrong_length": "have another number of positions, velocities or efforts than of names",
    "not_finite": "have a value that is NaN or infinite",
    "undecodable": "cannot be decoded: another type or another encoding",
    "wrong_type": "are of a type that is not read",
    "out_of_range": "have an impossible value: angles are in radians, torques in N m",
    "duplicates": "repeat a stamp: two publishers, or a header.stamp that is not renewed",
    "late": "arrive more than tracker.reorder_window_s after newer ones",
    "stray_stamps": "have a stamp far from the others: see the clock of the sender",
    "outliers": "have an angle far from the motion of the others",
}


def causes(before: Intake, after: Intake, withheld: int, config: MonitorConfig) -> list[str]:
    """Sentences on the unused samples between two counts, the most frequent cause first.

    Parameters
    ----------
    before, after : Intake
    withheld : int
        Number of out-of-range samples that another sentence reports.
    config : MonitorConfig
        Gives the name of the crank.
    """
    others = of_other_joints(before, after)
    received = after.received - before.received - others
    lost = _unused(after, before, withheld, others)
    frequent = [name for name, count in lost.items() if count > _WORTH_TELLING * received]
    sentences = [
        f"{lost[name]} of {received} samples {_SENTENCES[name].format(crank=config.crank_joint)}"
        for name in sorted(frequent, key=lambda name: -lost[name])
    ]
    unused = sum(lost.values())
    if sentences and unused > max(lost.values()):  # one cause of several: else its number is taken for all
        sentences[0] = f"{unused} of {received} samples are not used, {sentences[0]}"
    return sentences


def _unused(after: Intake, before: Intake, withheld: int, others: int) -> Mapping[str, int]:
    lost = {name: count - before.faulty[name] for name, count in after.faulty.items()}
    lost["out_of_range"] -= withheld
    lost[FAULTS[MISSING_JOINT]] -= others
    return lost | {name: getattr(after, name) - getattr(before, name) for name in _DROPPED}
