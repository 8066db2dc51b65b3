"""Check that every body and point to which a mechanism refers exists."""

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, RevoluteJoint


def check_references(mechanism: Mechanism) -> None:
    """Check every body and point that joints, drive, springs, loads and assembly name.

    Raises
    ------
    ConfigError
        Names the key of the missing body or point, and the existing ones.
    """
    if GROUND in mechanism.bodies:
        raise ConfigError(
            mechanism.source, "bodies.ground", "is not a moving body, give its points under the key ground"
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
                "is missing, expected: the body's origin and angle, [x, y, angle] [m, m, rad]",
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
                mechanism.source, f"joints.{name}", f"joins {sides[0]!r} to itself, expected two bodies"
            )


def _need_point(mechanism: Mechanism, body: str, point: str, body_key: str, point_key: str) -> None:
    if body != GROUND and body not in mechanism.bodies:
        bodies = ", ".join([GROUND, *mechanism.bodies])
        raise ConfigError(mechanism.source, body_key, f"{body!r} is not a body, expected one of {bodies}")
    if point not in mechanism.points_of(body):
        points = ", ".join(mechanism.points_of(body)) or "none"
        raise ConfigError(
            mechanism.source, point_key, f"body {body!r} has no point {point!r}, its points are: {points}"
        )


def _need_moving(mechanism: Mechanism, body: str, key: str) -> None:
    if body not in mechanism.bodies:
        bodies = ", ".join(mechanism.bodies)
        raise ConfigError(mechanism.source, key, f"{body!r} is not a moving body, expected one of {bodies}")
