"""Execution of a study: missing points are computed, and each result is stored immediately."""

import warnings
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import attrs

from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.mechanism.loader import is_file_name, load_mechanism, shipped_mechanisms
from leg_wear_monitor.share import share_directory
from leg_wear_monitor.studies.plan.study import Study
from leg_wear_monitor.studies.point import Arrays, Point, code_digest
from leg_wear_monitor.studies.storage.store import StudyDirectory
from leg_wear_monitor.studies.tasks.compute import compute
from leg_wear_monitor.studies.tasks.ensemble import check_points
from leg_wear_monitor.workers.cluster import run_on_cluster
from leg_wear_monitor.workers.job import Job
from leg_wear_monitor.workers.processes import run_here, run_in_processes

_LIBRARIES = ("numpy", "numba")


def run_study(
    name: str,
    settings: Study,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Compute all points of a study whose results are not yet in its directory.

    Parameters
    ----------
    name : str
        A key of `leg_wear_monitor.studies.plan.settings.STUDIES`.
    settings : Study
    out : pathlib.Path
        Directory of the study. Existing results for this mechanism, settings and code are reused if their
        checksums are correct.
    workers : int
        Number of local processes; 1 uses this process only. Results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute the points instead.
    progress : callable, optional
        Called with the completed fraction of the work, 0 to 1.

    Returns
    -------
    int
        Number of computed points.

    Raises
    ------
    ConfigError, AssemblyError
        For invalid values, before any point is computed.

    Warns
    -----
    ConfigWarning
        For each existing result that was altered, exchanged or damaged; it is computed again.
    """
    settings.check()
    mechanism, points = load_mechanism(settings.mechanism), settings.points()
    check_points(mechanism, [point.settings for point in points])
    about = versions()
    keys = [point.key(mechanism) for point in points]
    directory = StudyDirectory(out)
    directory.open(_manifest(name, settings, points, keys, about), _text(settings.mechanism))
    wanted = dict(zip(keys, points, strict=True))
    missing = [
        Job(key, compute, (point.task, mechanism, point.settings, code_digest()), point.cost)
        for key, point in wanted.items()
        if not _is_kept(directory, key, point)
    ]
    report, total = progress or (lambda _fraction: None), sum(point.cost for point in wanted.values())
    spent = total - sum(job.cost for job in missing)

    def done(job: Job, arrays: Arrays) -> None:
        nonlocal spent
        point = wanted[job.key]
        directory.write(job.key, arrays, {"task": point.task, "settings": point.settings, "versions": about})
        spent += job.cost
        report(spent / total)

    report(spent / total)
    if scheduler is not None:
        run_on_cluster(missing, scheduler, done)
    elif workers > 1 and len(missing) > 1:
        run_in_processes(missing, min(workers, len(missing)), done)
    else:
        run_here(missing, done)
    return len(missing)


def _is_kept(directory: StudyDirectory, key: str, point: Point) -> bool:
    """Whether the directory contains a valid result of a point; warns about an invalid one."""
    if not directory.has(key):
        return False
    try:
        directory.read(key, point.task, point.settings)
    except ConfigError as error:
        warnings.warn(f"{error}; it is computed again", ConfigWarning, stacklevel=2)
        return False
    return True


def versions() -> dict[str, str]:
    """Versions that results depend on: this package, its code digest, and the numerical libraries."""
    package = ElementTree.parse(share_directory() / "package.xml").findtext("version") or "unknown"
    libraries = {library: metadata.version(library) for library in _LIBRARIES}
    return {"leg_wear_monitor": package, "code": code_digest(), **libraries}


def _manifest(
    name: str, settings: Study, points: list[Point], keys: list[str], about: dict[str, str]
) -> dict[str, Any]:
    return {
        "study": name,
        "settings": attrs.asdict(settings),
        "points": [
            {"label": point.label, "task": point.task, "settings": point.settings, "key": key}
            for point, key in zip(points, keys, strict=True)
        ],
        "versions": about,
    }


def _text(mechanism: str) -> str:
    """Text of a mechanism file."""
    path = Path(mechanism) if is_file_name(Path(mechanism)) else shipped_mechanisms()[mechanism]
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(mechanism, "", f"cannot be read: {error.strerror}") from error
