"""From what a user names to files in their order: files, bag directories, split and compressed bags."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import attrs
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from leg_wear_monitor.recording.findings import Finding, RecordingError, Weight

METADATA = "metadata.yaml"
MCAP, SQLITE = ".mcap", ".db3"
_NAME = re.compile(r".*(\.mcap|\.db3)(\.zstd)?")


@attrs.frozen
class BagFile:
    """One file of a recording.

    Attributes
    ----------
    path : pathlib.Path
    storage : str
        `MCAP` or `SQLITE`.
    compressed : bool
        Whether the whole file is.
    by_message : bool
        Whether each message in it is.
    types : dict
        Types of topics that metadata.yaml names.
    """

    path: Path
    storage: str
    compressed: bool = False
    by_message: bool = False
    types: dict[str, str] = attrs.Factory(dict)


def find_files(paths: Iterable[str | Path]) -> tuple[list[BagFile], list[Finding]]:
    """Files of recordings, and what is wrong with their directories.

    Parameters
    ----------
    paths : iterable
        Files and bag directories.

    Raises
    ------
    RecordingError
        For what is not there or is no recording by its name.
    """
    files: list[BagFile] = []
    findings: list[Finding] = []
    for path in map(Path, paths):
        if not path.exists():
            raise RecordingError(str(path), "", "is not there, expected a bag directory, .mcap or .db3")
        if path.is_dir():
            files += _directory(path, findings)
        else:
            files.append(_file(path))
    if not files:
        raise RecordingError("", "", "no recording is named, expected bag directories or .mcap or .db3 files")
    return files, findings


def _file(path: Path, **parts: Any) -> BagFile:
    match = _NAME.fullmatch(path.name)
    if match is None:
        raise RecordingError(str(path), "", "is neither a bag directory nor an .mcap or .db3 file")
    return BagFile(path, match[1], match[2] is not None, **parts)


def _directory(path: Path, findings: list[Finding]) -> list[BagFile]:
    """Files of a bag directory in the order of its metadata, else in the order of their numbers."""
    there = sorted((file for file in path.iterdir() if _NAME.fullmatch(file.name)), key=_by_number)
    named, parts = _metadata(path / METADATA, findings)
    if named:
        missing = [name for name in named if not (path / name).is_file()]
        for name in missing:
            findings.append(Finding(path / METADATA, f"names {name}, which is not there: it is lost"))
        there = [path / name for name in named if name not in missing]
    if not there:
        raise RecordingError(str(path), "", "holds no .mcap or .db3 file")
    return [_file(file, **parts) for file in there]


def _metadata(path: Path, findings: list[Finding]) -> tuple[list[str], dict[str, Any]]:
    """Names of the files and what holds for all of them; nothing where there is no metadata to rely on."""
    if not path.is_file():
        return [], {}
    try:
        information = YAML(typ="safe", pure=True).load(path.read_text())["rosbag2_bagfile_information"]
        names = [Path(name).name for name in information["relative_file_paths"]]
        types = {
            str(topic["topic_metadata"]["name"]): str(topic["topic_metadata"]["type"])
            for topic in information.get("topics_with_message_count", [])
        }
        by_message = str(information.get("compression_mode", "")).lower() == "message"
    except (YAMLError, UnicodeDecodeError, KeyError, TypeError, AttributeError, ValueError):
        findings.append(Finding(path, "cannot be read: the directory's files are taken instead", Weight.NOTE))
        return [], {}
    if not all(_NAME.fullmatch(name) for name in names):
        findings.append(
            Finding(path, "names other files than .mcap and .db3: they are not read", Weight.NOTE)
        )
        names = [name for name in names if _NAME.fullmatch(name)]
    return names, {"by_message": by_message, "types": types}


def _by_number(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Key that puts run_2.mcap before run_10.mcap."""
    parts = re.findall(r"\d+|\D+", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts], path.name
