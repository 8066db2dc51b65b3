"""Types of a mechanism file: every key with its unit, bounds and meaning."""

from itertools import pairwise
from typing import Annotated, Any, Literal

import attrs

from leg_wear_monitor.configuration import USUAL, FieldError, choice, described, quantity
from leg_wear_monitor.errors import ConfigError, did_you_mean
from leg_wear_monitor.mechanism import FRICTION_LAWS, NORMAL_LAWS

# Settings of a revolute clearance joint: geometry, material, contact laws and wear.


Pair = Annotated[tuple[float, float], "bushing, journal"]  # in a file, one number applies to both


def _rises(ramp: tuple[float, float]) -> str | None:
    if ramp[0] <= ramp[1] and ramp[1] > 0.0:
        return None
    return f"{list(ramp)} m/s: the second speed is not above the first and above 0 m/s"


@attrs.frozen(kw_only=True)
class Friction:
    """Coulomb friction with a ramp around zero slip speed."""

    law: str = choice(FRICTION_LAWS, "shape of the friction over the slip speed", default="ambrosio")
    coefficient: float = quantity("", "friction coefficient", within=(0.0, 2.0), default=0.0)
    ramp: tuple[float, float] = quantity(
        "m/s",
        "slip speeds at which friction begins and is complete",
        at_least=0.0,
        default=(0.001, 0.01),
        check=_rises,
    )


def _length_slip(metres: float) -> str:
    return f"{USUAL}. Is it in {'mm' if metres > 1.0e-3 else 'km'}?"


def _modulus_slip(modulus: float) -> str:
    meant = "GPa" if modulus < 1.0e4 else "MPa" if modulus < 1.0e6 else "kPa"
    return f"{USUAL}; steel has 2.1e11 Pa. Is it in {meant}?"


USUAL_WEAR = 0.0, 1.0e-9  # 1/Pa
WEAR_SLIP = f"{USUAL}. Is it K instead of K/H, or in 1/MPa or mm^3/(N m)? 1 mm^3/(N m) is 1e-9 1/Pa"


@attrs.frozen(kw_only=True)
class Clearance:
    """Settings of a revolute clearance joint; pairs are (bushing, journal)."""

    bushing_radius: float = quantity(
        "m", "radius of the bushing", above=0.0, at_most=1.0, usual=(1.0e-4, 0.25), doubt=_length_slip
    )
    width: float = quantity(
        "m", "axial contact width", above=0.0, at_most=1.0, usual=(1.0e-4, 0.5), doubt=_length_slip
    )
    radial_clearance: float = quantity("m", "bushing radius minus journal radius", above=0.0)
    youngs_modulus: Pair = quantity(
        "Pa", "Young's modulus", above=0.0, usual=(1.0e6, 2.0e12), doubt=_modulus_slip
    )
    poissons_ratio: Pair = quantity("", "Poisson's ratio", within=(0.0, 0.5))
    normal_law: str = choice(NORMAL_LAWS, "law of the normal force", default="lankarani-nikravesh")
    # The loss grows as 1/restitution. A smaller restitution is beyond the tolerance of steps in clearance
    # coordinates: mean forces are right at 0.02, up to 4 % low at 0.01, and up to 21 % low at 0.003
    # (physics.md section 4).
    restitution: float = quantity("", "coefficient of restitution", within=(0.02, 1.0), default=0.9)
    friction: Friction = described("friction, a mapping of the keys below", default=Friction())
    wear_coefficient: Pair = quantity(
        "1/Pa",
        "K/H of Archard's law",
        at_least=0.0,
        usual=USUAL_WEAR,
        doubt=WEAR_SLIP,
        default=(0.0, 0.0),
    )
    stiffness: float | None = quantity(
        "N/m^1.5",
        "contact stiffness; Hertz's stiffness without it",
        above=0.0,
        usual=(1.0e6, 1.0e14),
        default=None,
    )
    approach_speed_floor: float = quantity(
        "m/s", "least approach speed in the damping of the normal law", above=0.0, default=1.0e-3
    )
    material: str = described(
        "material pair; it gives Young's moduli, Poisson's ratios, friction and wear coefficient, unless the "
        "joint has its own values",
        default="",
        in_repr=False,
    )

    def __attrs_post_init__(self) -> None:
        if not self.radial_clearance < self.bushing_radius:
            raise FieldError(
                "radial_clearance",
                f"{self.radial_clearance!r} is not below the bushing_radius of {self.bushing_radius!r} m",
            )

    @property
    def journal_radius(self) -> float:
        """Radius of the journal [m]."""
        return self.bushing_radius - self.radial_clearance


@attrs.frozen(kw_only=True)
class ClearanceSection:
    """The section ``clearances`` of a mechanism file."""

    defaults: dict[str, Any] = described("settings of all joints, a mapping of the keys below", factory=dict)
    joints: tuple[str, ...] | dict[str, Any] = described(
        "the clearance joints: a list of names, or a mapping from each name to its own settings", default=()
    )


Vector = tuple[float, float]

_TORQUE_SLIP = f"{USUAL}; N mm for N m?"
Pose = tuple[float, float, float]
Torques = Annotated[tuple[float, ...], "one per phase"]  # in a file, one number is a constant torque
Forces = Annotated[tuple[Vector, ...], "one per phase"]  # in a file, one force is a constant one
Label = Annotated[str, "in a file, not empty"]

GROUND = "ground"


@attrs.frozen(kw_only=True)
class Ground:
    """The fixed frame and its points."""

    points: dict[str, Vector] = described("points by name, [x, y]", unit="m", factory=dict)


def _mass_slip(kg: float) -> str:
    return f"{USUAL}. Is it in {'g' if kg > 1.0 else 't'}?"


@attrs.frozen(kw_only=True)
class Body:
    """A rigid body; points and centre of mass are given in its own frame."""

    mass: float = quantity("kg", "mass", above=0.0, usual=(1.0e-4, 300.0), doubt=_mass_slip)
    inertia: float = quantity("kg m^2", "moment of inertia about the centre of mass", above=0.0)
    com: Vector = quantity("m", "centre of mass, [x, y]")
    points: dict[str, Vector] = described("points by name, [x, y]", unit="m")


_LONGEST_LABEL = 30
_IN_LABELS = " ',-./+"  # allowed in addition to letters and digits: no character of markup


def _label_fault(label: str) -> str | None:
    if len(label) > _LONGEST_LABEL:
        return f"has {len(label)} characters. Expected at most {_LONGEST_LABEL}"
    if all(sign.isalnum() or sign in _IN_LABELS for sign in label) and label == label.strip():
        return None
    return f"{label!r} is not a plain name. Expected letters, digits, spaces between and {_IN_LABELS.strip()}"


def _label() -> Any:
    return described("name for operators, such as knee", default="", check=_label_fault, in_repr=False)


@attrs.frozen(kw_only=True)
class RevoluteJoint:
    """A journal in a bushing, at the point of the joint's name on both bodies."""

    bushing: str = described("body that carries the bushing")
    journal: str = described("body that carries the pin")
    kind: Literal["revolute"] = described("revolute, or prismatic", default="revolute")
    label: Label = _label()


@attrs.frozen(kw_only=True)
class PrismaticJoint:
    """A slider on a straight guide, through the point of the joint's name on both bodies."""

    guide: str = described("body that carries the guide")
    slider: str = described("body that slides")
    axis: Vector = quantity(
        "",
        "direction of sliding in the guide's frame, [x, y]",
        check=lambda axis: None if any(axis) else f"{list(axis)} has no direction",
    )
    kind: Literal["prismatic"] = described("prismatic")
    label: Label = _label()


def _turns(speed: float) -> str | None:
    least, most = 1.0e-3, 1.0e4
    if least <= abs(speed) <= most:
        return None
    return f"{speed!r} rad/s does not turn the crank. Expected a speed from {least:g} to {most:g} rad/s"


def _rises_below_one(phase: tuple[float, ...]) -> str | None:
    if phase and all(a < b for a, b in pairwise(phase)) and phase[-1] < 1.0:
        return None
    return f"{list(phase)} does not increase from 0 to below 1"


@attrs.frozen(kw_only=True)
class SpeedDrive:
    """The crank turns at a constant speed."""

    body: str = described("the crank")
    speed: float = quantity(
        "rad/s",
        "crank speed, counter-clockwise positive, from 0.001 to 10000 in size",
        check=_turns,
    )


@attrs.frozen(kw_only=True)
class TorqueDrive:
    """A constant torque acts on the crank, which starts at ``initial_speed``."""

    body: str = described("the crank")
    torque: float = quantity(
        "N m", "torque on the crank, counter-clockwise positive", usual=(0.0, 1.0e4), doubt=_TORQUE_SLIP
    )
    initial_speed: float = quantity("rad/s", "crank speed at the start", default=0.0)


@attrs.frozen(kw_only=True)
class Track:
    """A controller: its torque is the feed-forward plus gains on the errors of angle and speed."""

    speed_radps: float = quantity(
        "rad/s", "speed to follow, counter-clockwise positive, not 0; the crank starts at it", check=_turns
    )
    kp_nm_per_rad: float = quantity("N m/rad", "gain on the angle's error", at_least=0.0, default=0.0)
    kd_nm_s_per_rad: float = quantity("N m s/rad", "gain on the speed's error", at_least=0.0, default=0.0)
    feed_forward_nm: Torques = quantity(
        "N m", "torque in addition to the gains; one number, or one per phase", default=(0.0,)
    )
    feed_forward_phase: tuple[float, ...] = quantity(
        "",
        "fractions of the gait cycle, 0 at crank angle 0 of the motion to follow",
        at_least=0.0,
        default=(0.0,),
        check=_rises_below_one,
    )
    max_torque_nm: float | None = quantity(
        "N m",
        "largest torque of the drive, in both directions; no limit without it",
        above=0.0,
        default=None,
    )

    def __attrs_post_init__(self) -> None:
        torques, phases = len(self.feed_forward_nm), len(self.feed_forward_phase)
        if torques != phases:
            raise FieldError(
                "feed_forward_nm", f"has {torques} torques for {phases} phases. Expected one each"
            )


@attrs.frozen(kw_only=True)
class TrackDrive:
    """A controller's torque acts on the crank, which starts in step with the motion to follow."""

    body: str = described("the crank")
    track: Track = described("the controller, a mapping of the keys below")

    @property
    def speed(self) -> float:
        """Speed to follow [rad/s]."""
        return self.track.speed_radps


Drive = SpeedDrive | TorqueDrive | TrackDrive


@attrs.frozen(kw_only=True)
class Spring:
    """A linear spring and damper between a point on each of two bodies."""

    bodies: tuple[str, str] = described("the two bodies; one may be the ground")
    points: tuple[str, str] = described("its point on each body")
    stiffness: float = quantity("N/m", "stiffness", at_least=0.0)
    free_length: float = quantity("m", "length without force", at_least=0.0)
    damping: float = quantity("N s/m", "viscous damping, in full coordinates only", at_least=0.0, default=0.0)


@attrs.frozen(kw_only=True)
class Load:
    """A force on a point of a body: constant, or a periodic table, linear between its entries."""

    body: str = described("body that the force acts on")
    point: str = described("its point")
    force: Forces = quantity("N", "force in the ground's frame, [x, y]; one, or one per phase")
    phase: tuple[float, ...] = quantity(
        "",
        "fractions of the gait cycle, 0 at crank angle 0",
        at_least=0.0,
        default=(0.0,),
        check=_rises_below_one,
    )

    def __attrs_post_init__(self) -> None:
        if len(self.force) != len(self.phase):
            raise FieldError(
                "force", f"has {len(self.force)} forces for {len(self.phase)} phases. Expected one each"
            )


@attrs.frozen(kw_only=True)
class Assembly:
    """Initial guess of the position analysis: crank angle, and each body's origin and angle."""

    crank_angle: float = quantity("rad", "crank angle of this assembly")
    poses: dict[str, Pose] = described(
        "each body's origin and angle, [x, y, angle]", unit="m, m, rad", metadata={"flat": True}
    )


@attrs.frozen(kw_only=True)
class Mechanism:
    """A planar linkage with one drive; the fields with a description are the keys of the file.

    Attributes
    ----------
    clearances : dict of str to Clearance
        Settings of every revolute joint that may have clearance: defaults merged with the joint's own.
    clearance_joints : tuple of str
        Default clearance joints.
    toe_point : tuple of str, optional
        Body and point whose motion is reported; default: the point called ``toe``.
    person_kg : float
        Mass of a person with one leg attached to the mechanism; the bodies include this leg. 0 for none.
    source : str
        Name of the file, for messages.
    """

    name: str = described("name in results")
    gravity: Vector = quantity("m/s^2", "acceleration of free fall, [x, y]")
    ground: Ground = described("the fixed frame")
    bodies: dict[str, Body] = described("moving bodies by name")
    joints: dict[str, RevoluteJoint | PrismaticJoint] = described(
        "joints by name, which is also the name of their point on both bodies"
    )
    drive: Drive = described("drive of the crank")
    assembly: Assembly = described("initial guess: crank angle and each body's pose")
    springs: dict[str, Spring] = described("springs by name", factory=dict)
    loads: dict[str, Load] = described("forces on points by name", factory=dict)
    clearances: dict[str, Clearance] = described("the joints with clearance and their settings", factory=dict)
    clearance_joints: tuple[str, ...] = ()
    toe_point: tuple[str, str] | None = None
    person_kg: float = 0.0
    source: str

    def sides(self, joint: str) -> tuple[str, str]:
        """Bodies of a joint: bushing and journal, or guide and slider."""
        spec = self.joints[joint]
        return (spec.bushing, spec.journal) if isinstance(spec, RevoluteJoint) else (spec.guide, spec.slider)

    def joint_words(self, joint: str) -> str:
        """A joint by its name and its label, such as ``G (knee)``."""
        label = self.joints[joint].label
        return f"{joint} ({label})" if label else joint

    def clearance_joint(self, name: str) -> str:
        """A clearance joint by its name or by its label, such as ``knee``.

        Raises
        ------
        ConfigError
            If there is none such, or several have this label.
        """
        if name in self.clearance_joints:
            return name
        labels = {joint: self.joints[joint].label for joint in self.clearance_joints}
        found = [joint for joint, label in labels.items() if label and label.lower() == name.lower()]
        if len(found) == 1:
            return found[0]
        known = [*labels, *filter(None, labels.values())]
        expected = ", ".join(labels)
        fault = f"{name!r} is not a clearance joint. Expected one of {expected}{did_you_mean(name, known)}"
        raise ConfigError("JOINT", "", fault)

    def with_toe(self, name: str) -> "Mechanism":
        """The mechanism with a different point as its toe, such as ``shank.G``.

        Raises
        ------
        ConfigError
            If no moving body has this point.
        """
        body, _, point = name.partition(".")
        if body not in self.bodies or point not in self.bodies[body].points:
            known = [f"{one}.{each}" for one, spec in self.bodies.items() for each in spec.points]
            fault = f"{name!r} is not a point of a body. Expected one of {', '.join(known)}"
            raise ConfigError("toe", "", fault)
        return attrs.evolve(self, toe_point=(body, point))

    def points_of(self, body: str) -> dict[str, Vector]:
        """Points of a body, the ground included, in its own frame [m]."""
        return self.ground.points if body == GROUND else self.bodies[body].points

    @property
    def toe(self) -> tuple[str, str] | None:
        """Body and point with reported motion: ``toe_point``, or the point called ``toe``, or None."""
        if self.toe_point:
            return self.toe_point
        for body, spec in self.bodies.items():
            if "toe" in spec.points:
                return body, "toe"
        return None
