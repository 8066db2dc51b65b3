"""Reading of mechanism files: YAML into checked types."""

from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.configuration.quantity import FieldError
from leg_wear_monitor.configuration.strict import choose, mapping, shown, structure
from leg_wear_monitor.configuration.yaml_file import read_document
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism import spec
from leg_wear_monitor.mechanism.clearance import ClearanceSection
from leg_wear_monitor.mechanism.clearance_joints import clearance_joints
from leg_wear_monitor.mechanism.references import check_references
from leg_wear_monitor.share import share_directory


def _key(field: "attrs.Attribute[Any]") -> Any:
    """A field of `spec.Mechanism` as a key of the file, where the clearances are not yet merged."""
    merged = field.name == "clearances"
    return attrs.field(
        type=ClearanceSection if merged else field.type,
        default=ClearanceSection() if merged else field.default,
        validator=None if merged else field.validator,
        metadata=field.metadata,
    )


# keys of the file: the fields with a description
_KEYS = {field.name: _key(field) for field in attrs.fields(spec.Mechanism) if "doc" in field.metadata}
_File = attrs.make_class("MechanismFile", _KEYS, kw_only=True)


def shipped_mechanisms() -> dict[str, Path]:
    """Files of the shipped mechanisms, by name."""
    return {path.stem: path for path in sorted((share_directory() / "config" / "mechanisms").glob("*.yaml"))}


def is_file_name(name_or_path: str | Path) -> bool:
    """Whether an argument is a path (has a suffix or a directory) instead of a shipped mechanism's name."""
    path = Path(name_or_path)
    return bool(path.suffix) or path.parent != Path()


def load_mechanism(name_or_path: str | Path = "bionic_leg") -> spec.Mechanism:
    """Read a mechanism from YAML and check everything that does not need its motion.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        Name of a shipped mechanism, or a path: anything with a suffix or a directory. Relative paths start
        at the current directory.

    Returns
    -------
    Mechanism

    Raises
    ------
    ConfigError
        Names file, key, value and what was expected.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> leg = lw.load_mechanism("bionic_leg")
    >>> leg.clearance_joints
    ('A', 'B', 'G', 'I', 'J')
    >>> leg.joint_words("G")
    'G (knee)'
    """
    path = Path(name_or_path)
    if is_file_name(path):
        return parse_mechanism(read_yaml(path, str(path)), str(path))
    shipped = shipped_mechanisms()
    if path.name not in shipped:
        raise ConfigError(
            str(name_or_path),
            "",
            f"no mechanism of this name, expected a file such as ./leg.yaml or one of {', '.join(shipped)}"
            + did_you_mean(path.name, shipped),
        )
    path = shipped[path.name]
    return parse_mechanism(read_yaml(path, path.name), path.name)


def parse_mechanism(document: Any, source: str) -> spec.Mechanism:
    """A mechanism from the contents of a YAML file, a plain mapping; see `load_mechanism`."""
    file = structure(document, _File, source, "")
    values = {key: getattr(file, key) for key in _KEYS}
    values["clearances"], values["clearance_joints"] = clearance_joints(file.clearances, file.joints, source)
    mechanism = spec.Mechanism(**values, source=source)
    check_references(mechanism)
    return mechanism


def read_yaml(path: Path, source: str) -> Any:
    """Contents of a YAML 1.2 file as plain values; see `yaml_file.read_document`."""
    try:
        return read_document(path, source)
    except FileNotFoundError as error:
        hint = f"; {path.stem} without .yaml is the one that comes with the package"
        known = path.parent == Path() and path.stem in shipped_mechanisms()
        raise ConfigError(source, "", f"cannot be read: {error.strerror}{hint if known else ''}") from error


# --- entries that are one class or another ---


def _joint_class(entry: Any) -> tuple[type, Any]:
    kind = mapping(entry).get("kind", "revolute")
    for name, joint in (("revolute", spec.RevoluteJoint), ("prismatic", spec.PrismaticJoint)):
        if kind == name:
            return joint, entry
    raise FieldError("kind", f"{shown(kind)} is not one of revolute, prismatic")


def _load_class(entry: Any) -> tuple[type, Any]:
    return spec.PhaseLoad if "phase" in mapping(entry) else spec.ConstantLoad, entry


_DRIVES = {"speed": spec.SpeedDrive, "torque": spec.TorqueDrive, "track": spec.TrackDrive}


def _drive_class(entry: Any) -> tuple[type, Any]:
    given = [key for key in _DRIVES if key in mapping(entry)]
    if len(given) != 1:
        raise FieldError(
            "",
            f"has {' and '.join(given) or 'none of them'}, "
            "expected one of speed [rad/s], torque [N m], track",
        )
    return _DRIVES[given[0]], entry


def _torques(entry: Any) -> tuple[Any, Any]:
    return tuple[float, ...], entry if isinstance(entry, list) else [entry]


def _label(entry: Any) -> tuple[Any, Any]:
    if entry is None or entry == "":
        raise FieldError("", "is empty, expected a name such as knee, or no label")
    return str, entry


choose(spec.RevoluteJoint | spec.PrismaticJoint, _joint_class)
choose(spec.ConstantLoad | spec.PhaseLoad, _load_class)
choose(spec.Drive, _drive_class)
choose(spec.Torques, _torques)
choose(spec.Label, _label)
