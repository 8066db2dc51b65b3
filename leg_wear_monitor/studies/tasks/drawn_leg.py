"""Legs of the same topology whose bodies have other lengths and masses, drawn from a seed."""

from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import one_cycle, point_motion
from leg_wear_monitor.mechanism.position import assemble, build_linkage, jacobians
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters

OPEN, DEAD_POINT, TRANSMISSION, STEP = "open", "dead_point", "transmission", "step"  # why a leg is rejected

_POINTS = 72  # crank angles of the check: 5 degrees apart
# A body that turns this many times as far per clearance as in the file's leg is close to a dead point.
_MOST_TURN = 3.0
# A step beyond these bounds, in strides or lifts of the file's leg, is none of a walking leg.
_LEAST_STEP, _MOST_STEP = 1.0 / 3.0, 3.0


class DrawnLeg(NamedTuple):
    """A leg, and its factors on the lengths of ground and bodies and on the masses of bodies."""

    mechanism: Mechanism
    length: Floats
    mass: Floats


def draw_leg(mechanism: Mechanism, settings: dict[str, Any]) -> DrawnLeg:
    """The leg number ``leg`` of ``draw_seed``; leg 0 is the mechanism as it is.

    Parameters
    ----------
    mechanism : Mechanism
    settings : dict
        ``leg``, ``draw_seed``, ``length_tolerance``, ``mass_tolerance``: factors are uniform within 1 ± the
        tolerance. A body, or the ground, is scaled in all directions; its inertia follows.
    """
    bodies = len(mechanism.bodies)
    chance = np.random.default_rng([settings["draw_seed"], settings["leg"]])
    length = 1.0 + settings["length_tolerance"] * chance.uniform(-1.0, 1.0, bodies + 1)
    mass = 1.0 + settings["mass_tolerance"] * chance.uniform(-1.0, 1.0, bodies)
    if settings["leg"] == 0:
        length, mass = np.ones_like(length), np.ones_like(mass)
    leg = LegParameters(mass, length[1:]).applied(mechanism)
    points = {
        name: (float(length[0] * x), float(length[0] * y)) for name, (x, y) in leg.ground.points.items()
    }
    return DrawnLeg(attrs.evolve(leg, ground=attrs.evolve(leg.ground, points=points)), length, mass)


def rejection(leg: Mechanism, file_leg: Mechanism) -> str:
    """Why a leg is none that walks: `OPEN`, `DEAD_POINT`, `TRANSMISSION` or `STEP`; empty if it walks."""
    try:
        assemble(build_linkage(leg))
    except AssemblyError:
        return OPEN
    try:
        turn, step = _walk(leg)
    except AssemblyError:
        return DEAD_POINT
    usual_turn, usual_step = _walk(file_leg)
    if turn > _MOST_TURN * usual_turn:
        return TRANSMISSION
    parts = step / usual_step
    return "" if ((parts >= _LEAST_STEP) & (parts <= _MOST_STEP)).all() else STEP


def _walk(leg: Mechanism) -> tuple[float, Floats]:
    """Largest turn of a body per eccentricity of a joint [rad/m], and the toe's stride and lift (2,) [m].

    A leg without a toe has the step 1 m, 1 m.
    """
    linkage = build_linkage(leg)
    motion = one_cycle(linkage, _POINTS, 1.0)
    by_closure = np.linalg.inv(jacobians(linkage, motion.q))
    closures = np.arange(by_closure.shape[2]) != linkage.rows.drive_row
    turn = float(np.abs(by_closure[:, 2::3][:, :, closures]).max())
    if leg.toe is None:
        return turn, np.ones(2)
    return turn, np.asarray(np.ptp(point_motion(motion, linkage, *leg.toe)[0], axis=0))
