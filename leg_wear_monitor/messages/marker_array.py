"""Messages of visualization_msgs/MarkerArray, of which only stamps and moving points differ."""

import struct
from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages.encode import LITTLE_ENDIAN, Layout

# visualization_msgs/Marker
SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, TEXT = 2, 3, 4, 5, 9

_SECOND = 1_000_000_000
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
