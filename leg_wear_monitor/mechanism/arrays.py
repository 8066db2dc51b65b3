"""A mechanism as arrays for the kernels; body 0 is the ground, of infinite mass."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism import spec

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

REVOLUTE, PRISMATIC = 0, 1


class MechanismArrays(NamedTuple):
    """Arrays of a mechanism in SI units; points are relative to the centre of mass, in the body's frame.

    Shapes, with n bodies (ground included), j joints, s springs, l loads and p phases:
    ``mass``, ``inverse_mass`` (n, 3): diagonal of M and of its inverse; ``gravity`` (2,) [m/s^2];
    ``joint_kind`` (j,): `REVOLUTE` or `PRISMATIC`; ``joint_body`` (j, 2): bushing and journal, or guide and
    slider; ``joint_point`` (j, 2, 2) [m] on both; ``joint_normal`` (j, 2): unit normal of a guide;
    ``joint_angle`` (j,): angle of a slider to its guide [rad];
    ``spring_body`` (s, 2), ``spring_point`` (s, 2, 2) [m], ``spring_law`` (s, 3): stiffness [N/m], free
    length [m], damping [N s/m];
    ``load_body`` (l,), ``load_point`` (l, 2) [m], ``load_phase`` (l, p), ``load_force`` (l, p, 2) [N];
    ``drive_body``: index of the crank; for a drive by torque or controller ``drive_gains`` (3,): gain on the
    angle's error [N m/rad], on the speed's error [N m s/rad], largest torque [N m]; ``drive_phase`` (p,) and
    ``drive_feed`` (p,) [N m]: table of its feed-forward torque.
    """

    mass: Floats
    inverse_mass: Floats
    gravity: Floats
    joint_kind: Ints
    joint_body: Ints
    joint_point: Floats
    joint_normal: Floats
    joint_angle: Floats
    spring_body: Ints
    spring_point: Floats
    spring_law: Floats
    load_body: Ints
    load_point: Floats
    load_phase: Floats
    load_force: Floats
    drive_body: int
    drive_gains: Floats
    drive_phase: Floats
    drive_feed: Floats


def body_names(mechanism: spec.Mechanism) -> list[str]:
    """Names of the bodies in the order of the arrays, the ground first."""
    return [spec.GROUND, *mechanism.bodies]


def point_from_com(mechanism: spec.Mechanism, body: str, point: str) -> spec.Vector:
    """Position (2,) [m] of a point relative to its body's centre of mass, in the body's frame."""
    x, y = mechanism.points_of(body)[point]
    if body == spec.GROUND:
        return x, y
    com = mechanism.bodies[body].com
    return x - com[0], y - com[1]


def compile_arrays(mechanism: spec.Mechanism) -> MechanismArrays:
    """Arrays of a mechanism, in the order of its file."""
    index = {name: i for i, name in enumerate(body_names(mechanism))}
    mass = np.zeros((len(index), 3))
    for name, body in mechanism.bodies.items():
        mass[index[name]] = body.mass, body.mass, body.inertia
    inverse_mass = np.divide(1.0, mass, out=np.zeros_like(mass), where=mass > 0.0)

    sides = [mechanism.sides(name) for name in mechanism.joints]
    kind, normal, angle = _joint_shapes(mechanism)
    drive = mechanism.drive
    return MechanismArrays(
        mass=mass,
        inverse_mass=inverse_mass,
        gravity=np.array(mechanism.gravity),
        joint_kind=kind,
        joint_body=np.array([[index[b] for b in pair] for pair in sides], dtype=np.int64).reshape(-1, 2),
        joint_point=np.array(
            [
                [point_from_com(mechanism, body, joint) for body in pair]
                for joint, pair in zip(mechanism.joints, sides, strict=True)
            ]
        ).reshape(-1, 2, 2),
        joint_normal=normal,
        joint_angle=angle,
        **_springs(mechanism, index),
        **_loads(mechanism, index),
        drive_body=index[drive.body],
        **_drive(drive),
    )


def _drive(drive: spec.Drive) -> dict[str, np.ndarray]:
    """Arrays of the drive; a constant torque is a controller without gains, a speed drive needs neither."""
    gains, phase, feed = (0.0, 0.0, np.inf), [0.0], [0.0]
    if isinstance(drive, spec.TorqueDrive):
        feed = [drive.torque]
    elif not isinstance(drive, spec.SpeedDrive):
        track = drive.track
        gains = (track.kp_nm_per_rad, track.kd_nm_s_per_rad, track.max_torque_nm or np.inf)
        phase, feed = list(track.feed_forward_phase), list(track.feed_forward_nm)
    return {
        "drive_gains": np.array(gains),
        "drive_phase": np.array([phase[-1] - 1.0, *phase, phase[0] + 1.0]),
        "drive_feed": np.array([feed[-1], *feed, feed[0]]),
    }


def _joint_shapes(mechanism: spec.Mechanism) -> tuple[Ints, Floats, Floats]:
    """Kind of each joint; for a prismatic one, the guide's unit normal and the relative angle [rad]."""
    kind = np.zeros(len(mechanism.joints), dtype=np.int64)
    normal = np.zeros((len(mechanism.joints), 2))
    angle = np.zeros(len(mechanism.joints))
    poses = {spec.GROUND: (0.0, 0.0, 0.0), **mechanism.assembly.poses}
    for i, joint in enumerate(mechanism.joints.values()):
        if isinstance(joint, spec.PrismaticJoint):
            kind[i] = PRISMATIC
            normal[i] = np.array([-joint.axis[1], joint.axis[0]]) / np.hypot(*joint.axis)
            angle[i] = poses[joint.slider][2] - poses[joint.guide][2]
    return kind, normal, angle


def _springs(mechanism: spec.Mechanism, index: dict[str, int]) -> dict[str, np.ndarray]:
    springs = mechanism.springs.values()
    return {
        "spring_body": np.array([[index[b] for b in s.bodies] for s in springs], dtype=np.int64).reshape(
            -1, 2
        ),
        "spring_point": np.array(
            [
                [point_from_com(mechanism, b, p) for b, p in zip(s.bodies, s.points, strict=True)]
                for s in springs
            ]
        ).reshape(-1, 2, 2),
        "spring_law": np.array([[s.stiffness, s.free_length, s.damping] for s in springs]).reshape(-1, 3),
    }


def _loads(mechanism: spec.Mechanism, index: dict[str, int]) -> dict[str, np.ndarray]:
    """Arrays of the loads: tables over the phase, closed periodically, padded with their last entry."""
    loads = list(mechanism.loads.values())
    length = 2 + max((len(load.phase) for load in loads), default=0)
    phases, forces = np.zeros((len(loads), length)), np.zeros((len(loads), length, 2))
    for i, load in enumerate(loads):
        phase, force = np.array(load.phase), np.array(load.force)
        phases[i] = phase[0] + 1.0
        phases[i, : len(phase) + 1] = phase[-1] - 1.0, *phase
        forces[i] = force[0]
        forces[i, : len(phase) + 1] = force[-1], *force
    points = [point_from_com(mechanism, load.body, load.point) for load in loads]
    return {
        "load_body": np.array([index[load.body] for load in loads], dtype=np.int64),
        "load_point": np.array(points).reshape(-1, 2),
        "load_phase": phases,
        "load_force": forces,
    }


def com_poses(mechanism: spec.Mechanism) -> Floats:
    """Coordinates q (n, 3) of the assembly: centre of mass [m] and angle [rad] of each body, ground 0."""
    q = np.zeros((len(mechanism.bodies) + 1, 3))
    for i, (name, body) in enumerate(mechanism.bodies.items(), start=1):
        x, y, angle = mechanism.assembly.poses[name]
        c, s = np.cos(angle), np.sin(angle)
        q[i] = x + c * body.com[0] - s * body.com[1], y + s * body.com[0] + c * body.com[1], angle
    return q
