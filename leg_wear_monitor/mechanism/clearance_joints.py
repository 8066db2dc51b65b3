"""Settings of the clearance joints of a mechanism file: defaults merged with each joint's own settings."""

from collections.abc import Mapping
from typing import Any

import attrs

from leg_wear_monitor.configuration.quantity import FieldError
from leg_wear_monitor.configuration.strict import choose, shown, structure
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.clearance import Clearance, ClearanceSection, Pair
from leg_wear_monitor.mechanism.materials.loader import load_material
from leg_wear_monitor.mechanism.materials.of_joints import settings_of
from leg_wear_monitor.mechanism.spec import PrismaticJoint, RevoluteJoint

_REQUIRED = {field.name for field in attrs.fields(Clearance) if field.default is attrs.NOTHING}


def clearance_joints(
    section: ClearanceSection, joints: Mapping[str, RevoluteJoint | PrismaticJoint], source: str
) -> tuple[dict[str, Clearance], tuple[str, ...]]:
    """Settings of the revolute joints, and the names of the clearance joints.

    Returns
    -------
    settings : dict of str to Clearance
        For every revolute joint with a complete set of settings.
    names : tuple of str
        The clearance joints.

    Raises
    ------
    ConfigError
        Names the invalid key, among the joint's own settings or among the defaults.
    """
    own = section.joints if isinstance(section.joints, dict) else {name: {} for name in section.joints}
    revolute = [name for name, joint in joints.items() if isinstance(joint, RevoluteJoint)]
    for name in own:
        if name not in revolute:
            what = "is a prismatic joint" if name in joints else "is not a joint"
            raise ConfigError(
                source,
                f"clearances.joints.{name}",
                f"{what}, only a revolute joint can have clearance: {', '.join(revolute)}",
            )
    # complete defaults also apply to joints that only the command line names
    named = revolute if set(section.defaults) >= _REQUIRED or (section.defaults and not own) else own
    settings = {
        name: _settings(section.defaults, own.get(name, {}), source, name)
        for name in revolute
        if name in named
    }
    return settings, tuple(own)


def _settings(defaults: dict[str, Any], own: Any, source: str, name: str) -> Clearance:
    """Settings of one joint; an error names the place of the key in the file."""
    place = f"clearances.joints.{name}"
    own = structure({} if own is None else own, dict[str, Any], source, place)
    merged: dict[str, Any] = {}
    # a pair named in the defaults, then their values; a pair of the joint's own, then its values
    for given, where in ((defaults, "clearances.defaults"), (own, place)):
        merged = _over(_over(merged, _of_pair(given, source, where)), given)
    try:
        settings: Clearance = structure(merged, Clearance, source, "")
    except ConfigError as error:
        key = error.key.split(".")[0]
        if key in defaults and key not in own:
            place = "clearances.defaults"
        raise ConfigError(source, f"{place}.{error.key}", error.fault) from error
    return settings


def _of_pair(given: dict[str, Any], source: str, place: str) -> dict[str, Any]:
    """Settings that come from the material pair named here, as the file would have them; none without."""
    if "material" not in given:
        return {}
    name = structure(given["material"], str, source, f"{place}.material")
    try:
        return settings_of(load_material(name))
    except ConfigError as error:
        raise ConfigError(source, f"{place}.material", str(error)) from error


def _over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Settings with others over them, key by key, also inside ``friction``."""
    merged = below | above
    if isinstance(below.get("friction"), dict) and isinstance(above.get("friction"), dict):
        merged["friction"] = below["friction"] | above["friction"]
    return merged


def _list_or_mapping(value: Any) -> tuple[Any, Any]:
    if isinstance(value, list) and any(value.count(name) > 1 for name in value):
        raise FieldError("", f"{shown(value)} names a joint twice")
    if not isinstance(value, list | dict):
        raise FieldError("", f"{shown(value)} is not a list of names, nor a mapping of names to settings")
    return (tuple[str, ...] if isinstance(value, list) else dict[str, Any]), value


choose(tuple[str, ...] | dict[str, Any], _list_or_mapping)
choose(Pair, lambda value: (tuple[float, float], value if isinstance(value, list) else [value, value]))
