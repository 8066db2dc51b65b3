"""Values of each clearance joint as numbers of their own, because tools plot arrays by index only."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.output import Outgoing, Output, single
from leg_wear_monitor.monitor.reports import CycleReport, JointReport


def _remaining_p50_h(joint: JointReport) -> float | None:
    hours = joint.forecast.hours if joint.forecast else None
    return hours.p50 if hours else None


SCALARS: Mapping[str, Callable[[JointReport], float | None]] = MappingProxyType(
    {
        "clearance_m": lambda joint: joint.clearance_m,
        "seen_m": lambda joint: joint.seen_m,
        "remaining_p50_h": _remaining_p50_h,
        "peak_force_n": lambda joint: joint.peak_force_n,
    }
)
"""Values of a joint by the last part of their topics' names; None or not finite if not known."""


class Scalars:
    """Messages of std_msgs/Float64 after each gait cycle; a value that is not known has no message.

    Parameters
    ----------
    clearance_joints : sequence of str
        The clearance joints, in the order of the reports.

    Attributes
    ----------
    outputs : tuple of Output
        One for each joint and value, such as ``~/joints/A/clearance_m``.
    """

    def __init__(self, clearance_joints: Sequence[str]) -> None:
        self._by_joint = {
            joint: {name: Output(f"~/joints/{joint}/{name}", encode.FLOAT64) for name in SCALARS}
            for joint in clearance_joints
        }
        self.outputs = tuple(output for outputs in self._by_joint.values() for output in outputs.values())

    def of(self, cycle: CycleReport) -> Iterator[Outgoing]:
        """Messages of all known values of a gait cycle."""
        for joint in cycle.joints:
            for name, output in self._by_joint[joint.joint].items():
                value = SCALARS[name](joint)
                if value is not None and math.isfinite(value):
                    yield single(output, cycle.stamp_ns, encode.float64s(value)[0].tobytes())
