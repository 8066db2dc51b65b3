"""Execution of a study: computes missing points, stores each result at once, and returns the results."""

import io
import zipfile
import zlib
from collections.abc import Callable
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, system_asked
from leg_wear_monitor.files import data_frame, json_text, package_version, read_json, write_whole
from leg_wear_monitor.mechanism.loader import (
    is_file_name,
    load_mechanism,
    parse_mechanism,
    read_yaml,
    shipped_mechanisms,
)
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.study import Point, Study, parse_study
from leg_wear_monitor.studies.tables import TABLES, Found
from leg_wear_monitor.studies.tasks import Arrays, check_points, code_digest, compute
from leg_wear_monitor.workers import results

if TYPE_CHECKING:
    import pandas as pd

# Directory of a study; every file is written atomically.
#
# study.json       settings of the study, key of each point, versions
# mechanism.yaml   copy of the mechanism file
# points/KEY.npz   arrays of a point

MANIFEST, MECHANISM = "study.json", "mechanism.yaml"
_FORMAT = 3
_UNREADABLE = (EOFError, OSError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error)


def point_file(directory: Path, key: str) -> Path:
    """File of a point's result."""
    return directory / "points" / f"{key}.npz"


def run_study(
    study: Study,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Compute all points of a study whose results are not yet in its directory.

    Parameters
    ----------
    study : Study
    out : pathlib.Path
        Directory of the study. Results for the same mechanism, settings and code are kept.
    workers : int
        Number of local processes; 1 uses this process only. Results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute the points instead.
    progress : callable, optional
        Called with the fraction of the points that are done, 0 to 1.

    Returns
    -------
    int
        Number of computed points.

    Raises
    ------
    ConfigError, AssemblyError
        If a value is invalid, before any point is computed.
    """
    mechanism, points, code = load_mechanism(study.mechanism), study.points(), code_digest()
    check_points(mechanism, [point.settings for point in points])
    keys = {point.key(mechanism): point for point in points}
    _write_manifest(study, [point.key(mechanism) for point in points], out)
    calls = {
        key: partial(compute, point.task, mechanism, point.settings, code)
        for key, point in keys.items()
        if not point_file(out, key).is_file()
    }
    report = progress or (lambda _fraction: None)
    done = len(keys) - len(calls)
    report(done / len(keys))
    for key, arrays in results(calls, workers, scheduler):
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays)
        write_whole(point_file(out, key), buffer.getvalue())
        done += 1
        report(done / len(keys))
    return len(calls)


def _write_manifest(study: Study, keys: list[str], out: Path) -> None:
    """Create the directory with the settings, or use the directory of a study with the same title."""
    if (out / MANIFEST).exists():
        present = _read_manifest(out)["settings"]["title"]
        if present != study.title:
            fault = f"contains the study {present!r}. Expected {study.title!r} or a new directory"
            raise ConfigError(str(out), "", fault)
    is_file = is_file_name(study.mechanism)
    source = Path(study.mechanism) if is_file else shipped_mechanisms()[study.mechanism]
    with system_asked(out, "cannot be made"):
        (out / "points").mkdir(parents=True, exist_ok=True)
    write_whole(out / MECHANISM, source.read_bytes())
    libraries = {library: metadata.version(library) for library in ("numpy", "numba")}
    versions = {"leg_wear_monitor": package_version(), "code": code_digest(), **libraries}
    manifest = {"format": _FORMAT, "settings": attrs.asdict(study), "keys": keys, "versions": versions}
    write_whole(out / MANIFEST, json_text(manifest).encode())


def _read_manifest(directory: Path) -> dict[str, Any]:
    manifest = read_json(str(directory / MANIFEST))
    if not isinstance(manifest, dict) or manifest.get("format") != _FORMAT:
        fault = f"is not a study of format {_FORMAT}; remove it and run the study again, its points are kept"
        raise ConfigError(str(directory / MANIFEST), "", fault)
    return manifest


@attrs.frozen(kw_only=True, eq=False)
class StudyResults:
    """Contents of a study's directory, for figures and tables.

    Attributes
    ----------
    settings : Study
    mechanism : Mechanism
    points : tuple of Point
    arrays : tuple of dict
        Result of each point; empty for points without a result.
    versions : dict of str
    """

    settings: Study
    mechanism: Mechanism
    points: tuple[Point, ...]
    arrays: tuple[Arrays, ...]
    versions: dict[str, str]

    def of(self, task: str) -> Found:
        """Points of a task that have a result, and their results."""
        return [
            (point, arrays)
            for point, arrays in zip(self.points, self.arrays, strict=True)
            if point.task == task and arrays and "fault" not in arrays
        ]

    @property
    def faults(self) -> list[tuple[str, str]]:
        """Label and fault of the points with a diverged motion."""
        pairs = zip(self.points, self.arrays, strict=True)
        return [(point.label, str(arrays["fault"])) for point, arrays in pairs if "fault" in arrays]

    @property
    def missing(self) -> list[str]:
        """Labels of the points that have no result yet."""
        return [point.label for point, arrays in zip(self.points, self.arrays, strict=True) if not arrays]


def load_results(directory: Path) -> StudyResults:
    """Read a study's directory.

    Raises
    ------
    ConfigError
        If it is not a study's directory, or a file in it cannot be read.
    """
    manifest, source = _read_manifest(directory), directory / MECHANISM
    study = parse_study(manifest["settings"], f"{directory / MANIFEST}: settings")
    points, keys = study.points(), manifest["keys"]
    if len(keys) != len(points):
        raise ConfigError(str(directory / MANIFEST), "keys", f"has {len(keys)} keys. Expected {len(points)}")
    return StudyResults(
        settings=study,
        mechanism=parse_mechanism(read_yaml(source, str(source)), str(source)),
        points=tuple(points),
        arrays=tuple(_read_point(point_file(directory, key)) for key in keys),
        versions=manifest["versions"],
    )


def _read_point(path: Path) -> Arrays:
    if not path.is_file():
        return {}
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except _UNREADABLE as error:
        fault = f"cannot be read ({' '.join(str(error).split())}); remove it and run the study again"
        raise ConfigError(str(path), "", fault) from error


def load_study(path: str | Path) -> "dict[str, pd.DataFrame]":
    """Read the results of a study as tables; requires pandas.

    Parameters
    ----------
    path : str or pathlib.Path
        Directory that the study was written to.

    Returns
    -------
    dict of str to pandas.DataFrame
        ``points`` and ``joints`` (responses), ``exponents``, ``sections``, ``portraits``: one row per point,
        with the settings of the point, and per joint or gait cycle. A mean and its standard deviation end in
        different names: ``peak_force_n.mean``, ``peak_force_n.deviation``.

    Raises
    ------
    ConfigError
        If it is not the directory of a study, or a file in it cannot be read.
    LegWearError
        If pandas is not installed.
    """
    results = load_results(Path(path))
    return {name: data_frame(columns_of(results.of(task))) for name, (task, columns_of) in TABLES.items()}
