"""A fleet that was updated, for Python."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.fleet.description.loader import fleet_directory
from leg_wear_monitor.fleet.directory.atomic import make_directory
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory
from leg_wear_monitor.fleet.overview.parts import FleetOverview
from leg_wear_monitor.fleet.overview.read import load_overview
from leg_wear_monitor.fleet.tables.parquet import read_tables, write_table
from leg_wear_monitor.fleet.tables.records import lives_table, recordings_table, verdicts_table

if TYPE_CHECKING:
    import pandas as pd

TABLES = ("verdicts", "cycles", "recordings", "lives")


class Fleet:
    """A fleet that ``leg-wear-monitor fleet update`` keeps; the tables require pandas.

    Parameters
    ----------
    path : str or pathlib.Path
        Directory of the fleet, or its description ``fleet.yaml``.

    Attributes
    ----------
    path : pathlib.Path
        Directory of the fleet.
    overview : FleetOverview
        The fleet at a glance, as in ``fleet.json``.

    Raises
    ------
    ConfigError
        If no fleet is there.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> fleet = lw.Fleet("fleet/")  # doctest: +SKIP
    >>> fleet.overview.counts["stop"]  # doctest: +SKIP
    1
    >>> worst = fleet.lives().groupby("leg").used_fraction.max()  # doctest: +SKIP
    """

    def __init__(self, path: str | Path) -> None:
        self.path = fleet_directory(path)
        self.overview: FleetOverview = load_overview(self.path)
        self._legs = [(leg.id, leg.lot, LegDirectory(self.path, leg.id)) for leg in self.overview.legs]

    def table(self, name: str) -> Any:
        """A table of pyarrow.

        Parameters
        ----------
        name : str
            ``verdicts``, ``cycles``, ``recordings`` or ``lives``.

        Raises
        ------
        LegWearError
            If pyarrow is not installed.
        """
        if name == "cycles":
            return read_tables((leg, file) for leg, _, files in self._legs for file in files.tables())
        makers = {"verdicts": verdicts_table, "recordings": recordings_table, "lives": lives_table}
        return makers[name](self._legs)

    def cycles(self) -> "pd.DataFrame":
        """Table with a row for each minute, or each gait cycle, of each leg, in the order of time.

        A joint's column has its name after a dot: ``clearance_m.A``.
        """
        return _frame(self.table("cycles"))

    def verdicts(self) -> "pd.DataFrame":
        """Table with a row for each counted recording: the verdict at its end."""
        return _frame(self.table("verdicts"))

    def recordings(self) -> "pd.DataFrame":
        """Table with a row for each recording: what became of it."""
        return _frame(self.table("recordings"))

    def lives(self) -> "pd.DataFrame":
        """Table with a row for each counted recording and joint, and for the ``leg``: clearance and life."""
        return _frame(self.table("lives"))

    def export(self, out: str | Path) -> list[Path]:
        """Write all tables as CSV and Parquet files; the files.

        Parameters
        ----------
        out : str or pathlib.Path
            Directory, made if it does not exist.
        """
        make_directory(Path(out))
        files = []
        for name in TABLES:
            table = self.table(name)
            for ending in ("csv", "parquet"):
                files.append(Path(out) / f"{name}.{ending}")
                write_table(files[-1], table)
        return files


def _frame(table: Any) -> "pd.DataFrame":
    data_frame({})  # one line if pandas is not installed
    frame: pd.DataFrame = table.to_pandas()
    return frame
