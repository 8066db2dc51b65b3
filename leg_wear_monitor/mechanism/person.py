"""A person's leg that hangs on a linkage: segments added to its thigh, shank and foot (physics.md section 9).

Segments by Winter, *Biomechanics and Motor Control of Human Movement*: mass over that of the body; over the
length of the segment, the distance of the centre of mass from the proximal joint and the radius of gyration
about the centre of mass.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Body, Mechanism, Vector

PERSON_TOLERANCE = 0.2  # of the mass of a person, who eats, dresses and carries


class _Segment(NamedTuple):
    mass: float
    centre: float
    gyration: float


SEGMENTS = {
    "thigh": _Segment(0.100, 0.433, 0.323),
    "shank": _Segment(0.0465, 0.433, 0.302),
    "foot": _Segment(0.0145, 0.500, 0.475),
}


def with_person(mechanism: Mechanism, person_kg: float) -> Mechanism:
    """The mechanism with one leg of a person, as rigid parts of its bodies.

    Hip, knee and ankle are the joints of the bodies named thigh, shank and foot; the foot ends at its toe.

    Parameters
    ----------
    mechanism : Mechanism
    person_kg : float
        Mass of the whole person [kg].

    Raises
    ------
    ConfigError
        For a mechanism without such bodies, joints and toe.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> leg = lw.with_person(lw.load_mechanism("bionic_leg"), 80.0)
    >>> round(leg.bodies["thigh"].mass, 1)
    11.5
    """
    if not person_kg:
        return mechanism
    places = [_joint(mechanism, *pair) for pair in pairwise((GROUND, *SEGMENTS))]
    toe = mechanism.toe
    if toe is None or toe[0] != "foot" or not all(places):
        fault = "has no thigh, shank and foot with a toe, in a chain from the ground, for load.person_kg"
        raise ConfigError(mechanism.source, "bodies", fault)
    ends = [*places, toe[1]]
    bodies = dict(mechanism.bodies)
    for (name, segment), (upper, lower) in zip(SEGMENTS.items(), pairwise(ends), strict=True):
        body = bodies[name]
        bodies[name] = _with(body, segment, person_kg, body.points[str(upper)], body.points[str(lower)])
    return attrs.evolve(mechanism, bodies=bodies, person_kg=mechanism.person_kg + person_kg)


def heavier_person(mechanism: Mechanism) -> Mechanism:
    """The mechanism with a person who is heavier by the tolerance."""
    return with_person(mechanism, PERSON_TOLERANCE * mechanism.person_kg)


def heavier_person_torque(mechanism: Mechanism, points: int, speed: float) -> Floats:
    """Drive torque (points,) [N m] that the tolerance of the person's mass adds, with ideal joints."""
    heavier, own = (
        one_cycle(build_linkage(one), points, speed).drive_torque
        for one in (heavier_person(mechanism), mechanism)
    )
    return np.asarray(heavier - own)


def _joint(mechanism: Mechanism, body: str, other: str) -> str | None:
    """Name of the revolute joint between two bodies; None if there is none."""
    return next((name for name in mechanism.joints if {*mechanism.sides(name)} == {body, other}), None)


def _with(body: Body, segment: _Segment, person_kg: float, upper: Vector, lower: Vector) -> Body:
    """A body with a segment between two of its points."""
    mass, length = segment.mass * person_kg, math.dist(upper, lower)
    centre = [a + segment.centre * (b - a) for a, b in zip(upper, lower, strict=True)]
    whole = body.mass + mass
    x, y = ((body.mass * a + mass * b) / whole for a, b in zip(body.com, centre, strict=True))
    inertia = body.inertia + mass * (segment.gyration * length) ** 2
    inertia += body.mass * mass / whole * math.dist(body.com, centre) ** 2
    return attrs.evolve(body, mass=whole, inertia=inertia, com=(x, y))
