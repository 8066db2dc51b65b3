"""Reads a ROS 2 parameter file without ROS, for replay and check, as the node reads it by --params-file."""

import re
from pathlib import Path
from typing import Any

from leg_wear_monitor.configuration.strict import shown
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import read_yaml
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.share import share_directory

NODE = "/leg_wear_monitor"
MARK = "ros__parameters"

# parameters every ROS node has; they are not ours to check
_OF_ROS = re.compile(r"use_sim_time|start_type_description_service|qos_overrides\..*")


def shipped_config() -> Path:
    """The parameter file that comes with the package."""
    return share_directory() / "config" / "monitor.yaml"


def load_config(path: str | Path | None = None, node: str | None = None) -> MonitorConfig:
    """Read the monitor's parameters from a ROS parameter file.

    Parameters
    ----------
    path : str or pathlib.Path, optional
        Default: the file of the package.
    node : str, optional
        Full name of the node whose parameters are read, such as ``/robot/leg_wear_monitor``; default: the
        node in the root namespace, or the only node of the file.

    Raises
    ------
    ConfigError
        Naming file, parameter, value, unit and what was expected.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> config = lw.load_config()
    >>> config.mechanism, config.limits.clearance_m
    ('bionic_leg', 0.0006)
    """
    place = shipped_config() if path is None else Path(path)
    source = place.name if path is None else str(path)
    return parse_config(read_yaml(place, source), source, node)


def is_parameter_file(document: Any) -> bool:
    """Whether the content of a YAML file is ROS parameters."""
    return isinstance(document, dict) and any(
        isinstance(entry, dict) and MARK in entry for entry in document.values()
    )


def parse_config(document: Any, source: str, node: str | None = None) -> MonitorConfig:
    """Configuration from the plain mapping of a parameter file; see `load_config`.

    Sections for the node are applied in their order, so that later ones prevail.
    """
    if not is_parameter_file(document):
        raise ConfigError(source, "", f"is not a ROS parameter file, expected '/**: {{{MARK}: ...}}'")
    values: dict[str, Any] = {}
    node, taken = node or _node_of(document), False
    for pattern, entry in document.items():
        parameters = _parameters(
            entry, source, str(pattern) if str(pattern).isprintable() else shown(pattern)
        )
        if _is_for(str(pattern), node):
            taken = True
            values |= _flat(parameters, "", source)
    if not taken:
        sections = ", ".join(map(str, document))
        raise ConfigError(source, "", f"has nothing for the node {node}, its sections are for: {sections}")
    return config_from({name: value for name, value in values.items() if not _OF_ROS.fullmatch(name)}, source)


def _node_of(document: dict[Any, Any]) -> str:
    """The node in the root namespace, or the only monitor node of a file such as a dump."""
    only = str(next(iter(document)))
    is_one = len(document) == 1 and "*" not in only and only.endswith(NODE)
    return "/" + only.strip("/") if is_one else NODE


def _parameters(entry: Any, source: str, pattern: str) -> dict[Any, Any]:
    if not isinstance(entry, dict) or list(entry) != [MARK]:
        raise ConfigError(source, pattern, f"{shown(entry)} is not a mapping with the one key {MARK}")
    parameters = entry[MARK]
    if not isinstance(parameters, dict):
        raise ConfigError(source, f"{pattern}.{MARK}", f"{shown(parameters)} is not a mapping of parameters")
    return parameters


def _is_for(pattern: str, node: str) -> bool:
    """Whether a section is for a node: ``*`` stands for one name, ``**`` for any number of them."""
    expression = re.escape("/" + pattern.strip("/"))
    expression = expression.replace(r"/\*\*", "(/[^/]+)*").replace(r"\*", "[^/]+")
    return re.fullmatch(expression, node) is not None


def _flat(parameters: dict[Any, Any], prefix: str, source: str) -> dict[str, Any]:
    """Values by dotted name; ROS takes nested mappings and dotted keys for the same."""
    values: dict[str, Any] = {}
    for key, value in parameters.items():
        if not isinstance(key, str) or not key.isprintable():
            raise ConfigError(source, prefix.rstrip("."), f"the key {shown(key)} is not a text on one line")
        entries = (
            _flat(value, f"{prefix}{key}.", source) if isinstance(value, dict) else {prefix + key: value}
        )
        for name in entries.keys() & values.keys():
            raise ConfigError(source, name, "is given twice")
        values |= entries
    return values
