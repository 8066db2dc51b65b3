"""Tables as recordings: their rows as messages of the streams."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.cdr import MESSAGE
from leg_wear_monitor.recordings.findings import Finding, RecordingError
from leg_wear_monitor.recordings.piece import Channel, Due, Piece
from leg_wear_monitor.recordings.streams import CONTACT, INTERFACES, LOAD_WRENCH, WRENCH_STAMPED, streams_of
from leg_wear_monitor.recordings.table_layout import (
    CRANK_ANGLE,
    CRANK_SPEED,
    DRIVE_TORQUE,
    FOOT_LOAD,
    FOOT_LOAD_ALONG,
    Rows,
)
from leg_wear_monitor.recordings.table_rows import TableRows, open_table
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE


@attrs.define
class Counts:
    """Counts over the rows of a table so far.

    Attributes
    ----------
    rows : int
    first_ns, last_ns : int
        Stamps of the first and of the last row [ns].
    measured : dict
        Number of rows with a value, by column.
    least, most : dict
        Range of the values in SI units, by column.
    unused : int
        Efforts without an angle in their row.
    """

    rows: int = 0
    first_ns: int = 0
    last_ns: int = 0
    measured: Counter[str] = attrs.Factory(Counter)
    least: dict[str, float] = attrs.Factory(dict)
    most: dict[str, float] = attrs.Factory(dict)
    unused: int = 0

    def add(self, rows: Rows) -> None:
        """Add rows, in their order."""
        if not len(rows.line):
            return
        self.first_ns = self.first_ns if self.rows else int(rows.stamp_ns[0])
        self.last_ns, self.rows = int(rows.stamp_ns[-1]), self.rows + len(rows.line)
        for key, there in rows.measured.items():
            self.measured[key] += int(np.count_nonzero(there))
            finite = rows.values[key][np.isfinite(rows.values[key])]
            if len(finite):
                self.least[key] = min(self.least.get(key, np.inf), float(finite.min()))
                self.most[key] = max(self.most.get(key, -np.inf), float(finite.max()))
        if DRIVE_TORQUE in rows.measured:
            alone = rows.measured[DRIVE_TORQUE] & ~rows.measured[CRANK_ANGLE]
            self.unused += int(np.count_nonzero(alone))


# Rows of a table as the messages that the monitor's node would have received.


CRANK_CHANNEL, TORQUE_CHANNEL, LOAD_CHANNEL = 1, 2, 3
_EFFORT = "effort"
_Group = tuple[int, NDArray[np.int64], NDArray[np.uint8]]
"""Number of a channel; the rows and the messages of it."""


class Encoder:
    """Encodes rows as messages, with the parameters that decode them again.

    Parameters
    ----------
    config : MonitorConfig
    """

    def __init__(self, config: MonitorConfig) -> None:
        self._crank, self._further = config.crank_joint, config.encoders.names
        self._torque = config.drive_torque
        self.has_torque = bool(config.table.columns.drive_torque)
        self._streams = {stream.kind: stream for stream in streams_of(config)}
        self._load = self._streams.get(LOAD) if config.table.columns.foot_load else None

    @property
    def is_effort(self) -> bool:
        """True if the torque is the effort of the crank, which needs an angle in the same row."""
        return self.has_torque and self._torque.source == _EFFORT

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels of a table by channel number."""
        streams = {CRANK_CHANNEL: self._streams[CRANK]}
        if self.has_torque and not self.is_effort:
            streams[TORQUE_CHANNEL] = self._streams[TORQUE]
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
        if self._streams[TORQUE].code == WRENCH_STAMPED:
            vector = np.zeros((len(torque), 3))
            vector[:, "xyz".index(self._torque.axis)] = torque
            return encode.wrenches(stamp_ns, torque=vector)
        if self._streams[TORQUE].code == INTERFACES:
            values = {self._crank: {self._torque.interface: torque}}
            return encode.dynamic_joint_states(stamp_ns, values)
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


# One table (CSV, Parquet, data frame) as a file of a recording; its faults are listed in `findings`.


class TableFile:
    """An open table.

    Parameters
    ----------
    path : pathlib.Path
        Name of the table in findings and errors.
    content : binary file, mapping of arrays or data frame
    storage : str
        `CSV`, `PARQUET`, or empty for columns in memory.
    config : MonitorConfig
        Names the columns and their units.

    Raises
    ------
    RecordingError
        If a column is missing, or no row can be read.
    """

    def __init__(self, path: Path, content: IO[bytes] | Any, storage: str, config: MonitorConfig) -> None:
        self.path, self._config, self._encoder = path, config, Encoder(config)
        self.findings: list[Finding] = []
        source = open_table(path, content, storage, config.table.columns.crank_angle)
        self.size, self.names = source.size, source.head.names
        self.counts = Counts()
        parts = TableRows(path, source, config, self.findings).parts()
        first = next((rows for rows in parts if len(rows.line)), None)
        if first is None:
            why = next((f"; {finding.text}" for finding in self.findings), "")
            raise RecordingError(str(path), "", f"has no row that can be read{why}")
        self._parts, self._start_ns = chain([first], parts), int(first.stamp_ns[0])

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels by channel number."""
        return self._encoder.channels

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels, once; lines that cannot be read become findings.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        last_ns, is_over = self._start_ns, False

        def load() -> Piece | None:
            nonlocal last_ns, is_over
            rows = next(self._parts, None)
            if rows is None:
                is_over = True
                return None
            log_time_ns = _order(rows.stamp_ns, last_ns, self.counts.last_ns if self.counts.rows else None)
            self.counts.add(rows)
            last_ns = int(log_time_ns[-1]) if len(log_time_ns) else last_ns
            return self._encoder.piece(rows, log_time_ns, types)

        while not is_over:
            yield Due(last_ns, load)
        if self._encoder.is_effort and self.counts.unused:
            text = f"{self.counts.unused} torques have no angle in their row"
            remedy = "drive_torque.source 'effort' needs it, 'wrench' does not"
            self.findings.append(Finding(self.path, f"{text}: they are lost; {remedy}"))


def _order(stamp_ns: NDArray[np.int64], last_ns: int, last_stamp_ns: int | None) -> NDArray[np.int64]:
    """Times that keep the rows in their order: the stamps, but where a stamp goes back, the time stands."""
    before = stamp_ns[:1] if last_stamp_ns is None else np.array([last_stamp_ns], np.int64)
    steps = np.diff(stamp_ns, prepend=before)
    return np.asarray(last_ns + np.cumsum(np.maximum(steps, 0)), np.int64)
