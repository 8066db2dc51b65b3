"""Reader of a bag directory's metadata.yaml (files, topics, compression), with limits on size and nesting."""

import stat
from pathlib import Path
from typing import Any

import attrs
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import AliasEvent

from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.bags.regular_file import open_regular
from leg_wear_monitor.configuration.yaml_file import events_with_depth

METADATA = "metadata.yaml"
_LARGEST = 2**20  # bytes; a bag of 200 topics and 1000 files has some 250 kB
_DEEPEST = 20


@attrs.frozen
class Metadata:
    """Contents of metadata.yaml.

    Attributes
    ----------
    files : list of str
        File names in order, without duplicates.
    by_message : bool
        Whether each message is compressed on its own.
    types : dict
        Message type by topic name.
    """

    files: list[str]
    by_message: bool
    types: dict[str, str]


def read_metadata(path: Path) -> Metadata:
    """Read metadata.yaml.

    Raises
    ------
    DamageError
        If the file is unreliable; the text is a predicate that follows the file name.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise DamageError("is not a file")
        if path.stat().st_size > _LARGEST:
            raise DamageError(f"has {path.stat().st_size} bytes, expected at most {_LARGEST}")
        with open_regular(path) as file:
            text = file.read(_LARGEST).decode("utf-8")
        _check_simple(text)
        return _structured(YAML(typ="safe", pure=True).load(text)["rosbag2_bagfile_information"])
    except (OSError, YAMLError, KeyError, TypeError, AttributeError, ValueError) as error:
        raise DamageError("cannot be read") from error


def _check_simple(text: str) -> None:
    """Refuse YAML that can grow without limit from a few lines: aliases and deep nesting."""
    for event, depth in events_with_depth(text):
        if isinstance(event, AliasEvent):
            raise DamageError("contains aliases, which no bag's metadata has")
        if depth > _DEEPEST:
            raise DamageError(f"is nested more than {_DEEPEST} deep")


def _structured(information: Any) -> Metadata:
    names = [Path(name).name for name in information["relative_file_paths"]]
    topics = [topic["topic_metadata"] for topic in information.get("topics_with_message_count", [])]
    mode = information.get("compression_mode", "")
    return Metadata(
        files=list(dict.fromkeys(names)),
        by_message=isinstance(mode, str) and mode.lower() == "message",
        types={topic["name"]: topic["type"] for topic in topics if _is_text(topic["name"], topic["type"])},
    )


def _is_text(*values: object) -> bool:
    return all(isinstance(value, str) for value in values)
