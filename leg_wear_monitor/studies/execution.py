"""Execution of a study: missing points are computed, each result is stored at once, bound to its origin."""

import hashlib
import io
import json
import re
import warnings
import zipfile
import zlib
from collections.abc import Callable
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.errors import ConfigError, ConfigWarning, system_asked
from leg_wear_monitor.files import json_text, package_version, share_directory, write_whole
from leg_wear_monitor.mechanism.loader import is_file_name, load_mechanism, read_yaml, shipped_mechanisms
from leg_wear_monitor.studies.kinds import STUDIES
from leg_wear_monitor.studies.leg_tasks import TASKS, compute
from leg_wear_monitor.studies.life_tasks import check_points
from leg_wear_monitor.studies.plan import Arrays, Point, Study, code_digest
from leg_wear_monitor.workers import results

# Settings of studies from YAML files.


def load_settings(name: str, path: str | Path | None = None) -> Study:
    """Read the description of a study.

    Parameters
    ----------
    name : str
        A key of `STUDIES`.
    path : str or pathlib.Path, optional
        File of the description; default: the one shipped with the package.

    Raises
    ------
    ConfigError
        If a value is invalid; the message names file, key, value, unit and expectation.
    """
    if name not in STUDIES:
        raise ConfigError("study", "", f"{name!r} is not one of {', '.join(STUDIES)}")
    place = share_directory() / "config" / "studies" / f"{name}.yaml" if path is None else Path(path)
    source = place.name if path is None else str(path)
    return parse_settings(name, read_yaml(place, source), source)


def parse_settings(name: str, document: Any, source: str) -> Study:
    """Convert the plain mapping of a study's file to typed settings; see `load_settings`."""
    return structure(document, STUDIES[name], source, "")


# Checksums that bind a stored result to its origin.


def canonical(value: Any) -> str:
    """Canonical JSON of plain values: equal values give equal text."""
    return json.dumps(value, sort_keys=True, allow_nan=False)


def text_checksum(*texts: str) -> str:
    """SHA-256 over a sequence of texts, with their boundaries."""
    digest = hashlib.sha256()
    for text in texts:
        raw = text.encode()
        digest.update(b"%d:" % len(raw) + raw)
    return digest.hexdigest()


def result_checksum(about: dict[str, Any], arrays: Arrays) -> str:
    """SHA-256 over a result and its declared origin.

    Parameters
    ----------
    about : dict
        Plain values: the point's key, task and settings, and versions.
    arrays : dict of arrays
    """
    digest = hashlib.sha256(text_checksum(canonical(about)).encode())
    for name, array in sorted(arrays.items()):
        head = canonical([name, array.dtype.str, list(array.shape)])
        digest.update(text_checksum(head).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


# File of one point: result arrays and their origin, protected by one checksum.


_ABOUT = "about"
_MOST_BYTES = 2**29  # limit of the uncompressed size; a small archive can declare any size

_UNREADABLE = (
    ArithmeticError, EOFError, KeyError, MemoryError, OSError, RuntimeError, TypeError, ValueError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def archive(arrays: Arrays, about: dict[str, Any]) -> bytes:
    """Serialize a result to the content of its file.

    Parameters
    ----------
    arrays : dict of arrays
    about : dict
        Plain values: the point's key, task and settings, and versions.
    """
    buffer = io.BytesIO()
    text = np.array(canonical({**about, "checksum": result_checksum(about, arrays)}))
    np.savez_compressed(buffer, **arrays, **{_ABOUT: text})  # type: ignore[arg-type]
    return buffer.getvalue()


def read_archive(path: Path, key: str, task: str, settings: dict[str, Any]) -> Arrays:
    """Read the arrays in the file of a point.

    Parameters
    ----------
    path : pathlib.Path
    key, task, settings
        Key, task and settings of the expected point.

    Raises
    ------
    ConfigError
        If the file is unreadable, was altered, or is the result of another point.
    """
    source = str(path)
    try:
        with zipfile.ZipFile(path) as file:
            if sum(entry.file_size for entry in file.infolist()) > _MOST_BYTES:
                raise ValueError(f"it unpacks to more than {_MOST_BYTES // 2**20} MB")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        about = json.loads(str(arrays.pop(_ABOUT)))
        checksum = about.pop("checksum")
        is_whole = checksum == result_checksum(about, arrays)
    except _UNREADABLE as error:
        fault = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(source, "", f"cannot be read: {fault}") from error
    except AttributeError as error:  # JSON, but no object
        raise ConfigError(source, "", "does not name its point") from error
    if not is_whole:
        raise ConfigError(source, "", "was altered after it was computed (its checksum differs)")
    if canonical([about[name] for name in ("key", "task", "settings")]) != canonical([key, task, settings]):
        raise ConfigError(source, "", "is the result of another point")
    return arrays


# Directory of a study: its settings, and the result of each point; every file is written atomically.
#
# study.json       name, settings, points with their keys, versions; a checksum of these and of the leg
# mechanism.yaml   copy of the leg's mechanism file points/KEY.npz   arrays of a point; its settings, seed,
# versions and a checksum are in them as ``about``, JSON


MANIFEST, MECHANISM, POINTS = "study.json", "mechanism.yaml", "points"
_FORMAT = 2
_KEY = re.compile(r"[0-9a-f]{20}")
_REMOVE = "remove it and run the study again, its points are kept"


class StudyDirectory:
    """Results of one study.

    Parameters
    ----------
    path : pathlib.Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def open(self, manifest: dict[str, Any], mechanism_text: str) -> None:
        """Create the directory, or open an existing one of the same study, whatever its settings were.

        Raises
        ------
        ConfigError
            If the directory contains another study, or is not writable.
        """
        if (self.path / MANIFEST).exists():
            present = read_manifest(self.path)["study"]
            if present != manifest["study"]:
                raise ConfigError(
                    str(self.path),
                    "",
                    f"contains the study {present}, expected {manifest['study']} or a new directory",
                )
        with system_asked(self.path, "cannot be made"):
            (self.path / POINTS).mkdir(parents=True, exist_ok=True)
        write_whole(self.path / MECHANISM, mechanism_text.encode())
        whole = {"format": _FORMAT, **manifest}
        whole["checksum"] = text_checksum(canonical(whole), mechanism_text)
        write_whole(self.path / MANIFEST, json_text(whole).encode())

    def has(self, key: str) -> bool:
        """Whether a result file of a point exists, valid or not."""
        return self._file(key).is_file()

    def write(self, key: str, arrays: Arrays, about: dict[str, Any]) -> None:
        """Store the result of a point, with its task, settings and versions."""
        write_whole(self._file(key), archive(arrays, {"key": key, **about}))

    def read(self, key: str, task: str, settings: dict[str, Any]) -> Arrays:
        """Result of a point.

        Raises
        ------
        ConfigError
            If the result is missing, damaged, altered, or of another point.
        """
        return read_archive(self._file(key), key, task, settings)

    def _file(self, key: str) -> Path:
        return self.path / POINTS / f"{key}.npz"


def read_manifest(path: Path) -> dict[str, Any]:
    """Read ``study.json`` in a directory.

    Raises
    ------
    ConfigError
        If it is not a manifest of this package, or if it or the mechanism file was altered.
    """
    source, text = path / MANIFEST, _text(path / MECHANISM)
    try:
        manifest = json.loads(_text(source))
    except (ValueError, RecursionError) as error:
        raise ConfigError(str(source), "", f"is not JSON: {error}") from error
    if not isinstance(manifest, dict) or manifest.get("format") != _FORMAT:
        raise ConfigError(str(source), "", f"is not a study of format {_FORMAT}")
    checksum = manifest.pop("checksum", None)
    try:
        is_whole = checksum == text_checksum(canonical(manifest), text)
    except (ValueError, RecursionError):  # a number or a text that JSON cannot represent
        is_whole = False
    if not is_whole:
        altered = f"it or {MECHANISM} beside it was altered (the checksum differs); {_REMOVE}"
        raise ConfigError(str(source), "", altered)
    if not _is_study(manifest):
        raise ConfigError(str(source), "", f"contains no study of this version; {_REMOVE}")
    return manifest


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(str(path), "", f"is not UTF-8: {error}") from error


def _is_study(manifest: dict[str, Any]) -> bool:
    """Whether all parts exist with the right type; a key is used as a file name, so its form is checked."""
    types = {"study": str, "settings": dict, "points": list, "versions": dict}
    return (
        all(isinstance(manifest.get(name), kind) for name, kind in types.items())
        and manifest["study"] in STUDIES
        and all(isinstance(version, str) for version in manifest["versions"].values())
        and all(isinstance(entry, dict) and _is_point(entry) for entry in manifest["points"])
    )


def _is_point(entry: dict[str, Any]) -> bool:
    types = {"label": str, "task": str, "settings": dict, "key": str}
    return (
        all(isinstance(entry.get(name), kind) for name, kind in types.items())
        and entry["task"] in TASKS
        and _KEY.fullmatch(entry["key"]) is not None
    )


# Execution of a study: missing points are computed, and each result is stored immediately.


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
        A key of `STUDIES`.
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
    directory.open(_manifest(name, settings, points, keys, about), _mechanism_text(settings.mechanism))
    wanted = dict(zip(keys, points, strict=True))
    missing = {key: point for key, point in wanted.items() if not _is_kept(directory, key, point)}
    costly_first = sorted(missing.items(), key=lambda item: -item[1].cost)
    calls = {
        key: partial(compute, point.task, mechanism, point.settings, code_digest())
        for key, point in costly_first
    }
    report, total = progress or (lambda _fraction: None), sum(point.cost for point in wanted.values())
    spent = total - sum(point.cost for point in missing.values())
    report(spent / total)
    for key, arrays in results(calls, workers, scheduler):
        point = wanted[key]
        directory.write(key, arrays, {"task": point.task, "settings": point.settings, "versions": about})
        spent += point.cost
        report(spent / total)
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
    libraries = {library: metadata.version(library) for library in _LIBRARIES}
    return {"leg_wear_monitor": package_version(), "code": code_digest(), **libraries}


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


def _mechanism_text(mechanism: str) -> str:
    """Text of a mechanism file."""
    path = Path(mechanism) if is_file_name(Path(mechanism)) else shipped_mechanisms()[mechanism]
    with system_asked(mechanism, "cannot be read"):
        return path.read_text(encoding="utf-8")
