"""Points of studies: what is run where, and about how long it takes."""

import math
from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.studies.plan.study import Ensemble
from leg_wear_monitor.studies.point import Point, Settings

_EACH_JOINT = 0.7  # cost of a further clearance joint, in that of the first
_MOMENTS = 20.0  # cost of observing a cycle, in that of a cycle of one clearance joint


def set_name(clearance_joints: Sequence[str]) -> str:
    """Name of a set of clearance joints."""
    return ", ".join(clearance_joints)


def millimetres(clearance_m: float) -> str:
    """A clearance as text."""
    return f"{1.0e3 * clearance_m:g} mm"


def place(clearance_joints: Sequence[str], clearance_m: float, speed_rpm: float, **more: Any) -> Settings:
    """Settings of a run: which joints have what clearance at what speed."""
    return {
        "clearance_joints": list(clearance_joints),
        "clearance_m": clearance_m,
        "speed_rpm": speed_rpm,
        **more,
    }


def cycle_cost(where: Settings) -> float:
    """Cost of a gait cycle at a place, in that of one clearance joint at 60 rpm."""
    joints = len(where["clearance_joints"])
    return (1.0 + _EACH_JOINT * (joints - 1)) * math.sqrt(60.0 / where["speed_rpm"])


def response(label: str, where: Settings, ensemble: Ensemble) -> Point:
    """Point of the response at a place."""
    cycles = ensemble.cycles + ensemble.skip_cycles
    each = cycles * cycle_cost(where) + _MOMENTS * ensemble.traced_cycles
    settings = where | attrs.asdict(ensemble)
    return Point(label=label, task="response", settings=settings, cost=ensemble.runs * each)
