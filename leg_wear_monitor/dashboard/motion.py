"""Frames of the moving leg on their way from a monitor to those who look."""

import json
import threading
from collections import deque
from collections.abc import Mapping

import attrs

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.reach import reach_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.messages.leg_motion import received_frame
from leg_wear_monitor.report.leg_slider import drawn_pin, leg_data
from leg_wear_monitor.report.page import render
from leg_wear_monitor.state import JointClearance

POSITIONS = 180  # of the crank in a turn: more are not told apart
_KEPT = 40  # frames, two seconds


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
            joint: drawn_pin(motion, clearances[joint])
            for joint, motion in frame.joints.items()
            if joint in clearances
        }
        torque = frame.torque and attrs.asdict(frame.torque)
        shown = {"angle": round(57.29577951 * frame.crank_angle_rad, 1), "joints": joints, "torque": torque}
        with self._lock:
            self._number += 1
            self._frames.append((self._number, json.dumps(shown, allow_nan=False, separators=(",", ":"))))

    def after(self, number: int) -> list[tuple[int, str]]:
        """Frames later than a number; of a viewer who just came, the last one."""
        with self._lock:
            later = [frame for frame in self._frames if frame[0] > number]
        return later if number else later[-1:]


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
