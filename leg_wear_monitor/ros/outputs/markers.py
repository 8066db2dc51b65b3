"""Markers of the leg for RViz and Foxglove: bodies, and clearance joints in the colour of their alarms."""

from collections.abc import Callable

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from rclpy.node import Node
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, ideal_motion, point_motion
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import SampleReports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

PERIOD_S = 0.1

_STEPS = 180  # positions per turn; the nearest one is drawn
_NO_DATA = (0.55, 0.55, 0.55)
_COLOURS = {Level.OK: (0.2, 0.7, 0.3), Level.WARN: (0.95, 0.7, 0.1), Level.ERROR: (0.85, 0.15, 0.15)}
_LINE_M, _JOINT_M = 0.006, 0.03


class LegMarkers:
    """Markers of the ideal leg, because the clearances are too small to be visible.

    Parameters
    ----------
    mechanism : Mechanism
    frame_id : str
        Frame of the pelvis.
    """

    def __init__(self, mechanism: Mechanism, frame_id: str) -> None:
        linkage = build_linkage(mechanism)
        motion = ideal_motion(linkage, TURN / _STEPS * np.arange(_STEPS), TURN)
        self._frame_id, self._clearance_joints = frame_id, mechanism.clearance_joints
        self._points: dict[tuple[str, str], Floats] = {
            (body, point): point_motion(motion, linkage, body, point)[0]
            for body in (GROUND, *mechanism.bodies)
            for point in mechanism.points_of(body)
        }
        self._joints = {name: (mechanism.sides(name)[0], name) for name in mechanism.clearance_joints}

    def at(self, crank_angle: float, levels: dict[str, Level] | None, stamp: Time) -> MarkerArray:
        """The leg at a crank angle [rad], with joints coloured by alarm level; grey without levels."""
        i = round(crank_angle / TURN * _STEPS) % _STEPS
        header = Header(stamp=stamp, frame_id=self._frame_id)
        bodies = Marker(header=header, ns="bodies", type=Marker.LINE_LIST, color=_colour((0.6, 0.6, 0.65)))
        bodies.pose.orientation.w = 1.0
        bodies.scale.x = _LINE_M
        bodies.points = self._lines(i)
        return MarkerArray(
            markers=[bodies, *(self._joint(name, i, levels, header) for name in self._clearance_joints)]
        )

    def _lines(self, i: int) -> list[Point]:
        """Lines from each body's first point to its other points, as pairs of points."""
        first: dict[str, Point] = {}
        pairs: list[Point] = []
        for (body, _), positions in self._points.items():
            here = _point(positions[i])
            if body in first and body != GROUND:
                pairs += [first[body], here]
            first.setdefault(body, here)
        return pairs

    def _joint(self, name: str, i: int, levels: dict[str, Level] | None, header: Header) -> Marker:
        marker = Marker(header=header, ns="joints", id=self._clearance_joints.index(name), type=Marker.SPHERE)
        marker.pose.position = _point(self._points[self._joints[name]][i])
        marker.pose.orientation.w = 1.0
        marker.scale = Vector3(x=_JOINT_M, y=_JOINT_M, z=_JOINT_M)
        marker.color = _colour(_NO_DATA if levels is None else _COLOURS[levels.get(name, Level.OK)])
        return marker


class MarkerTopic:
    """``~/markers``, published at 10 Hz while its parameter is on and the topic has a subscriber.

    Parameters
    ----------
    node : rclpy.node.Node
    monitor : WearMonitor
    is_current : callable
        Returns whether there are current data; otherwise joints are grey.
    """

    def __init__(self, node: Node, monitor: WearMonitor, is_current: Callable[[], bool]) -> None:
        self._node, self._monitor, self._is_current = node, monitor, is_current
        self._markers = LegMarkers(monitor.mechanism, monitor.config.frame_id)
        self._publisher = node.create_publisher(MarkerArray, "~/markers", 10)
        self._crank_angle = 0.0
        node.create_timer(PERIOD_S, self._publish)

    def note(self, samples: SampleReports) -> None:
        """Store the crank angle."""
        followed = np.flatnonzero(np.isfinite(samples.crank_angle_rad))
        if len(followed):
            self._crank_angle = float(samples.crank_angle_rad[followed[-1]])

    def _publish(self) -> None:
        if not self._monitor.config.publish_markers or not self._publisher.get_subscription_count():
            return
        levels = {
            status.name.removeprefix("joint "): status.level
            for status in self._monitor.status()
            if status.name.startswith("joint ")
        }
        stamp = self._node.get_clock().now().to_msg()
        shown = levels if self._is_current() else None
        self._publisher.publish(self._markers.at(self._crank_angle, shown, stamp))


def _point(position: Floats) -> Point:
    """A point of the leg's plane: REP 103 has z up and x forwards; the leg walks towards its own -x."""
    return Point(x=-float(position[0]), y=0.0, z=float(position[1]))


def _colour(rgb: tuple[float, float, float]) -> ColorRGBA:
    return ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=1.0)
