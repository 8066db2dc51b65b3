"""Directory of a study: its settings, and the result of each point; every file is written atomically.

study.json       name, settings, points with their keys, versions; a checksum of these and of the leg
mechanism.yaml   copy of the leg's mechanism file
points/KEY.npz   arrays of a point; its settings, seed, versions and a checksum are in them as ``about``, JSON
"""

import json
import re
from pathlib import Path
from typing import Any

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.studies.plan.settings import STUDIES
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.storage.archive import archive, read_archive
from leg_wear_monitor.studies.storage.checksum import canonical, text_checksum
from leg_wear_monitor.studies.tasks.compute import TASKS
from leg_wear_monitor.whole_file import write_whole

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
        try:
            (self.path / POINTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(str(self.path), "", f"cannot be made: {error.strerror}") from error
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
