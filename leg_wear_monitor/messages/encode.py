"""CDR encoding (little endian, XCDR1); messages of equal layout are encoded in bulk."""

import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

JOINT_STATE = "sensor_msgs/msg/JointState"
WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
DIAGNOSTIC_ARRAY = "diagnostic_msgs/msg/DiagnosticArray"
FLOAT64 = "std_msgs/msg/Float64"
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

    def column(self, values: NDArray[Any]) -> None:
        """Add numbers that differ between messages, shape (n, any)."""
        self.align(values.dtype.itemsize)
        self.columns.append((len(self.body), values))
        self.body += bytes(values.dtype.itemsize * values.shape[1])

    def header(self, stamp_ns: NDArray[np.int64], frame_id: str) -> None:
        """Add a std_msgs/Header."""
        seconds, rest = np.divmod(stamp_ns, _SECOND)
        self.column(seconds.astype("<i4")[:, None])
        self.column(rest.astype("<u4")[:, None])
        self.text(frame_id)

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
    stamps = np.atleast_1d(np.asarray(stamp_ns, np.int64))
    layout = Layout()
    layout.header(stamps, frame_id)
    layout.count(len(names))
    for name in names:
        layout.text(name)
    for values in (position, velocity, effort):
        layout.count(0 if values is None else len(names))
        if values is not None and names:
            layout.column(np.asarray(values, "<f8").reshape(len(stamps), len(names)))
    return layout.messages(len(stamps))


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
    stamps = np.atleast_1d(np.asarray(stamp_ns, np.int64))
    layout = Layout()
    layout.header(stamps, frame_id)
    for values in (force, torque):
        column = np.zeros((len(stamps), 3)) if values is None else np.asarray(values, float)
        layout.column(column.astype("<f8").reshape(len(stamps), 3))
    return layout.messages(len(stamps))


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
    layout.header(np.array([stamp_ns], np.int64), frame_id)
    layout.count(len(statuses))
    for name, level, message, hardware_id, values in statuses:
        layout.body.append(level)
        for text in (name, message, hardware_id):
            layout.text(text)
        layout.count(len(values))
        for key, value in values.items():
            layout.text(key)
            layout.text(value)
    raw: bytes = layout.messages(1)[0].tobytes()
    return raw
