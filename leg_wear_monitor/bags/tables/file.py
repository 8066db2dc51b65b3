"""One table (CSV, Parquet, data frame) as a file of a recording; its faults are listed in `findings`."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.bags.mcap.file import Due, Piece
from leg_wear_monitor.bags.mcap.layout import Channel
from leg_wear_monitor.bags.tables.counts import Counts
from leg_wear_monitor.bags.tables.csv_file import CsvFile
from leg_wear_monitor.bags.tables.encoding import Encoder
from leg_wear_monitor.bags.tables.layout import Rows
from leg_wear_monitor.bags.tables.plausible import unit_doubts
from leg_wear_monitor.monitor.config.settings import MonitorConfig

CSV, PARQUET = ".csv", ".parquet"


class Table(Protocol):
    """Common interface of the kinds of tables."""

    size: int
    names: list[str]

    def parts(self) -> Iterator[Rows]:
        """All sound rows, block by block, from the first one."""


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
    budget : Budget

    Raises
    ------
    RecordingError
        If a column is missing, or no row can be read.
    """

    def __init__(
        self, path: Path, content: IO[bytes] | Any, storage: str, config: MonitorConfig, budget: Budget
    ) -> None:
        self.path, self._config, self._encoder = path, config, Encoder(config)
        self._open = lambda findings: _opened(path, content, storage, config, budget, findings)
        self._start_ns = self._check_start()
        self.findings: list[Finding] = []
        self._table = self._open(self.findings)
        self.size = self._table.size
        self.counts = Counts(config, self._encoder.is_effort, "line" if storage == CSV else "row")

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels by channel number."""
        return self._encoder.channels

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return self._table.names

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels; lines that cannot be read are skipped and become findings.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        path, parts, last_ns, is_over = self.path, self._table.parts(), self._start_ns, False

        def load() -> Piece | None:
            nonlocal last_ns, is_over
            rows = next(parts, None)
            if rows is None:
                is_over = True
                return None
            if self.counts.rows == 0:
                self.findings += [Finding(path, text) for text in unit_doubts(rows, self._config)]
            log_time_ns = _order(rows.stamp_ns, last_ns, self.counts.last_ns)
            self.counts.add(rows)
            last_ns = int(log_time_ns[-1]) if len(log_time_ns) else last_ns
            return self._encoder.piece(rows, log_time_ns, types)

        while not is_over:
            yield Due(last_ns, load)
        self.findings += [Finding(path, text, severity) for text, severity in self.counts.findings()]

    def _check_start(self) -> int:
        """Stamp of the first sound row [ns]; the first part decides whether anything can be read."""
        found: list[Finding] = []
        table = self._open(found)
        rows = next(table.parts(), None)
        if rows is not None and len(rows.stamp_ns):
            return int(rows.stamp_ns[0])
        why = next((f"; {finding.text}" for finding in found), "")
        raise RecordingError(str(self.path), "", f"has no row that can be read{why}")


def _opened(
    path: Path, content: Any, storage: str, config: MonitorConfig, budget: Budget, findings: list[Finding]
) -> Table:
    if storage == CSV:
        return CsvFile(path, content, config, budget, findings)
    if storage == PARQUET:
        from leg_wear_monitor.bags.tables.parquet_file import ParquetFile

        return ParquetFile(path, content, config, budget, findings)
    from leg_wear_monitor.bags.tables.frame import Frame

    return Frame(path, content, config, findings)


def _order(stamp_ns: NDArray[np.int64], last_ns: int, last_stamp_ns: int | None) -> NDArray[np.int64]:
    """Times that keep the rows in their order: the stamps, but where a stamp goes back, the time stands."""
    before = stamp_ns[:1] if last_stamp_ns is None else np.array([last_stamp_ns], np.int64)
    steps = np.diff(stamp_ns, prepend=before)
    return np.asarray(last_ns + np.cumsum(np.maximum(steps, 0)), np.int64)
