"""CDR encoding (little endian, XCDR1); messages of equal layout are encoded in bulk."""

import itertools
import math
import struct
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import (
    TURN,
    IdealMotion,
    Linkage,
    build_linkage,
    ideal_motion,
    point_motion,
)
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.mechanism.urdf import joint_positions

JOINT_STATE = "sensor_msgs/msg/JointState"
WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
DIAGNOSTIC_ARRAY = "diagnostic_msgs/msg/DiagnosticArray"
DYNAMIC_JOINT_STATE = "control_msgs/msg/DynamicJointState"
FLOAT64 = "std_msgs/msg/Float64"
STRING = "std_msgs/msg/String"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"

LITTLE_ENDIAN = b"\0\1\0\0"
"""The encapsulation header of a message."""
_SECOND = 1_000_000_000


class Layout:
    """Message layout, built part by part; number columns are registered first and filled in later.

    Attributes
    ----------
    body : bytearray
        The message so far, without the encapsulation header.
    columns : list of tuples
        Place in the body and values (n, any) of numbers that differ between messages.
    """

    def __init__(self) -> None:
        self.body = bytearray()
        self.columns: list[tuple[int, NDArray[Any]]] = []

    def align(self, size: int) -> None:
        """Pad to a multiple of a size [bytes]."""
        self.body += bytes(-len(self.body) % size)

    def count(self, number: int) -> None:
        """Add the length of a sequence."""
        self.align(4)
        self.body += struct.pack("<I", number)

    def text(self, text: str) -> None:
        """Add a string."""
        content = text.encode() + b"\0"
        self.count(len(content))
        self.body += content

    def texts(self, texts: Collection[str]) -> None:
        """Add a sequence of strings."""
        self.count(len(texts))
        for text in texts:
            self.text(text)

    def column(self, values: NDArray[Any]) -> None:
        """Add numbers that differ between messages, shape (n, any)."""
        self.align(values.dtype.itemsize)
        self.columns.append((len(self.body), values))
        self.body += bytes(values.dtype.itemsize * values.shape[1])

    def header(self, stamp_ns: ArrayLike, frame_id: str) -> int:
        """Add a std_msgs/Header for each of some stamps; returns their number."""
        seconds, rest = np.divmod(np.atleast_1d(np.asarray(stamp_ns, np.int64)), _SECOND)
        self.column(seconds.astype("<i4")[:, None])
        self.column(rest.astype("<u4")[:, None])
        self.text(frame_id)
        return len(seconds)

    def messages(self, n: int) -> NDArray[np.uint8]:
        """All messages, one per row."""
        rows = np.empty((n, len(LITTLE_ENDIAN) + len(self.body)), np.uint8)
        rows[:] = np.frombuffer(LITTLE_ENDIAN + bytes(self.body), np.uint8)
        for at, values in self.columns:
            size = values.dtype.itemsize * values.shape[1]
            raw = np.ascontiguousarray(values).view(np.uint8).reshape(n, size)
            rows[:, len(LITTLE_ENDIAN) + at : len(LITTLE_ENDIAN) + at + size] = raw
        return rows


def joint_states(
    stamp_ns: ArrayLike,
    names: Sequence[str],
    *,
    position: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    frame_id: str = "",
) -> NDArray[np.uint8]:
    """Messages of sensor_msgs/JointState.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps of the headers [ns].
    names : sequence of str
        Joint names, the same in all messages.
    position, velocity, effort : (n, joints) array, optional
        Empty in the messages if not given.
    frame_id : str

    Returns
    -------
    (n, bytes) array of uint8
        A message a row.
    """
    layout = Layout()
    n = layout.header(stamp_ns, frame_id)
    layout.texts(names)
    for values in (position, velocity, effort):
        layout.count(0 if values is None else len(names))
        if values is not None and names:
            layout.column(np.asarray(values, "<f8").reshape(n, len(names)))
    return layout.messages(n)


def wrenches(
    stamp_ns: ArrayLike,
    *,
    force: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    frame_id: str = "",
) -> NDArray[np.uint8]:
    """Messages of geometry_msgs/WrenchStamped.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps of the headers [ns].
    force, torque : (n, 3) array, optional
        Force [N] and torque [N m]; zero if not given.
    frame_id : str

    Returns
    -------
    (n, bytes) array of uint8
        A message a row.
    """
    layout = Layout()
    n = layout.header(stamp_ns, frame_id)
    for values in (force, torque):
        column = np.zeros((n, 3)) if values is None else np.asarray(values, float)
        layout.column(column.astype("<f8").reshape(n, 3))
    return layout.messages(n)


def dynamic_joint_states(
    stamp_ns: ArrayLike, interfaces: Mapping[str, Mapping[str, ArrayLike]], *, frame_id: str = ""
) -> NDArray[np.uint8]:
    """Messages of control_msgs/DynamicJointState.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Stamps of the headers [ns].
    interfaces : dict
        Values (n,) by the names of joints and their interfaces.
    frame_id : str

    Returns
    -------
    (n, bytes) array of uint8
        A message a row.
    """
    layout = Layout()
    n = layout.header(stamp_ns, frame_id)
    layout.texts(interfaces)
    layout.count(len(interfaces))
    for values in interfaces.values():
        layout.texts(values)
        layout.count(len(values))
        if values:
            columns = [np.broadcast_to(np.asarray(each, "<f8"), n) for each in values.values()]
            layout.column(np.stack(columns, axis=1))
    return layout.messages(n)


def float64s(values: ArrayLike) -> NDArray[np.uint8]:
    """Messages of std_msgs/Float64, from values (n,): a message a row."""
    numbers = np.atleast_1d(np.asarray(values, "<f8"))
    layout = Layout()
    layout.column(numbers[:, None])
    return layout.messages(len(numbers))


def bools(values: ArrayLike) -> NDArray[np.uint8]:
    """Messages of std_msgs/Bool, from values (n,): a message a row."""
    truths = np.atleast_1d(np.asarray(values, np.uint8))
    layout = Layout()
    layout.column(truths[:, None])
    return layout.messages(len(truths))


def string(text: str) -> bytes:
    """One message of std_msgs/String."""
    layout = Layout()
    layout.text(text)
    return layout.messages(1).tobytes()


def diagnostic_array(
    stamp_ns: int, statuses: Sequence[tuple[str, int, str, str, Mapping[str, str]]], frame_id: str = ""
) -> bytes:
    """One message of diagnostic_msgs/DiagnosticArray.

    Parameters
    ----------
    stamp_ns : int
        Stamp of the header [ns].
    statuses : sequence of tuples
        Name, level (0 OK, 1 WARN, 2 ERROR, 3 STALE), message, hardware id, values by key.
    frame_id : str
    """
    layout = Layout()
    layout.header(stamp_ns, frame_id)
    layout.count(len(statuses))
    for name, level, message, hardware_id, values in statuses:
        layout.body.append(level)
        for text in (name, message, hardware_id):
            layout.text(text)
        layout.count(len(values))
        for key, value in values.items():
            layout.text(key)
            layout.text(value)
    return layout.messages(1).tobytes()


# Messages of visualization_msgs/MarkerArray, of which only stamps and moving points differ.


# visualization_msgs/Marker
SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, TEXT = 2, 3, 4, 5, 9

_STAMP, _POINT = 8, 24  # bytes
_LIFETIME_S = 2  # without a new message, tools remove the markers: those of a node that died would stay


@attrs.frozen(kw_only=True, eq=False)
class Marker:
    """A marker.

    Attributes
    ----------
    namespace : str
    id : int
    type : int
    scale : tuple of float
        [m]; see visualization_msgs/Marker for the meaning by type.
    colour : tuple of float
        Red, green, blue, 0 to 1.
    position : (3,) array
        [m]
    orientation : tuple of float
        Quaternion x, y, z, w.
    points : (n, 3) array
        [m]; of lines.
    text : str
    moves : bool
        Whether its points, or without points its position, are given with each message.
    """

    namespace: str
    id: int = 0
    type: int
    scale: tuple[float, float, float]
    colour: tuple[float, float, float]
    position: Floats = attrs.Factory(lambda: np.zeros(3))
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    points: Floats = attrs.Factory(lambda: np.zeros((0, 3)))
    text: str = ""
    moves: bool = False


class MarkerArrayTemplate:
    """Messages with the same markers, encoded once.

    Parameters
    ----------
    markers : sequence of Marker
    frame_id : str
    """

    def __init__(self, markers: Sequence[Marker], frame_id: str) -> None:
        layout = Layout()
        self._stamps: list[int] = []
        self._points: list[int] = []
        layout.count(len(markers))
        for marker in markers:
            self._add(layout, marker, frame_id)
        self._raw = np.frombuffer(LITTLE_ENDIAN + bytes(layout.body), np.uint8)
        first = len(LITTLE_ENDIAN)
        self._stamp_bytes = first + np.add.outer(self._stamps, np.arange(_STAMP))
        self._point_bytes = first + np.add.outer(self._points, np.arange(_POINT))

    def messages(self, stamp_ns: NDArray[np.int64], moving: Floats) -> NDArray[np.uint8]:
        """Messages at n stamps.

        Parameters
        ----------
        stamp_ns : (n,) array of int
        moving : (n, m, 3) array
            Points and positions [m] of the markers that move, in their order.

        Returns
        -------
        (n, bytes) array of uint8
            A message a row.
        """
        n = len(stamp_ns)
        rows = np.tile(self._raw, (n, 1))
        seconds, rest = np.divmod(stamp_ns, _SECOND)
        stamps = np.stack([seconds.astype("<i4"), rest.astype("<u4").view("<i4")], axis=1)
        rows[:, self._stamp_bytes] = stamps.view(np.uint8)[:, None, :]
        points = np.ascontiguousarray(moving, "<f8").view(np.uint8)
        rows[:, self._point_bytes] = points.reshape(n, len(self._points), _POINT)
        return rows

    def _add(self, layout: Layout, marker: Marker, frame_id: str) -> None:
        layout.align(4)
        self._stamps.append(len(layout.body))
        layout.body += bytes(_STAMP)
        layout.text(frame_id)
        layout.text(marker.namespace)
        layout.align(4)
        layout.body += struct.pack("<3i", marker.id, marker.type, 0)  # action: add
        layout.align(8)
        if marker.moves and not len(marker.points):
            self._points.append(len(layout.body))
        layout.body += struct.pack("<10d", *marker.position, *marker.orientation, *marker.scale)
        layout.body += struct.pack("<4f", *marker.colour, 1.0)
        layout.body += struct.pack("<iI", _LIFETIME_S, 0) + bytes(1)  # lifetime, frame_locked
        layout.count(len(marker.points))
        if len(marker.points):
            layout.align(8)
        for point in marker.points:
            if marker.moves:
                self._points.append(len(layout.body))
            layout.body += struct.pack("<3d", *point)
        layout.count(0)  # colours
        _add_nothing(layout)
        layout.text(marker.text)
        layout.text("")  # mesh_resource
        layout.text("")  # mesh_file.filename
        layout.count(0)  # mesh_file.data
        layout.body += bytes(1)  # mesh_use_embedded_materials


def _add_nothing(layout: Layout) -> None:
    """No texture: its name, the image with its header, and its coordinates."""
    layout.text("")
    layout.align(4)
    layout.body += bytes(_STAMP)
    layout.text("")  # frame_id
    layout.text("")  # format
    layout.count(0)  # data
    layout.count(0)  # uv_coordinates


# Geometry of the leg's markers: bodies, joints and toe over the crank angle, and rings beside the leg.


_STEPS = 180  # positions per turn; the nearest one is drawn
_PATH_STEP = 2  # every such position is a point of the toe's path
_SAME = 1.0e-3  # distance of joints that have one name tag, as a fraction of the leg's size
_PER_COLUMN = 5  # rings
_RING_PITCH, _RING_GAP = 0.24, 0.2  # distance of rings, and of the first column from the leg, likewise


class LegDrawing:
    """The ideal leg, because the clearances are too small to be visible; rings show them magnified.

    All points are (…, 3) [m] in the frame of the pelvis by REP 103: x forwards, z up.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    size : float
        Largest extent of the leg in its plane [m].
    lines : (STEPS, 2 b, 3) array
        Both ends of b lines of the bodies.
    joints : (STEPS, k, 3) array
        The clearance joints.
    tags : tuple of (str, int)
        Names of joints at one place, such as ``A B``, and the index of the first of them.
    path : (p, 3) array
        Closed path of the toe; empty without a toe.
    rings : (k, 3) array
        Centres of the magnified bushings, beside the leg.
    title : (3,) array
        Place above the rings.
    links : tuple of str
        Joints that carry the links of the mechanism's robot description.
    link_positions : (STEPS, n) array
        Their positions [rad, or m of a slider].
    """

    def __init__(self, mechanism: Mechanism) -> None:
        linkage = build_linkage(mechanism)
        motion = ideal_motion(linkage, TURN / _STEPS * np.arange(_STEPS), TURN)
        self.lines = _lines(mechanism, motion, linkage)
        carried = joint_positions(linkage, motion.q)
        self.links, self.link_positions = tuple(carried), np.stack([*carried.values()], axis=1)
        names = mechanism.clearance_joints
        joints = [_path(motion, linkage, mechanism.sides(name)[0], name) for name in names]
        self.joints = np.stack(joints, axis=1) if joints else np.zeros((_STEPS, 0, 3))
        all_points = np.concatenate([self.lines, self.joints], axis=1)
        corners = np.array([all_points.min(axis=(0, 1)), all_points.max(axis=(0, 1))])
        self.size = float(np.ptp(corners, axis=0).max())
        self.tags = _tags(names, self.joints, _SAME * self.size)
        toe = mechanism.toe
        self.path = _closed(_path(motion, linkage, *toe)[::_PATH_STEP]) if toe else np.zeros((0, 3))
        begin = np.array([corners[1, 0] + _RING_GAP * self.size, 0.0, corners[1, 2]])
        k = np.arange(len(names))
        places = np.stack([k // _PER_COLUMN, np.zeros(len(k)), -(k % _PER_COLUMN)], axis=1)
        self.rings = begin + _RING_PITCH * self.size * places
        self.title = begin + _RING_PITCH * self.size * np.array([0.0, 0.0, 0.8])

    def step_at(self, crank_angle: float) -> int:
        """Index of the position nearest to a crank angle [rad]."""
        return round(crank_angle / TURN * _STEPS) % _STEPS


def circle(radius: float) -> Floats:
    """Closed circle (33, 3) [m] in the plane of the leg."""
    angle = np.linspace(0.0, TURN, 33)
    return radius * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)


def in_rep_103(plane: Floats) -> Floats:
    """Points (…, 3) of points (…, 2) in the leg's plane: the leg walks towards its own -x, REP 103 to +x."""
    return np.stack([-plane[..., 0], np.zeros(plane.shape[:-1]), plane[..., 1]], axis=-1)


def _path(motion: IdealMotion, linkage: Linkage, body: str, point: str) -> Floats:
    """Positions (STEPS, 3) [m] of a point of a body."""
    return in_rep_103(point_motion(motion, linkage, body, point)[0])


def _lines(mechanism: Mechanism, motion: IdealMotion, linkage: Linkage) -> Floats:
    """Lines from each moving body's first point to its other points, as pairs of points."""
    ends: list[Floats] = []
    for body in mechanism.bodies:
        places = [_path(motion, linkage, body, point) for point in mechanism.points_of(body)]
        for other in places[1:]:
            ends += [places[0], other]
    ground = [_path(motion, linkage, GROUND, point) for point in mechanism.points_of(GROUND)]
    for one, other in itertools.pairwise(ground):
        if math.dist(one[0], other[0]) > 0.0:
            ends += [one, other]
    return np.stack(ends, axis=1) if ends else np.zeros((_STEPS, 0, 3))


def _tags(names: tuple[str, ...], joints: Floats, same: float) -> tuple[tuple[str, int], ...]:
    """Names of joints that stay within a distance [m] of each other, with the index of the first."""
    groups: dict[int, list[str]] = {}
    for k, name in enumerate(names):
        near = (i for i in groups if np.abs(joints[:, i] - joints[:, k]).max() <= same)
        groups.setdefault(next(near, k), []).append(name)
    return tuple((" ".join(group), k) for k, group in groups.items())


def _closed(path: Floats) -> Floats:
    return np.concatenate([path, path[:1]])
