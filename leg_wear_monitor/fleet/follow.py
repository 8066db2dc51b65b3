"""Which recordings are complete, while others are being recorded."""

from pathlib import Path

import attrs

from leg_wear_monitor.bags.bag import PARQUET, find_files
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap.layout import MAGIC
from leg_wear_monitor.bags.metadata import METADATA
from leg_wear_monitor.fleet.chain.scan import state_of
from leg_wear_monitor.fleet.description.fleet_description import FleetDescription

PATIENCE = 6
"""Looks during which a recording without an end must not change: its recorder may have been killed."""

_ENDS = {".mcap": MAGIC, PARQUET: b"PAR1"}


class Followed:
    """Looks again and again at the recordings of a fleet."""

    def __init__(self) -> None:
        self._seen: dict[Path, tuple[tuple[int, int], int]] = {}

    def complete(self, fleet: FleetDescription) -> FleetDescription:
        """The fleet with the recordings that are complete: unchanged since the last look, and with their end.

        Parameters
        ----------
        fleet : FleetDescription
            As it is now.
        """
        return attrs.evolve(
            fleet,
            legs=tuple(
                attrs.evolve(leg, recordings=tuple(filter(self._is_complete, leg.recordings)))
                for leg in fleet.legs
            ),
        )

    def _is_complete(self, path: Path) -> bool:
        state = state_of(path)
        before, looks = self._seen.get(path, (None, 0))
        looks = looks + 1 if before == state else 0
        self._seen[path] = state, looks
        return looks >= (1 if has_end(path) else PATIENCE)


def has_end(path: Path) -> bool:
    """Whether a recording has what its recorder writes last."""
    if path.is_dir():
        return (path / METADATA).is_file()
    try:
        (file,) = find_files([path])[0]
        end = _ENDS.get(file.storage, b"")
        if file.compressed or not end:
            return False
        with path.open("rb") as content:
            content.seek(-min(len(end), path.stat().st_size), 2)
            return content.read() == end
    except (RecordingError, OSError):
        return False
