"""Mechanisms from plain documents, read from a file as a user writes it."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ruamel.yaml import YAML

import leg_wear_monitor as lw

MECHANISMS = lw.share_directory() / "config" / "mechanisms"
NAMES = sorted(path.stem for path in MECHANISMS.glob("*.yaml"))


def document_of(name: str) -> Any:
    """Content of the file of a mechanism that comes with the package, free to be changed."""
    return YAML(typ="safe", pure=True).load(MECHANISMS / f"{name}.yaml")


def write_mechanism(document: Any, path: Path) -> None:
    """Write a document in the order of its keys."""
    yaml: Any = YAML(typ="safe", pure=True)
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump(document, path)


def mechanism_of(document: Any) -> lw.Mechanism:
    """Read a document from ``leg.yaml`` in some directory."""
    with TemporaryDirectory() as home:
        path = Path(home) / "leg.yaml"
        write_mechanism(document, path)
        return lw.load_mechanism(path)
