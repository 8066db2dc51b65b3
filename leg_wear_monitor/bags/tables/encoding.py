"""Rows of a table as the messages that the monitor's node would have received."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.mcap.file import Piece
from leg_wear_monitor.bags.mcap.layout import Channel
from leg_wear_monitor.bags.tables.layout import (
    CRANK_ANGLE,
    CRANK_SPEED,
    DRIVE_TORQUE,
    FOOT_LOAD,
    FOOT_LOAD_ALONG,
    Rows,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.cdr import MESSAGE
from leg_wear_monitor.messages.streams import CONTACT, LOAD_WRENCH, STREAMS, WRENCH_STAMPED
from leg_wear_monitor.monitor.config.settings import MonitorConfig

CRANK_CHANNEL, TORQUE_CHANNEL, LOAD_CHANNEL = 1, 2, 3
_EFFORT = "effort"
_Group = tuple[int, NDArray[np.int64], NDArray[np.uint8]]
"""Number of a channel; the rows and the messages of it."""


class Encoder:
    """Encodes rows as messages, by the parameters with which they are decoded.

    Parameters
    ----------
    config : MonitorConfig
    """

    def __init__(self, config: MonitorConfig) -> None:
        self._crank, self._further = config.crank_joint, config.encoders.names
        self._torque = config.drive_torque
        self.has_torque = bool(config.input.columns.drive_torque)
        self._streams = {stream.torque_source: stream for stream in STREAMS if not stream.load_source}
        of_load = {stream.load_source: stream for stream in STREAMS}
        self._load = of_load.get(config.foot_load.source if config.input.columns.foot_load else "none")

    @property
    def is_effort(self) -> bool:
        """Whether the torque is the effort of the crank, which needs an angle in the same row."""
        return self.has_torque and self._torque.source == _EFFORT

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels of a table by channel number."""
        streams = {CRANK_CHANNEL: self._streams[""]}
        if self.has_torque and not self.is_effort:
            streams[TORQUE_CHANNEL] = self._streams[self._torque.source]
        if self._load:
            streams[LOAD_CHANNEL] = self._load
        return {number: Channel(f"/{one.topic}", one.type, "cdr", "", "") for number, one in streams.items()}

    def piece(self, rows: Rows, log_time_ns: NDArray[np.int64], types: dict[int, int]) -> Piece:
        """Messages of rows, the crank's before the torque's and the foot load's.

        Parameters
        ----------
        rows : Rows
        log_time_ns : (n,) array of int
            Order of the rows.
        types : dict
            Stream code by channel number; other channels are left out.
        """
        groups: list[_Group] = []
        if CRANK_CHANNEL in types:
            groups += [(CRANK_CHANNEL, *group) for group in self._cranks(rows)]
        if TORQUE_CHANNEL in types:
            row = np.flatnonzero(rows.measured[DRIVE_TORQUE])
            raw = self._torques(rows.stamp_ns[row], rows.values[DRIVE_TORQUE][row])
            groups.append((TORQUE_CHANNEL, row, raw))
        if LOAD_CHANNEL in types and self._load:
            row = np.flatnonzero(rows.measured[FOOT_LOAD])
            groups.append((LOAD_CHANNEL, row, self._loads(self._load.code, rows, row)))
        return _piece(groups, log_time_ns, types, rows.stored)

    def _cranks(self, rows: Rows) -> list[tuple[NDArray[np.int64], NDArray[np.uint8]]]:
        """Rows and messages of the joints, for each set of joints that was measured together."""
        there = np.stack([rows.measured[name] for name in self._further], axis=1) if self._further else None
        angled = rows.measured[CRANK_ANGLE]
        if there is None:
            return [self._joints(rows, np.flatnonzero(angled), ())]
        sets, which = np.unique(there, axis=0, return_inverse=True)
        which = which.reshape(-1)
        return [
            self._joints(rows, np.flatnonzero(angled & (which == k)), tuple(np.flatnonzero(one)))
            for k, one in enumerate(sets)
        ]

    def _joints(
        self, rows: Rows, row: NDArray[np.int64], further: Sequence[int]
    ) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Messages with the crank and some of the further encoders."""
        names = [self._further[k] for k in further]
        angles = [rows.values[CRANK_ANGLE], *(rows.values[name] for name in names)]
        raw = encode.joint_states(
            rows.stamp_ns[row],
            [self._crank, *names],
            position=np.stack([angle[row] for angle in angles], axis=1),
            velocity=_of_the_crank(rows, CRANK_SPEED, row, len(names)),
            effort=_of_the_crank(rows, DRIVE_TORQUE, row, len(names)) if self.is_effort else None,
        )
        return row, raw

    def _torques(self, stamp_ns: NDArray[np.int64], torque: Floats) -> NDArray[np.uint8]:
        if self._streams[self._torque.source].code == WRENCH_STAMPED:
            vector = np.zeros((len(torque), 3))
            vector[:, "xyz".index(self._torque.axis)] = torque
            return encode.wrenches(stamp_ns, torque=vector)
        return encode.float64s(torque)

    def _loads(self, code: int, rows: Rows, row: NDArray[np.int64]) -> NDArray[np.uint8]:
        force = rows.values[FOOT_LOAD][row]
        if code == CONTACT:
            return encode.bools(force != 0.0)
        if code == LOAD_WRENCH:
            vector = np.zeros((len(row), 3))
            vector[:, 1] = force
            if FOOT_LOAD_ALONG in rows.values:
                vector[:, 0] = rows.values[FOOT_LOAD_ALONG][row]
            return encode.wrenches(rows.stamp_ns[row], force=vector)
        return encode.float64s(force)


def _of_the_crank(rows: Rows, key: str, row: NDArray[np.int64], others: int) -> Floats | None:
    """A column (n, joints) in which only the crank has a value; None without the column."""
    if key not in rows.values:
        return None
    return np.column_stack([rows.values[key][row], np.full((len(row), others), np.nan)])


def _piece(
    groups: list[_Group],
    log_time_ns: NDArray[np.int64],
    types: dict[int, int],
    stored: int,
) -> Piece:
    """Messages of all groups in the order of their rows; of a row, the crank's comes first."""
    messages, begin = [np.zeros(0, MESSAGE)], 0
    for number, row, raw in groups:
        one = np.zeros(len(row), MESSAGE)
        one["begin"] = begin + raw.shape[1] * np.arange(len(row))
        one["end"] = one["begin"] + raw.shape[1]
        one["log_time_ns"] = one["publish_time_ns"] = log_time_ns[row]
        one["type"] = types[number]
        messages.append(one)
        begin += raw.size
    order = np.argsort(np.concatenate([np.zeros(0, np.int64), *(row for _, row, _ in groups)]), kind="stable")
    data = np.concatenate([np.zeros(0, np.uint8), *(raw.reshape(-1) for _, _, raw in groups)])
    start_ns = int(log_time_ns[0]) if len(log_time_ns) else 0
    return Piece(start_ns, data, np.concatenate(messages)[order], stored)
