"""A mechanism file as types: every key, its unit, its bounds and its meaning."""

from typing import Literal

import attrs

from leg_wear_monitor.mechanism.quantity import quantity

Vector = tuple[float, float]
Pose = tuple[float, float, float]
Pair = tuple[float, float]

NORMAL_LAWS = ("hertz", "hunt-crossley", "lankarani-nikravesh", "gonthier", "flores", "hu-guo")
FRICTION_LAWS = ("ambrosio", "threlfall", "none")

GROUND = "ground"


def _ordered(instance: object, attribute: "attrs.Attribute[Vector]", value: Vector) -> None:
    if not value[0] <= value[1]:
        raise ValueError(f"{list(value)} is not an increasing pair {attribute.metadata['unit']}".rstrip())


def _one_of(names: tuple[str, ...]) -> "attrs._ValidatorType[str]":
    def check(_instance: object, _attribute: "attrs.Attribute[str]", value: str) -> None:
        if value not in names:
            raise ValueError(f"{value!r} is not one of {', '.join(names)}")

    return check


@attrs.frozen
class Ground:
    """The fixed frame and the points it carries."""

    points: dict[str, Vector] = attrs.field(factory=dict)


@attrs.frozen
class Body:
    """A rigid body; its points and centre of mass are written in its own frame."""

    mass: float = quantity("kg", "mass", above=0.0)
    inertia: float = quantity("kg m^2", "moment of inertia about the centre of mass", above=0.0)
    com: Vector = quantity("m", "centre of mass")
    points: dict[str, Vector] = attrs.field()


@attrs.frozen
class RevoluteJoint:
    """A pin in a hole: the bushing's body and the journal's body."""

    bushing: str
    journal: str
    kind: Literal["revolute"] = "revolute"


@attrs.frozen
class PrismaticJoint:
    """A slider on a straight guide; ``axis`` is written in the guide's frame."""

    guide: str
    slider: str
    axis: Vector = quantity("", "direction of sliding in the guide's frame")
    kind: Literal["prismatic"] = "prismatic"

    @axis.validator  # type: ignore[attr-defined, untyped-decorator, unused-ignore]
    def _axis_has_length(self, _attribute: "attrs.Attribute[Vector]", value: Vector) -> None:
        if value == (0.0, 0.0):
            raise ValueError("[0.0, 0.0] has no direction")


@attrs.frozen
class SpeedDrive:
    """The crank turns at a constant speed."""

    body: str
    speed: float = quantity("rad/s", "crank speed, counter-clockwise positive")

    @speed.validator  # type: ignore[attr-defined, untyped-decorator, unused-ignore]
    def _speed_turns(self, _attribute: "attrs.Attribute[float]", value: float) -> None:
        if value == 0.0:
            raise ValueError("0.0 rad/s does not turn the crank; expected a speed other than 0 rad/s")


@attrs.frozen
class TorqueDrive:
    """A constant torque acts on the crank, which starts at ``initial_speed``."""

    body: str
    torque: float = quantity("N m", "torque on the crank, counter-clockwise positive")
    initial_speed: float = quantity("rad/s", "crank speed at the start", default=0.0)


@attrs.frozen
class Spring:
    """A linear spring and damper between a point on each of two bodies."""

    bodies: tuple[str, str]
    points: tuple[str, str]
    stiffness: float = quantity("N/m", "stiffness", at_least=0.0)
    free_length: float = quantity("m", "length without force", at_least=0.0)
    damping: float = quantity("N s/m", "viscous damping", at_least=0.0, default=0.0)


@attrs.frozen
class ConstantLoad:
    """A force on a point of a body, fixed in the ground's frame."""

    body: str
    point: str
    force: Vector = quantity("N", "force in the ground's frame")


@attrs.frozen
class PhaseLoad:
    """A force on a point of a body as a table over the gait phase, linear between its entries, periodic."""

    body: str
    point: str
    phase: tuple[float, ...] = quantity("", "share of the gait cycle, 0 at crank angle 0", at_least=0.0)
    force: tuple[Vector, ...] = attrs.field()

    @phase.validator  # type: ignore[attr-defined, untyped-decorator, unused-ignore]
    def _phase_increases(self, _attribute: "attrs.Attribute[object]", value: tuple[float, ...]) -> None:
        rising = all(a < b for a, b in zip(value, value[1:], strict=False))
        if not value or not rising or value[-1] >= 1.0:
            raise ValueError(f"{list(value)} does not increase from 0 to below 1")

    @force.validator  # type: ignore[attr-defined, untyped-decorator, unused-ignore]
    def _one_force_a_phase(self, _attribute: "attrs.Attribute[object]", value: tuple[Vector, ...]) -> None:
        if len(value) != len(self.phase):
            raise ValueError(f"{len(value)} forces for {len(self.phase)} phases; expected one each")


@attrs.frozen
class Friction:
    """Coulomb friction with a ramp around zero slip speed."""

    law: str = attrs.field(default="ambrosio", validator=_one_of(FRICTION_LAWS))
    coefficient: float = quantity("", "friction coefficient", at_least=0.0, at_most=2.0, default=0.0)
    ramp: Pair = attrs.field(default=(0.001, 0.01), metadata={"unit": "m/s"}, validator=_ordered)

    def __attrs_post_init__(self) -> None:
        if self.ramp[0] < 0.0 or self.ramp[1] <= 0.0:
            raise ValueError(f"ramp {list(self.ramp)} is not above 0 m/s")


@attrs.frozen
class Clearance:
    """Everything that makes a revolute joint loose; pairs are (bushing, journal)."""

    bushing_radius: float = quantity("m", "radius of the bushing", above=0.0, at_most=1.0)
    width: float = quantity("m", "axial contact width", above=0.0, at_most=1.0)
    radial_clearance: float = quantity("m", "bushing radius less journal radius", above=0.0)
    youngs_modulus: Pair = quantity("Pa", "Young's modulus", above=0.0)
    poissons_ratio: Pair = quantity("", "Poisson's ratio", at_least=0.0, at_most=0.5)
    normal_law: str = attrs.field(default="lankarani-nikravesh", validator=_one_of(NORMAL_LAWS))
    restitution: float = quantity("", "coefficient of restitution", above=0.0, at_most=1.0, default=0.9)
    friction: Friction = Friction()
    wear_coefficient: Pair = quantity("1/Pa", "K/H of Archard's law", at_least=0.0, default=(0.0, 0.0))
    stiffness: float | None = quantity(
        "N/m^1.5", "contact stiffness instead of Hertz's", above=0.0, default=None
    )
    approach_speed_floor: float = quantity(
        "m/s", "least approach speed in the damping of the normal law", above=0.0, default=1.0e-3
    )

    def __attrs_post_init__(self) -> None:
        if not self.radial_clearance < self.bushing_radius:
            raise ValueError(
                f"radial_clearance {self.radial_clearance!r} m is not below bushing_radius {self.bushing_radius!r} m"
            )

    @property
    def journal_radius(self) -> float:
        """Radius of the journal [m]."""
        return self.bushing_radius - self.radial_clearance


@attrs.frozen
class Assembly:
    """Where to start looking: the crank angle and each body's origin and angle."""

    crank_angle: float = quantity("rad", "crank angle of this assembly")
    poses: dict[str, Pose] = attrs.field()


@attrs.frozen
class Mechanism:
    """A planar linkage with one drive.

    Attributes
    ----------
    clearances : dict of str to Clearance
        Settings of every revolute joint that may be loose: defaults merged with its own.
    loose : tuple of str
        Joints that are loose unless a caller says otherwise.
    source : str
        Where it was read from, for messages.
    """

    name: str
    gravity: Vector
    ground: Ground
    bodies: dict[str, Body]
    joints: dict[str, RevoluteJoint | PrismaticJoint]
    drive: SpeedDrive | TorqueDrive
    assembly: Assembly
    springs: dict[str, Spring]
    loads: dict[str, ConstantLoad | PhaseLoad]
    clearances: dict[str, Clearance]
    loose: tuple[str, ...]
    source: str

    def sides(self, joint: str) -> tuple[str, str]:
        """Bodies of a joint: bushing and journal, or guide and slider."""
        spec = self.joints[joint]
        return (spec.bushing, spec.journal) if isinstance(spec, RevoluteJoint) else (spec.guide, spec.slider)

    def points_of(self, body: str) -> dict[str, Vector]:
        """Points of a body, the ground included, in its own frame [m]."""
        return self.ground.points if body == GROUND else self.bodies[body].points

    @property
    def toe(self) -> tuple[str, str] | None:
        """Body and point called ``toe``, the point whose motion is reported, if there is one."""
        for body, spec in self.bodies.items():
            if "toe" in spec.points:
                return body, "toe"
        return None
