"""Parameters of a node as a flat list of dotted names: for ROS, for files, for documentation."""

import re
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import attrs

from leg_wear_monitor.configuration.strict import shown, structure, unknown_fault
from leg_wear_monitor.errors import ConfigError, nearest, printable
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.loader import read_yaml
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_Config = TypeVar("_Config")

# as ROS calls them (rcl_interfaces/ParameterType)
_TYPES = {
    bool: "bool",
    int: "integer",
    float: "double",
    str: "string",
    tuple[float, ...]: "double_array",
    tuple[str, ...]: "string_array",
}


@attrs.frozen(kw_only=True)
class Parameter:
    """Declaration of a parameter.

    Attributes
    ----------
    name : str
        Dotted, such as ``limits.clearance_m``.
    type : str
        ``bool``, ``integer``, ``double``, ``string``, ``double_array`` or ``string_array``.
    default : bool, int, float, str, tuple of float or tuple of str
    unit : str
        ``""`` where there is none.
    description : str
    read_only : bool
        True if it keeps its value from start to end.
    above, at_least, at_most : float or None
        Bounds of a number, or of each in an array; the first exclusive.
    names : tuple of str
        Allowed texts; empty if any text is allowed.
    """

    name: str
    type: str
    default: Any
    unit: str
    description: str
    read_only: bool
    above: float | None
    at_least: float | None
    at_most: float | None
    names: tuple[str, ...]

    @property
    def bounds(self) -> str:
        """Bounds or names in words, such as ``above 0, at most 1``; empty if there are none."""
        words = (("above", self.above), ("at least", self.at_least), ("at most", self.at_most))
        given = [f"{word} {bound:g}" for word, bound in words if bound is not None]
        return ", ".join(given) or ("one of " + ", ".join(self.names) if self.names else "")


def _walk(kind: type, prefix: str) -> Iterator[Parameter]:
    for field in attrs.fields(kind):
        name, metadata = f"{prefix}{field.name}", field.metadata
        if attrs.has(field.type):
            yield from _walk(field.type, f"{name}.")
            continue
        if "doc" not in metadata:  # a constant of the method
            continue
        yield Parameter(
            name=name,
            type=_TYPES[field.type],
            default=field.default,
            unit=metadata["unit"],
            description=metadata["doc"],
            read_only=not metadata.get("live", False),
            above=metadata.get("above"),
            at_least=metadata.get("at_least"),
            at_most=metadata.get("at_most"),
            names=metadata.get("names", ()),
        )


def parameters_of(kind: type) -> Mapping[str, Parameter]:
    """All parameters of a class of sections, by name, in the order of their declaration."""
    return MappingProxyType({parameter.name: parameter for parameter in _walk(kind, "")})


PARAMETERS: Mapping[str, Parameter] = parameters_of(MonitorConfig)
"""Parameters of the monitor."""


def is_of_node(name: str) -> bool:
    """True if a node has the parameter. Parameters of tables are for recordings only."""
    return not name.startswith("table.")


def config_from(values: Mapping[str, Any], source: str = "parameters") -> MonitorConfig:
    """Configuration of the monitor; see `structured`."""
    return structured(MonitorConfig, values, source)


def structured(kind: type[_Config], values: Mapping[str, Any], source: str) -> _Config:
    """Configuration from values by dotted name; other parameters have their defaults.

    Parameters
    ----------
    kind : type
        A class of sections, such as `MonitorConfig`.
    values : mapping of str to bool, int, float, str or sequence
    source : str
        File or node they come from, for messages.

    Raises
    ------
    ConfigError
        Naming source, parameter, value, unit and bounds of an unusable value.
    """
    known = parameters_of(kind)
    for name, value in values.items():
        if name not in known:
            fault = unknown_fault("parameter", name, known, "docs/reference/parameters.md lists all")
            raise ConfigError(source, name, fault)
        _check_type(known[name], value, source)
    try:
        return structure(nested(values), kind, source, "")
    except ConfigError as error:
        raise ConfigError(source, error.key, _with_bounds(error, known)) from error


def values_of(config: Any) -> dict[str, Any]:
    """Value of every parameter of a configuration by dotted name, arrays as tuples."""
    return {name: attrgetter(name)(config) for name in parameters_of(type(config))}


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by dotted name as the sections of a file, arrays as lists."""
    tree: dict[str, Any] = {}
    for name, value in values.items():
        *sections, last = name.split(".")
        place = tree
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = list(value) if isinstance(value, tuple) else value
    return tree


def changed(config: _Config, changes: Mapping[str, Any], source: str = "parameters") -> _Config:
    """Configuration with other values of parameters that may change while the monitor runs.

    Raises
    ------
    ConfigError
        If a value cannot be used, or a parameter that must not change is given.
    """
    values = values_of(config)
    wanted = structured(type(config), values | dict(changes), source)
    after = values_of(wanted)
    for name in changes:
        if parameters_of(type(config))[name].read_only and after[name] != values[name]:
            raise ConfigError(
                source, name, f"{shown(changes[name])} cannot change now: it is read only at the start"
            )
    return wanted


def _check_type(parameter: Parameter, value: Any, source: str) -> None:
    """Distinguish 60 from 60.0 as ROS does; otherwise a file could work in replay but not in the node."""
    if parameter.type not in ("double", "double_array"):
        return
    for entry in value if isinstance(value, list | tuple) else (value,):
        if isinstance(entry, int) and not isinstance(entry, bool):
            unit = f" [{parameter.unit}]" if parameter.unit else ""
            raise ConfigError(
                source,
                parameter.name,
                f"{shown(value)} is an integer for ROS. Expected {shown(entry)}.0{unit}",
            )


def _with_bounds(error: ConfigError, known: Mapping[str, Parameter]) -> str:
    """The fault with the bounds, unless it already names them."""
    parameter = known.get(error.key)
    if (
        parameter is None
        or not parameter.bounds
        or "expected" in error.fault
        or parameter.bounds in error.fault
    ):
        return error.fault
    return f"{error.fault}. Expected {parameter.bounds}"


# Reads a ROS 2 parameter file without ROS, for replay and check, as the node reads it by --params-file.


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
        Naming file, parameter, value, unit and the expected value.

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
    """True if the content of a YAML file is ROS parameters, or ROS parameters with a misspelt mark."""
    return bool(_misspelt(document)) or any(_is_marked(entry) for _, entry in _sections(document))


def parse_config(document: Any, source: str, node: str | None = None) -> MonitorConfig:
    """Configuration from the plain mapping of a parameter file; see `load_config`.

    Sections for the node are applied in their order, so that later ones prevail.
    """
    if not is_parameter_file(document):
        raise ConfigError(source, "", f"is not a ROS parameter file. Expected '/**: {{{MARK}: ...}}'")
    if misspelt := _misspelt(document):
        raise ConfigError(source, misspelt, f"is not a key of ROS. Expected {MARK} with two underscores")
    values: dict[str, Any] = {}
    sections = list(_sections(document))
    node, taken = node or _node_of([name for name, _ in sections]), False
    for pattern, entry in sections:
        parameters = _parameters(entry, source, pattern if pattern.isprintable() else shown(pattern))
        if _is_for(pattern, node):
            taken = True
            values |= _flat(parameters, "", source)
    if not taken:
        found = ", ".join(name for name, _ in sections)
        fault = f"has no section for the node {node}; its sections are for: {found}"
        if len(monitors_of(document)) > 1:
            fault += "; choose one with --node (in a fleet file: node)"
        raise ConfigError(source, "", fault)
    return config_from({name: value for name, value in values.items() if not _OF_ROS.fullmatch(name)}, source)


def monitors_of(document: Any) -> tuple[str, ...]:
    """Full names of the monitors that have their own section in a parameter file."""
    names = (name for name, _ in _sections(document))
    return tuple(dict.fromkeys(name for name in names if name.endswith(NODE) and "*" not in name))


def _node_of(sections: Sequence[str]) -> str:
    """The node in the root namespace, or the only monitor node of a file such as a dump."""
    only, *others = sections
    return only if not others and "*" not in only and only.endswith(NODE) else NODE


def _parameters(entry: Any, source: str, pattern: str) -> dict[Any, Any]:
    if not isinstance(entry, dict) or list(entry) != [MARK]:
        raise ConfigError(source, pattern, f"{shown(entry)} is not a mapping with the one key {MARK}")
    parameters = entry[MARK]
    if not isinstance(parameters, dict):
        raise ConfigError(source, f"{pattern}.{MARK}", f"{shown(parameters)} is not a mapping of parameters")
    return parameters


def sections_for_others(path: str | Path, node: str) -> tuple[str, ...]:
    """Sections of a parameter file, if none of them is for a node; empty if one is.

    Raises
    ------
    ConfigError
        If the file cannot be read.
    """
    found = tuple(name for name, _ in _sections(read_yaml(Path(path), str(path))))
    return () if any(_is_for(each, node) for each in found) else found


def _is_marked(entry: Any) -> bool:
    return isinstance(entry, dict) and MARK in entry


def _misspelt(document: Any) -> str:
    """The first key that seems to be meant for the mark, behind its section; empty if there is none."""
    for name, entry in _sections(document):
        path = name.split("/")
        for place, key in enumerate(path):
            if key.startswith("ros") and not _is_marked(entry) and nearest(key, [MARK]):
                return printable(f"{'/'.join(path[:place])}: {key}")
    return ""


def _sections(document: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Sections by full name; ROS accepts nested names of namespaces and nodes as well."""
    for key, entry in document.items() if isinstance(document, dict) else ():
        name = f"{prefix}/{str(key).strip('/')}"
        if isinstance(entry, dict) and entry and MARK not in entry:
            yield from _sections(entry, name)
        else:
            yield name, entry


def _is_for(pattern: str, node: str) -> bool:
    """True if a section is for a node: ``*`` stands for one name, ``**`` for any number of them."""
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
