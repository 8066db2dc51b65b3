"""Reading of mechanism files: YAML into checked types; summary; values that are likely in a wrong unit."""

import math
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration import Doubt, FieldError
from leg_wear_monitor.configuration import doubts as unusual
from leg_wear_monitor.configuration.strict import choose, mapping, read_document, shown, structure
from leg_wear_monitor.errors import ConfigError, did_you_mean
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism import spec
from leg_wear_monitor.mechanism.materials import load_material, regimes, settings_of, spread_of
from leg_wear_monitor.mechanism.position import TURN, Linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import (
    GROUND,
    Clearance,
    ClearanceSection,
    Mechanism,
    Pair,
    PrismaticJoint,
    RevoluteJoint,
    TorqueDrive,
)

# Doubtful values: valid, but far outside the usual range, likely in a wrong unit.
#
# Values that are unusual by themselves are declared with their bounds. Here are checks of values that are
# unusual in relation to other values. The ranges are wide: the shipped mechanisms, from Andrews' squeezer
# with links of 7 mm to a leg, lie well within.

_USUAL_LENGTH = 5.0e-3, 5.0  # length of the largest link [m]
# least spread of ln k: repeats of one careful test scatter by 0.1 to 0.3, different parts by more
_LEAST_SPREAD = 0.3
# a speed in rad/s that was converted from rpm is within this distance of a whole number of rpm
_ROUND = 1.0e-3


def doubts(mechanism: spec.Mechanism) -> tuple[Doubt, ...]:
    """All doubtful values of a mechanism, the most significant first."""
    parts = (_lengths, _angles, _speed, _masses, _gravity, _joints, _loads)
    return tuple(doubt for part in parts for doubt in part(mechanism))


def suspects(mechanism: spec.Mechanism) -> str:
    """End of an error message about a mechanism that cannot move: its doubtful values; empty without any."""
    found = [str(doubt) for doubt in doubts(mechanism)]
    return f"; look at {'; '.join(found)}" if found else ""


def span(points: dict[str, spec.Vector]) -> float:
    """Longest distance between two points [m], 0 without two."""
    return max((math.dist(a, b) for a in points.values() for b in points.values()), default=0.0)


def largest_link(mechanism: spec.Mechanism) -> tuple[str, float]:
    """The body with the longest distance between two of its points, and that distance [m]."""
    spans = {name: span(body.points) for name, body in mechanism.bodies.items()}
    name = max(spans, key=lambda body: spans[body])
    return name, spans[name]


def _beyond(value: float, least: float, most: float) -> bool:
    return not least <= abs(value) <= most


def _lengths(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    name, length = largest_link(mechanism)
    if _beyond(length, *_USUAL_LENGTH):
        slip = "mm" if length > 5.0 else "km"
        yield Doubt(
            f"bodies.{name}.points",
            f"{length:g} m from point to point, usually 0.005 to 5 m. Is it in {slip}?",
        )
        return
    for name, body in mechanism.bodies.items():
        away = math.hypot(*body.com)
        if away > 20.0 * max(span(body.points), 0.05 * length):
            yield Doubt(
                f"bodies.{name}.com", f"{away:g} m away from a link that is much shorter. Is it in mm?"
            )


def _angles(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    angles = {"crank_angle": mechanism.assembly.crank_angle}
    angles |= {body: pose[2] for body, pose in mechanism.assembly.poses.items()}
    name = max(angles, key=lambda each: abs(angles[each]))  # if one angle is in degrees, all angles are
    if _beyond(angles[name], 0.0, TURN):
        turns = angles[name] / TURN
        yield Doubt(f"assembly.{name}", f"{angles[name]:g} rad is {turns:.3g} turns. Is it in degrees?")


def _speed(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    drive = mechanism.drive
    if isinstance(drive, spec.TorqueDrive):
        yield from unusual(drive, "drive.")
        return
    key = "drive.speed" if isinstance(drive, spec.SpeedDrive) else "drive.track.speed_radps"
    speed = drive.speed
    rpm = 60.0 * speed / TURN
    # a speed that was converted is a whole number of rpm; one that is a whole number of rad/s may be rpm
    if _beyond(speed, 0.0, 20.0) and speed == round(speed) and abs(rpm - round(rpm)) > _ROUND:
        meant = f"{speed:g} rpm is {speed * TURN / 60.0:.6g} rad/s"
        yield Doubt(key, f"{speed:g} rad/s is {rpm:.4g} rpm. Is it in rpm? {meant}")
    elif _beyond(rpm, 0.1, 30_000.0):
        yield Doubt(key, f"{speed:g} rad/s is {rpm:.3g} rpm, usually 0.1 to 30000 rpm")


def _masses(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    heaviest = max(mechanism.bodies, key=lambda name: mechanism.bodies[name].mass)
    yield from unusual(mechanism.bodies[heaviest], f"bodies.{heaviest}.")
    length = largest_link(mechanism)[1]
    if not _beyond(length, *_USUAL_LENGTH):
        each = (doubt for name, body in mechanism.bodies.items() for doubt in _inertia(name, body, length))
        yield from islice(each, 1)


def _inertia(name: str, body: spec.Body, length: float) -> Iterator[Doubt]:
    """Doubt about an inertia with a radius of gyration above 10 or below 0.001 times the largest link."""
    gyration = math.sqrt(body.inertia / body.mass)
    if _beyond(gyration, 1.0e-3 * length, 10.0 * length):
        slip = "kg mm^2" if gyration > length else "t m^2"
        yield Doubt(
            f"bodies.{name}.inertia",
            f"{body.inertia:g} kg m^2 of {body.mass:g} kg is a radius of gyration of {gyration:.3g} m with "
            f"links of {length:.3g} m. Is it in {slip}?",
        )


def _gravity(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    pull = math.hypot(*mechanism.gravity)
    if pull > 30.0:
        yield Doubt("gravity", f"{pull:g} m/s^2, but on earth it is 9.81 m/s^2. Is it in mm/s^2?")


def _joints(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    """Doubts about clearance settings, each with all joints concerned: most come from the defaults."""
    concerned: dict[Doubt, list[str]] = {}
    for joint, clearance in mechanism.clearances.items():
        for doubt in _clearance(clearance):
            concerned.setdefault(doubt, []).append(joint)
    for doubt, joints in concerned.items():
        yield attrs.evolve(doubt, key=f"clearances ({', '.join(joints)}): {doubt.key}")


def _clearance(c: spec.Clearance) -> Iterator[Doubt]:
    yield from unusual(c)
    if fault := ratio_fault(c.radial_clearance, c.bushing_radius):
        yield Doubt("radial_clearance", fault)
    spread = spread_of(c, math.inf)
    if spread is not None and spread < _LEAST_SPREAD:
        fault = f"spread {spread:.2g} of {c.material} is below {_LEAST_SPREAD}. Is it from repeats?"
        yield Doubt("material", fault)


def ratio_fault(clearance_m: float, radius_m: float) -> str | None:
    """Doubt about a radial clearance [m] relative to its bushing's radius [m]; None if it is usual."""
    ratio = clearance_m / radius_m
    if not _beyond(ratio, 1.0e-5, 0.25):
        return None
    return (
        f"{clearance_m:g} m is {100.0 * ratio:.3g} % of the bushing's radius of {radius_m:g} m, "
        "usually 0.01 to 5 %. Is it in a different unit than the radius?"
    )


def _loads(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    for name, load in mechanism.loads.items():
        force = max(math.hypot(*each) for each in load.force)
        if force > 1.0e5:
            yield Doubt(f"loads.{name}.force", f"{force:g} N, usually below 1e5 N. Is it in mN?")


# Valid ranges of clearances and their limits, with a hint at the likely wrong unit of an invalid value.


LEAST_FRACTION = 0.01  # least measured clearance over the new one: wear widens it, so less is a typing error
LEAST_SIGMA_M = 1.0e-7  # least standard deviation: no clearance gauge resolves 0.1 um

_SLIPS = (1.0e-3, 1.0e3, 1.0e-6, 1.0e6)  # factors of wrong units: mm for m, m for mm, um for m, m for um


def limit_fault(joint: str, fresh_m: float, radius_m: float, limit_m: float) -> str | None:
    """Error message for an invalid limit of a joint's mean radial clearance.

    Parameters
    ----------
    joint : str
    fresh_m, radius_m : float
        Clearance when new and radius of the bushing: the limit must lie between them.
    limit_m : float

    Returns
    -------
    str or None
        None if the limit is valid.
    """
    if fresh_m < limit_m < radius_m:
        return None
    meant = _meant(limit_m, fresh_m, radius_m)
    hint = "" if meant is None else f"; did you mean {meant:g} m ({1.0e3 * meant:g} mm)?"
    return (
        f"{limit_m:g} m is not between {fresh_m:g} m, the new clearance of joint {joint}, "
        f"and {radius_m:g} m, the radius of its bushing{hint}"
    )


def measured_fault(joint: str, fresh_m: float, radius_m: float, measured_m: float) -> str | None:
    """Error message for an invalid measured radial clearance [m]; otherwise as `limit_fault`."""
    least_m = LEAST_FRACTION * fresh_m
    if least_m <= measured_m <= radius_m:
        return None
    meant = _meant(measured_m, least_m, radius_m)
    hint = "" if meant is None else f"; did you mean {1.0e3 * meant:g} mm?"
    return (
        f"{1.0e3 * measured_m:g} mm is not between {1.0e3 * least_m:g} mm, {100.0 * LEAST_FRACTION:g} % of "
        f"the new clearance of joint {joint}, and {1.0e3 * radius_m:g} mm, the radius of its bushing{hint}"
    )


def sigma_fault(measured_m: float, sigma_m: float) -> str | None:
    """Error message for an invalid standard deviation [m] of a measured clearance; None if it is valid."""
    if LEAST_SIGMA_M <= sigma_m <= measured_m:
        return None
    meant = _meant(sigma_m, LEAST_SIGMA_M, measured_m)
    hint = "" if meant is None else f"; did you mean {1.0e3 * meant:g} mm?"
    bounds = f"from {1.0e3 * LEAST_SIGMA_M:g} mm to {1.0e3 * measured_m:g} mm, the measured clearance"
    return f"{1.0e3 * sigma_m:g} mm is not a standard deviation {bounds}{hint}"


def _meant(value_m: float, above_m: float, below_m: float) -> float | None:
    """The value [m] after a unit mistake is undone, if it lies between the bounds; None if none does."""
    return next((value_m * slip for slip in _SLIPS if above_m < value_m * slip < below_m), None)


# Check that every body and point named in a mechanism exists.


def check_references(mechanism: Mechanism) -> None:
    """Check every body and point that joints, drive, springs, loads and assembly name.

    Raises
    ------
    ConfigError
        Names the key of the missing body or point, and the existing ones.
    """
    if GROUND in mechanism.bodies:
        raise ConfigError(
            mechanism.source, "bodies.ground", "is not a moving body. Give its points under the key ground"
        )
    _check_joints(mechanism)
    _need_moving(mechanism, mechanism.drive.body, "drive.body")
    for name, spring in mechanism.springs.items():
        for body, point in zip(spring.bodies, spring.points, strict=True):
            _need_point(mechanism, body, point, f"springs.{name}.bodies", f"springs.{name}.points")
    for name, load in mechanism.loads.items():
        _need_point(mechanism, load.body, load.point, f"loads.{name}.body", f"loads.{name}.point")
    for body in mechanism.assembly.poses:
        _need_moving(mechanism, body, f"assembly.{body}")
    for body in mechanism.bodies:
        if body not in mechanism.assembly.poses:
            raise ConfigError(
                mechanism.source,
                f"assembly.{body}",
                "is missing. Expected: the body's origin and angle, [x, y, angle] [m, m, rad]",
            )


def _check_joints(mechanism: Mechanism) -> None:
    for name, joint in mechanism.joints.items():
        roles = ("bushing", "journal") if isinstance(joint, RevoluteJoint) else ("guide", "slider")
        sides = mechanism.sides(name)
        for role, body in zip(roles, sides, strict=True):
            key = f"joints.{name}.{role}"
            _need_point(mechanism, body, name, key, key)
        if sides[0] == sides[1]:
            raise ConfigError(
                mechanism.source, f"joints.{name}", f"joins {sides[0]!r} to itself. Expected two bodies"
            )


def _need_point(mechanism: Mechanism, body: str, point: str, body_key: str, point_key: str) -> None:
    if body != GROUND and body not in mechanism.bodies:
        bodies = ", ".join([GROUND, *mechanism.bodies])
        raise ConfigError(mechanism.source, body_key, f"{body!r} is not a body. Expected one of {bodies}")
    if point not in mechanism.points_of(body):
        points = ", ".join(mechanism.points_of(body)) or "none"
        raise ConfigError(
            mechanism.source, point_key, f"body {body!r} has no point {point!r}; its points are: {points}"
        )


def _need_moving(mechanism: Mechanism, body: str, key: str) -> None:
    if body not in mechanism.bodies:
        bodies = ", ".join(mechanism.bodies)
        raise ConfigError(mechanism.source, key, f"{body!r} is not a moving body. Expected one of {bodies}")


# Summary of a mechanism in everyday units, so that a wrong unit is obvious.


_POINTS = 180  # crank steps per turn: enough for a stride with an error of 0.1 %


def understood(linkage: Linkage) -> tuple[str, ...]:
    """Statements on the size, mass, drive, stride and clearances of a mechanism, with units."""
    return tuple(_statements(linkage))


def _statements(linkage: Linkage) -> Iterator[str]:
    mechanism = linkage.mechanism
    link, length = largest_link(mechanism)
    yield f"largest link {length:.4g} m ({link})"
    body = max(mechanism.bodies, key=lambda name: mechanism.bodies[name].mass)
    yield f"heaviest mass {mechanism.bodies[body].mass:.4g} kg ({body})"
    yield _drive(mechanism)
    if mechanism.toe is not None:
        x, y = point_motion(one_cycle(linkage, _POINTS, 1.0), linkage, *mechanism.toe)[0].T
        yield f"toe's stride {np.ptp(x):.4g} m, lift {np.ptp(y):.4g} m"
    yield from _clearances(mechanism)


def _drive(mechanism: Mechanism) -> str:
    drive = mechanism.drive
    if isinstance(drive, TorqueDrive):
        return f"crank driven by {drive.torque:.4g} N m"
    sense = "counter-clockwise" if drive.speed > 0.0 else "clockwise"
    return f"crank {60.0 * abs(drive.speed) / TURN:.4g} rpm {sense}"


def _clearances(mechanism: Mechanism) -> Iterator[str]:
    """Young's moduli and clearances of the clearance joints, each value once."""
    clearance_joints = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    moduli = sorted({modulus for c in clearance_joints for modulus in c.youngs_modulus})
    if moduli:
        yield "E " + " and ".join(f"{1.0e-9 * modulus:.4g}" for modulus in moduli) + " GPa"
    for pair, names in regimes(mechanism, mechanism.clearance_joints).items():
        yield f"material of {', '.join(names)}: {pair}"
    for fresh, radius in sorted({(c.radial_clearance, c.bushing_radius) for c in clearance_joints}):
        ratio = 100.0 * fresh / radius
        yield f"clearance {1.0e3 * fresh:.4g} mm in a radius of {1.0e3 * radius:.4g} mm ({ratio:.2g} %)"


# Settings of the clearance joints of a mechanism file: defaults merged with each joint's own settings.


_REQUIRED = {field.name for field in attrs.fields(Clearance) if field.default is attrs.NOTHING}


def clearance_joints(
    section: ClearanceSection, joints: Mapping[str, RevoluteJoint | PrismaticJoint], source: str
) -> tuple[dict[str, Clearance], tuple[str, ...]]:
    """Settings of the revolute joints, and the names of the clearance joints.

    Returns
    -------
    settings : dict of str to Clearance
        Settings of every revolute joint with a complete set of settings.
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
                f"{what}. Only revolute joints can have clearance: {', '.join(revolute)}",
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
        of_pair = _of_pair(given, source, where)
        if given is own or "material" not in own:  # skip the default pair if the joint has one
            merged = _over(merged, of_pair)
        merged = _over(merged, given)
    if "material" in merged and merged["wear_coefficient"] is None:
        place = place if "material" in own else "clearances.defaults"
        fault = (
            f"is missing: {merged['material']} gives none of both bodies. Expected one next to the material"
        )
        raise ConfigError(source, f"{place}.wear_coefficient", f"{fault} [1/Pa], or 0 for no wear")
    try:
        return structure(merged, Clearance, source, "")
    except ConfigError as error:
        key = error.key.split(".")[0]
        if key in defaults and key not in own:
            place = "clearances.defaults"
        raise ConfigError(source, f"{place}.{error.key}", error.fault) from error


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
    """Merge two sets of settings key by key, also inside ``friction``; the second set takes precedence."""
    merged = below | above
    if isinstance(below.get("friction"), dict) and isinstance(above.get("friction"), dict):
        merged["friction"] = below["friction"] | above["friction"]
    return merged


def _list_or_mapping(value: Any) -> tuple[Any, Any]:
    if isinstance(value, list) and any(value.count(name) > 1 for name in value):
        raise FieldError("", f"{shown(value)} names a joint twice")
    if not isinstance(value, list | dict):
        raise FieldError("", f"{shown(value)} is neither a list of names nor a mapping of names to settings")
    return (tuple[str, ...] if isinstance(value, list) else dict[str, Any]), value


choose(tuple[str, ...] | dict[str, Any], _list_or_mapping)
choose(Pair, lambda value: (tuple[float, float], value if isinstance(value, list) else [value, value]))


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
    """True if an argument is a path (has a suffix or a directory) instead of a shipped mechanism's name."""
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
        Names file, key, value and the expected value.

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
        try:
            document = read_yaml(path, str(path))
        except ConfigError as error:
            if path.is_absolute() or path.exists():
                raise
            fault = f"{error.fault}; the mechanism's path starts at {Path.cwd()}"
            raise ConfigError(error.source, error.key, fault) from error
        return parse_mechanism(document, str(path))
    shipped = shipped_mechanisms()
    if path.name not in shipped:
        raise ConfigError(
            str(name_or_path),
            "",
            f"no mechanism of this name. Expected a file such as ./leg.yaml or one of {', '.join(shipped)}"
            + did_you_mean(path.name, shipped),
        )
    path = shipped[path.name]
    return parse_mechanism(read_yaml(path, path.name), path.name)


def parse_mechanism(document: Any, source: str) -> spec.Mechanism:
    """A mechanism from the contents of a YAML file, a plain mapping; see `load_mechanism`."""
    file: Any = structure(document, _File, source, "")
    values = {key: getattr(file, key) for key in _KEYS}
    values["clearances"], values["clearance_joints"] = clearance_joints(file.clearances, file.joints, source)
    mechanism = spec.Mechanism(**values, source=source)
    check_references(mechanism)
    return mechanism


def read_yaml(path: Path, source: str) -> Any:
    """Contents of a YAML 1.2 file as plain values; see `configuration.strict.read_document`."""
    try:
        return read_document(path, source)
    except FileNotFoundError as error:
        hint = f"; {path.stem} without .yaml is the one that comes with the package"
        known = path.parent == Path() and path.stem in shipped_mechanisms()
        raise ConfigError(source, "", f"cannot be read: {error.strerror}{hint if known else ''}") from error


# --- entries that have one of several classes ---


def _joint_class(entry: Any) -> tuple[type, Any]:
    kind = mapping(entry).get("kind", "revolute")
    for name, joint in (("revolute", spec.RevoluteJoint), ("prismatic", spec.PrismaticJoint)):
        if kind == name:
            return joint, entry
    raise FieldError("kind", f"{shown(kind)} is not one of revolute, prismatic")


_DRIVES = {"speed": spec.SpeedDrive, "torque": spec.TorqueDrive, "track": spec.TrackDrive}


def _drive_class(entry: Any) -> tuple[type, Any]:
    given = [key for key in _DRIVES if key in mapping(entry)]
    if len(given) != 1:
        raise FieldError(
            "",
            f"has {' and '.join(given) or 'none of them'}. "
            "Expected one of speed [rad/s], torque [N m], track",
        )
    return _DRIVES[given[0]], entry


def _torques(entry: Any) -> tuple[Any, Any]:
    return tuple[float, ...], entry if isinstance(entry, list) else [entry]


def _forces(entry: Any) -> tuple[Any, Any]:
    is_one = isinstance(entry, list) and not any(isinstance(each, list) for each in entry)
    return tuple[spec.Vector, ...], [entry] if is_one else entry


def _label(entry: Any) -> tuple[Any, Any]:
    if entry is None or entry == "":
        raise FieldError("", "is empty. Expected a name such as knee, or no label")
    return str, entry


choose(spec.RevoluteJoint | spec.PrismaticJoint, _joint_class)
choose(spec.Forces, _forces)
choose(spec.Drive, _drive_class)
choose(spec.Torques, _torques)
choose(spec.Label, _label)
