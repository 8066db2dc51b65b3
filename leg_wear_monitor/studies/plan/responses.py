"""Points of studies: settings of the runs, and their estimated cost."""

import math
from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.studies.plan.keys import Names, clearance_field, clearance_joints_field, speed_field
from leg_wear_monitor.studies.plan.study import Ensemble, Study
from leg_wear_monitor.studies.point import Point, Settings

_EACH_JOINT = 0.7  # cost of each further clearance joint, relative to the first
_MOMENTS = 20.0  # cost of observing a cycle, relative to a cycle of one clearance joint


def set_name(clearance_joints: Sequence[str]) -> str:
    """Name of a set of clearance joints."""
    return ", ".join(clearance_joints)


def millimetres(clearance_m: float) -> str:
    """A clearance as text."""
    return f"{1.0e3 * clearance_m:g} mm"


def place(clearance_joints: Sequence[str], clearance_m: float, speed_rpm: float, **more: Any) -> Settings:
    """Settings of a run: clearance joints, clearance and speed."""
    return {
        "clearance_joints": list(clearance_joints),
        "clearance_m": clearance_m,
        "speed_rpm": speed_rpm,
        **more,
    }


def cycle_cost(where: Settings) -> float:
    """Cost of a gait cycle with given settings, relative to one clearance joint at 60 rpm."""
    joints = len(where["clearance_joints"])
    return (1.0 + _EACH_JOINT * (joints - 1)) * math.sqrt(60.0 / where["speed_rpm"])


def response(label: str, where: Settings, ensemble: Ensemble) -> Point:
    """Response point for given run settings."""
    cycles = ensemble.cycles + ensemble.skip_cycles
    each = cycles * cycle_cost(where) + _MOMENTS * ensemble.traced_cycles
    settings = where | attrs.asdict(ensemble)
    return Point(label=label, task="response", settings=settings, cost=ensemble.runs * each)


@attrs.frozen(kw_only=True)
class OnePlace(Study):
    """Base of studies with one set of clearance joints, one clearance and one speed."""

    joints: Names = clearance_joints_field()
    clearance_m: float = clearance_field()
    speed_rpm: float = speed_field()

    def place(self, **more: Any) -> Settings:
        """Settings of a run there."""
        return place(self.joints, self.clearance_m, self.speed_rpm, **more)

    def response(self, label: str, **more: Any) -> Point:
        """Response point there."""
        return response(label, self.place(**more), self.ensemble)
