"""Whether a drive torque is good enough to show that a joint wears."""

from collections.abc import Sequence

import attrs


@attrs.frozen(kw_only=True)
class JointDetection:
    """What the drive torque of a recording will show of a joint.

    Attributes
    ----------
    joint : str
        Its name.
    is_good : bool
        Whether a joint with the last clearance of `clearances_m` is found, and named, soon enough.
    clearances_m : tuple of float
        Clearances of a wider joint.
    cycles : tuple of float
        Expected number of gait cycles until a joint with each of these clearances is detected; NaN where it
        is not.
    named_cycles : tuple of float
        Number of gait cycles until it is named, of four of five legs whose masses are 4 % off; NaN where it
        is not.
    runner_up : str
        What else explains the last clearance best, human-readable; empty if it is not detected.
    reason : str
        Why the torque is not good enough for this joint, and what would be; empty if it is.
    """

    joint: str
    is_good: bool
    clearances_m: tuple[float, ...]
    cycles: tuple[float, ...]
    named_cycles: tuple[float, ...]
    runner_up: str
    reason: str = ""


def judgement(joints: Sequence[JointDetection]) -> str:
    """For which joints a torque is good enough, in a sentence; empty without joints."""
    good = [each.joint for each in joints if each.is_good]
    reasons: dict[str, list[str]] = {}
    for each in joints:
        if not each.is_good:
            reasons.setdefault(each.reason, []).append(each.joint)
    told = f"this torque is good enough for {_joints(good)}" if good else ""
    bad = [f"{_joints(names)}, because {reason}" for reason, names in reasons.items()]
    if not bad:
        return told
    return f"{told or 'this torque is not good enough'}{'; not' if told else ''} for {'; nor for '.join(bad)}"


def _joints(names: Sequence[str]) -> str:
    return f"joint{'s' if len(names) > 1 else ''} {', '.join(names)}"
