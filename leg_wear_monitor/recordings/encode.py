"""CDR encoding (little endian, XCDR1); messages of equal layout are encoded in bulk."""

import struct
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.mechanism.arrays import Floats

JOINT_STATE = "sensor_msgs/msg/JointState"
WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
DIAGNOSTIC_ARRAY = "diagnostic_msgs/msg/DiagnosticArray"
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

    def numbers(self, kind: str, values: ArrayLike) -> None:
        """Add numbers that are the same in all messages."""
        numbers = np.asarray(values, kind)
        if numbers.size:
            self.align(numbers.itemsize)
            self.body += numbers.tobytes()

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


# visualization_msgs/Marker
SPHERE, LINE_LIST, TEXT = 2, 5, 9

_LIFETIME_S = 2  # Tools remove markers without a new message, so markers of a node that died do not stay.


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
    points : (n, 3) array
        [m]; of lines.
    text : str
    """

    namespace: str
    id: int = 0
    type: int
    scale: tuple[float, float, float]
    colour: tuple[float, float, float]
    position: Floats = attrs.Factory(lambda: np.zeros(3))
    points: Floats = attrs.Factory(lambda: np.zeros((0, 3)))
    text: str = ""


def marker_array(stamp_ns: int, markers: Sequence[Marker], frame_id: str) -> bytes:
    """One message of visualization_msgs/MarkerArray."""
    layout = Layout()
    layout.count(len(markers))
    for marker in markers:
        layout.header(stamp_ns, frame_id)
        layout.text(marker.namespace)
        layout.numbers("<i4", [marker.id, marker.type, 0])  # action: add
        layout.numbers("<f8", [*marker.position, 0.0, 0.0, 0.0, 1.0, *marker.scale])
        layout.numbers("<f4", [*marker.colour, 1.0])
        layout.numbers("<i4", [_LIFETIME_S, 0])
        layout.numbers("u1", [0])  # frame_locked
        layout.count(len(marker.points))
        layout.numbers("<f8", marker.points)
        layout.count(0)  # colours
        layout.text("")  # texture_resource
        layout.header(0, "")  # texture
        layout.text("")  # its format
        layout.count(0)  # its data
        layout.count(0)  # uv_coordinates
        layout.text(marker.text)
        layout.text("")  # mesh_resource
        layout.text("")  # mesh_file.filename
        layout.count(0)  # mesh_file.data
        layout.numbers("u1", [0])  # mesh_use_embedded_materials
    return layout.messages(1).tobytes()
