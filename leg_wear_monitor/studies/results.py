"""What a study found: its settings, and the result of each point, for pages and for Python users."""

from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from leg_wear_monitor.data_frame import data_frame
from leg_wear_monitor.mechanism.loader import parse_mechanism, read_yaml
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.claims.evaluation import LegClaims, evaluate
from leg_wear_monitor.studies.plan.settings import parse_settings
from leg_wear_monitor.studies.plan.study import Study
from leg_wear_monitor.studies.point import Arrays, Point
from leg_wear_monitor.studies.storage.store import MANIFEST, MECHANISM, StudyDirectory, read_manifest
from leg_wear_monitor.studies.tables import joint_columns, point_columns

if TYPE_CHECKING:
    import pandas as pd


@attrs.frozen(kw_only=True, eq=False)
class StudyResults:
    """Contents of a study's directory, for figures and tables.

    Attributes
    ----------
    study : str
    settings : Study
    mechanism : Mechanism
    points : tuple of Point
    arrays : tuple of dict
        Result of each point; empty for points without a result.
    versions : dict of str
    """

    study: str
    settings: Study
    mechanism: Mechanism
    points: tuple[Point, ...]
    arrays: tuple[Arrays, ...]
    versions: dict[str, str]

    def of(self, task: str) -> list[tuple[Point, Arrays]]:
        """Points of a task that have a result, and their results."""
        pairs = zip(self.points, self.arrays, strict=True)
        return [
            (point, arrays)
            for point, arrays in pairs
            if point.task == task and arrays and "fault" not in arrays
        ]

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Label and fault of the points whose motion diverged."""
        pairs = zip(self.points, self.arrays, strict=True)
        return [(point.label, str(arrays["fault"])) for point, arrays in pairs if "fault" in arrays]

    @property
    def missing(self) -> list[str]:
        """Labels of the points that have no result yet."""
        return [point.label for point, arrays in zip(self.points, self.arrays, strict=True) if not arrays]

    def claims(self) -> LegClaims:
        """The paper's claims against the legs of a study ``legs``; requires scipy."""
        return evaluate(self.of("leg"))

    def to_pandas(self) -> "dict[str, pd.DataFrame]":
        """Tables ``points`` and ``joints`` of the points with a response; requires pandas.

        A row a point, and a row a point and clearance joint. A statistic has its mean and its standard
        deviation over the ensemble, after a dot: ``toe_position_m.mean``, ``peak_force_n.deviation``.

        Raises
        ------
        LegWearError
            If pandas is not installed.
        """
        found = self.of("response")
        return {
            "points": data_frame(point_columns(found), index="point"),
            "joints": data_frame(joint_columns(found), index=["point", "joint"]),
        }


def load_results(path: Path) -> StudyResults:
    """Read a study's directory.

    Raises
    ------
    ConfigError
        If it is not a study's directory, or a part of it was altered, exchanged or damaged.
    """
    manifest, directory = read_manifest(path), StudyDirectory(path)
    source = str(path / MECHANISM)
    entries = manifest["points"]
    return StudyResults(
        study=manifest["study"],
        settings=parse_settings(manifest["study"], manifest["settings"], f"{path / MANIFEST}: settings"),
        mechanism=parse_mechanism(read_yaml(path / MECHANISM, source), source),
        points=tuple(
            Point(label=entry["label"], task=entry["task"], settings=entry["settings"]) for entry in entries
        ),
        arrays=tuple(
            directory.read(entry["key"], entry["task"], entry["settings"])
            if directory.has(entry["key"])
            else {}
            for entry in entries
        ),
        versions=manifest["versions"],
    )
