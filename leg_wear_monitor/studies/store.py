"""A study's directory: what was asked, and the result of every point, each file written whole or not at all.

study.json       name, settings, points with their keys, versions
mechanism.yaml   the leg, as its file was
points/KEY.npz   arrays of a point; its settings, seed and versions are in them as ``about``, JSON
"""

import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import parse_mechanism, read_yaml
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays, Point

MANIFEST, MECHANISM, POINTS = "study.json", "mechanism.yaml", "points"
_FORMAT = 1


class StudyDirectory:
    """Results of one study.

    Parameters
    ----------
    path : pathlib.Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def open(self, manifest: dict[str, Any], mechanism_text: str) -> None:
        """Make the directory, or take up one that holds the same study, whatever its settings were.

        Raises
        ------
        ConfigError
            If it holds another study, or cannot be written.
        """
        if (self.path / MANIFEST).exists():
            there = read_manifest(self.path)["study"]
            if there != manifest["study"]:
                raise ConfigError(
                    str(self.path),
                    "",
                    f"holds the study {there}, expected {manifest['study']} or a new directory",
                )
        try:
            (self.path / POINTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(str(self.path), "", f"cannot be made: {error.strerror}") from error
        self._write(MECHANISM, mechanism_text.encode())
        text = json.dumps({"format": _FORMAT, **manifest}, indent=1, allow_nan=False) + "\n"
        self._write(MANIFEST, text.encode())

    def has(self, key: str) -> bool:
        """Whether the result of a point is there."""
        return self._file(key).is_file()

    def write(self, key: str, arrays: Arrays, about: dict[str, Any]) -> None:
        """Keep the result of a point, with what it came from."""
        buffer = io.BytesIO()
        text = np.array(json.dumps(about, sort_keys=True, allow_nan=False))
        np.savez_compressed(buffer, **arrays, about=text)  # type: ignore[arg-type]
        self._write(f"{POINTS}/{key}.npz", buffer.getvalue())

    def read(self, key: str) -> Arrays:
        """Result of a point.

        Raises
        ------
        ConfigError
            If it is not there or damaged.
        """
        try:
            with np.load(self._file(key), allow_pickle=False) as file:
                return {name: file[name] for name in file.files if name != "about"}
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise ConfigError(str(self._file(key)), "", f"cannot be read: {error}") from error

    def _file(self, key: str) -> Path:
        return self.path / POINTS / f"{key}.npz"

    def _write(self, name: str, content: bytes) -> None:
        """Beside it first, then in its place: whoever looks sees all of it or nothing."""
        target = self.path / name
        part = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            with part.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, target)
        except OSError as error:
            raise ConfigError(str(target), "", f"cannot be written: {error.strerror}") from error
        finally:
            part.unlink(missing_ok=True)


def read_manifest(path: Path) -> dict[str, Any]:
    """What ``study.json`` in a directory says; raises ConfigError if it is not one of ours."""
    source = path / MANIFEST
    try:
        manifest = json.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(str(source), "", f"cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(str(source), "", f"is not JSON: {error}") from error
    if not isinstance(manifest, dict) or manifest.get("format") != _FORMAT:
        raise ConfigError(str(source), "", f"is no study of format {_FORMAT}")
    return manifest


@attrs.frozen(kw_only=True, eq=False)
class StudyResults:
    """A study as it lies in its directory, for figures and tables.

    Attributes
    ----------
    study : str
    settings : dict
        As `leg_wear_monitor.studies.settings` has them, plain.
    mechanism : Mechanism
    points : tuple of Point
    arrays : tuple of dict
        The result of each point that has one, the others are empty.
    versions : dict of str
    """

    study: str
    settings: dict[str, Any]
    mechanism: Mechanism
    points: tuple[Point, ...]
    arrays: tuple[Arrays, ...]
    versions: dict[str, str]

    def of(self, task: str) -> list[tuple[Point, Arrays]]:
        """Points of a task that have a result, with it."""
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


def load_results(path: Path) -> StudyResults:
    """Read a study's directory; raises ConfigError where it is not one."""
    manifest, directory = read_manifest(path), StudyDirectory(path)
    source = str(path / MECHANISM)
    entries = manifest["points"]
    return StudyResults(
        study=manifest["study"],
        settings=manifest["settings"],
        mechanism=parse_mechanism(read_yaml(path / MECHANISM, source), source),
        points=tuple(
            Point(label=entry["label"], task=entry["task"], settings=entry["settings"]) for entry in entries
        ),
        arrays=tuple(
            directory.read(entry["key"]) if directory.has(entry["key"]) else {} for entry in entries
        ),
        versions=manifest["versions"],
    )
