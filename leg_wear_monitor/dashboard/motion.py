"""Frames of the moving leg on their way from a monitor to those who look."""

import json
import threading
from collections import deque
from collections.abc import Mapping
from typing import Any

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.reach import reach_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.messages.leg_motion import JointMotion, received_frame
from leg_wear_monitor.report.leg_picture import leg_data
from leg_wear_monitor.report.page import render
from leg_wear_monitor.state import JointClearance

POSITIONS = 180  # of the crank in a turn: more are not told apart
_KEPT = 40  # frames, two seconds
_AT_LIMIT, _MOST_GAP, _LEAST_GAP = 0.5, 0.85, 0.02  # drawn clearance, as a fraction of the bushing's radius


class MotionFeed:
    """The last frames, from any thread to any other; it knows how many look."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[tuple[int, str]] = deque(maxlen=_KEPT)
        self._number = 0
        self.viewers = 0

    def add(self, text: str, source: str, clearances: Mapping[str, JointClearance]) -> None:
        """Take a message; one that is no frame, or that nobody looks at, is left out."""
        if not self.viewers:
            return
        try:
            frame = received_frame(text, source)
        except ConfigError:  # the age of the data on the page tells that nothing comes
            return
        joints = {
            joint: _drawn(motion, clearances[joint])
            for joint, motion in frame.joints.items()
            if joint in clearances
        }
        torque = frame.torque and {
            "measured_nm": frame.torque.measured_nm,
            "predicted_nm": frame.torque.predicted_nm,
        }
        shown = {"angle": round(57.29577951 * frame.crank_angle_rad, 1), "joints": joints, "torque": torque}
        with self._lock:
            self._number += 1
            self._frames.append((self._number, json.dumps(shown, allow_nan=False, separators=(",", ":"))))

    def after(self, number: int) -> list[tuple[int, str]]:
        """Frames later than a number; of a viewer who just came, the last one."""
        with self._lock:
            later = [frame for frame in self._frames if frame[0] > number]
        return later if number else later[-1:]


def _drawn(motion: JointMotion, clearance: JointClearance) -> dict[str, Any]:
    """A joint as the page draws it: y downwards, lengths in clearances, forces in N."""
    x, y = motion.eccentricity_m
    size = (x * x + y * y) ** 0.5
    pushed = (-motion.force_n * x / size, motion.force_n * y / size) if size else (0.0, 0.0)
    counted = clearance.counted_m or 1.0
    width = clearance.believed_m or counted
    gap = min(max(_AT_LIMIT * width / clearance.limit_m, _LEAST_GAP), _MOST_GAP)
    return {
        "e": [round(x / counted, 3), round(-y / counted, 3)],
        "f": [round(pushed[0], 1), round(pushed[1], 1)],
        "hit": round(motion.impact_n, 1),
        "gap": round(gap, 3),
    }


def motion_region(mechanism: Mechanism, torque_mismatch: float) -> str:
    """The picture that frames move, and the torque over the crank angle; empty for a crank that rocks."""
    reach = reach_of(mechanism, None, POSITIONS)
    if not reach.turns:
        return ""
    pins: dict[str, dict[str, list[float]]] = {
        joint: {"e": [], "f": []} for joint in mechanism.clearance_joints
    }
    data = leg_data(reach) | {"live": True, "runs": [{"label": "live", "pins": pins}], "longest_n": 1.0}
    return render("dashboard/motion.html", data=data, limit=torque_mismatch)
