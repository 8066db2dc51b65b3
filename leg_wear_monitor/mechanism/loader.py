"""A mechanism file read, checked and turned into types."""

import math
from pathlib import Path
from typing import Any

import attrs
import cattrs
from cattrs.errors import ClassValidationError, ForbiddenExtraKeysError, IterableValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism import spec
from leg_wear_monitor.share import share_directory

_TOP_KEYS = {
    "name", "gravity", "ground", "bodies", "joints", "drive", "assembly", "springs", "loads", "clearances",
}  # fmt: skip
_REQUIRED = ("name", "gravity", "ground", "bodies", "joints", "drive", "assembly")


def mechanism_path(name_or_path: str | Path) -> Path:
    """File of a mechanism: a path, or the name of one that comes with the package."""
    path = Path(name_or_path)
    if path.suffix or path.parent != Path():
        return path
    return share_directory() / "config" / "mechanisms" / f"{name_or_path}.yaml"


def load_mechanism(name_or_path: str | Path = "bionic_leg") -> spec.Mechanism:
    """Read a mechanism from YAML and check all that can be checked without moving it.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        A path, or the name of a mechanism that comes with the package.

    Raises
    ------
    ConfigError
        Naming file, key, value and what was expected.
    """
    path = mechanism_path(name_or_path)
    return parse_mechanism(_read_yaml(path), path.name)


def parse_mechanism(document: Any, source: str) -> spec.Mechanism:
    """Types from the plain mapping that a YAML file holds; see `load_mechanism`."""
    if not isinstance(document, dict):
        raise ConfigError(source, "", f"holds {_shown(document)}, expected a mapping of keys")
    unknown = [key for key in document if key not in _TOP_KEYS]
    if unknown:
        raise ConfigError(
            source, str(unknown[0]), f"unknown key, expected one of {', '.join(sorted(_TOP_KEYS))}"
        )
    for key in _REQUIRED:
        if key not in document:
            raise ConfigError(source, key, "is missing")
    clearances, loose = _clearances(document.get("clearances", {}), document["joints"], source)
    mechanism = spec.Mechanism(
        name=_structure(document["name"], str, source, "name"),
        gravity=_structure(document["gravity"], spec.Vector, source, "gravity"),
        ground=_structure(document["ground"], spec.Ground, source, "ground"),
        bodies=_structure(document["bodies"], dict[str, spec.Body], source, "bodies"),
        joints=_variants(document["joints"], _joint_type, source, "joints"),
        drive=_structure(document["drive"], _drive_type(document["drive"], source), source, "drive"),
        assembly=_assembly(document["assembly"], source),
        springs=_structure(document.get("springs", {}), dict[str, spec.Spring], source, "springs"),
        loads=_variants(document.get("loads", {}), _load_type, source, "loads"),
        clearances=clearances,
        loose=loose,
        source=source,
    )
    _check_references(mechanism)
    return mechanism


def _read_yaml(path: Path) -> Any:
    try:
        return YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "", f"is not UTF-8 text: byte {error.start}") from error
    except MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise ConfigError(
            path.name, "", f"is not YAML: {line}{(error.problem or '').splitlines()[0]}"
        ) from error
    except YAMLError as error:
        raise ConfigError(path.name, "", f"is not YAML: {str(error).splitlines()[0]}") from error


# --- cattrs, made strict: a number is a number, a text a text, an unknown key an error ---


def _shown(value: Any) -> str:
    return "nothing" if value is None else repr(value)


def _number(value: Any, _type: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{_shown(value)} is not a number")
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    return float(value)


def _text(value: Any, _type: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{_shown(value)} is not a text")
    return value


def _numbers(length: int) -> Any:
    def structure(value: Any, _type: Any) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != length:
            raise TypeError(f"{_shown(value)} is not a list of {length} numbers")
        return tuple(_number(item, float) for item in value)

    return structure


def _pair_or_both(value: Any) -> Any:
    """One number stands for bushing and journal alike."""
    return [value, value] if isinstance(value, int | float) and not isinstance(value, bool) else value


_converter = cattrs.Converter(forbid_extra_keys=True, detailed_validation=True)
_converter.register_structure_hook(float, _number)
_converter.register_structure_hook(str, _text)
_converter.register_structure_hook_func(lambda kind: kind == spec.Vector, _numbers(2))
_converter.register_structure_hook_func(lambda kind: kind == spec.Pose, _numbers(3))
_converter.register_structure_hook(
    float | None, lambda value, _type: None if value is None else _number(value, float)
)


def _structure(value: Any, kind: Any, source: str, key: str) -> Any:
    try:
        if not isinstance(value, dict) and (attrs.has(kind) or getattr(kind, "__origin__", None) is dict):
            raise TypeError(f"{_shown(value)} is not a mapping of keys")
        return _converter.structure(value, kind)
    except (cattrs.BaseValidationError, ForbiddenExtraKeysError, TypeError, ValueError, KeyError) as error:
        path, fault = _first_fault(error)
        raise ConfigError(source, ".".join([key, *path]), fault) from error


def _first_fault(error: BaseException) -> tuple[list[str], str]:
    """Path below the structured value, and the text, of the first thing that is wrong."""
    if isinstance(error, ClassValidationError | IterableValidationError):
        with_notes = error.group_exceptions()[0]
        if not with_notes:
            return _first_fault(error.group_exceptions()[1][0])
        inner, note = with_notes[0]
        step = note.name if isinstance(error, ClassValidationError) else note.index
        path, fault = _first_fault(inner)
        return [str(step), *path], fault
    if isinstance(error, ForbiddenExtraKeysError):
        expected = ", ".join(attribute.name for attribute in attrs.fields(error.cl))
        return [sorted(error.extra_fields)[0]], f"unknown key, expected one of {expected}"
    if isinstance(error, KeyError):
        return [str(error.args[0])], "is missing"
    return [], str(error)


def _entry(mapping: Any, source: str, key: str) -> dict[str, Any]:
    if not isinstance(mapping, dict):
        raise ConfigError(source, key, f"{_shown(mapping)} is not a mapping of keys")
    return mapping


def _variants(mapping: Any, type_of: Any, source: str, key: str) -> dict[str, Any]:
    """Structure each entry as the one of several classes that its keys ask for."""
    return {
        str(name): _structure(entry, type_of(entry, source, f"{key}.{name}"), source, f"{key}.{name}")
        for name, entry in _entry(mapping, source, key).items()
    }


def _joint_type(entry: Any, source: str, key: str) -> type:
    kind = _entry(entry, source, key).get("kind", "revolute")
    kinds: dict[Any, type] = {"revolute": spec.RevoluteJoint, "prismatic": spec.PrismaticJoint}
    if kind not in kinds:
        raise ConfigError(source, f"{key}.kind", f"{kind!r} is not one of {', '.join(kinds)}")
    return kinds[kind]


def _load_type(entry: Any, source: str, key: str) -> type:
    return spec.PhaseLoad if "phase" in _entry(entry, source, key) else spec.ConstantLoad


def _drive_type(entry: Any, source: str) -> type:
    given = [key for key in ("speed", "torque") if key in _entry(entry, source, "drive")]
    if len(given) != 1:
        raise ConfigError(
            source, "drive", f"has {' and '.join(given) or 'neither'}, expected one of speed, torque"
        )
    return spec.SpeedDrive if given == ["speed"] else spec.TorqueDrive


def _assembly(entry: Any, source: str) -> spec.Assembly:
    poses = dict(_entry(entry, source, "assembly"))
    if "crank_angle" not in poses:
        raise ConfigError(source, "assembly.crank_angle", "is missing")
    angle = _structure(poses.pop("crank_angle"), float, source, "assembly.crank_angle")
    return spec.Assembly(crank_angle=angle, poses=_structure(poses, dict[str, spec.Pose], source, "assembly"))


def _clearances(section: Any, joints: Any, source: str) -> tuple[dict[str, spec.Clearance], tuple[str, ...]]:
    """Defaults merged with each joint's own settings, for every revolute joint that has a full set."""
    section = _entry(section, source, "clearances")
    for key in section:
        if key not in ("defaults", "joints"):
            raise ConfigError(source, f"clearances.{key}", "unknown key, expected one of defaults, joints")
    defaults = _entry(section.get("defaults", {}), source, "clearances.defaults")
    listed = section.get("joints", [])
    own = (
        {str(name): {} for name in listed}
        if isinstance(listed, list)
        else _entry(listed, source, "clearances.joints")
    )
    revolute = [
        str(name)
        for name, joint in _entry(joints, source, "joints").items()
        if isinstance(joint, dict) and joint.get("kind", "revolute") == "revolute"
    ]
    for name in own:
        if name not in revolute:
            raise ConfigError(
                source,
                f"clearances.joints.{name}",
                f"is no revolute joint, expected one of {', '.join(revolute)}",
            )
    result = {}
    for name in revolute:
        key = f"clearances.joints.{name}" if own.get(name) else "clearances.defaults"
        if name in own or defaults:
            merged = {**defaults, **_entry(own.get(name) or {}, source, key)}
            for pair in ("youngs_modulus", "poissons_ratio", "wear_coefficient"):
                if pair in merged:
                    merged[pair] = _pair_or_both(merged[pair])
            result[name] = _structure(merged, spec.Clearance, source, key)
    return result, tuple(own)


def _check_references(mechanism: spec.Mechanism) -> None:
    """Every body and point that is spoken of is there."""
    source = mechanism.source
    known = [spec.GROUND, *mechanism.bodies]

    def need_body(body: str, key: str) -> None:
        if body not in known:
            raise ConfigError(source, key, f"{body!r} is not a body, expected one of {', '.join(known)}")

    def need_point(body: str, point: str, key: str) -> None:
        need_body(body, key)
        if point not in mechanism.points_of(body):
            raise ConfigError(
                source, key, f"point {point!r} is not on body {body!r}, expected one of "
                f"{', '.join(mechanism.points_of(body)) or 'no points'}"
            )  # fmt: skip

    if spec.GROUND in mechanism.bodies:
        raise ConfigError(
            source, "bodies.ground", "the ground is not a moving body; give it under the key ground"
        )
    for name, joint in mechanism.joints.items():
        roles = ("bushing", "journal") if isinstance(joint, spec.RevoluteJoint) else ("guide", "slider")
        for role, body in zip(roles, mechanism.sides(name), strict=True):
            need_point(body, name, f"joints.{name}.{role}")
        if len(set(mechanism.sides(name))) == 1:
            raise ConfigError(source, f"joints.{name}", f"joins body {mechanism.sides(name)[0]!r} to itself")
    if mechanism.drive.body not in mechanism.bodies:
        expected = ", ".join(mechanism.bodies)
        raise ConfigError(
            source, "drive.body", f"{mechanism.drive.body!r} is not a moving body, expected one of {expected}"
        )
    for name, spring in mechanism.springs.items():
        for body, point in zip(spring.bodies, spring.points, strict=True):
            need_point(body, point, f"springs.{name}")
    for name, load in mechanism.loads.items():
        need_point(load.body, load.point, f"loads.{name}")
    for body in mechanism.assembly.poses:
        if body not in mechanism.bodies:
            raise ConfigError(
                source, f"assembly.{body}", f"is not a moving body, expected one of {', '.join(known[1:])}"
            )
    for body in mechanism.bodies:
        if body not in mechanism.assembly.poses:
            raise ConfigError(
                source, f"assembly.{body}", "is missing: each body's origin (x, y) [m] and angle [rad]"
            )
