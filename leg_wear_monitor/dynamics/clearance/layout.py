"""Layout of the tables over the crank angle: named parts of flat rows (physics.md section 7).

A row is interpolated in one loop; the named parts are views of it.
"""

import math

from leg_wear_monitor.mechanism.arrays import Floats

Shapes = dict[str, tuple[int, ...]]


def motion_shapes(k: int, damped: bool) -> Shapes:
    """Shapes of the parts of a row for k clearance joints, with d = 2 k eccentricities e and crank speed w.

    The parts that depend on e come first, as in `changing_shapes`: ``inverse_mass`` of e; ``free``: forces on
    e without contact, coefficients of 1, w' and w^2; ``lever_drive``: slip of each joint per w, which is also
    the coefficient of its friction force in the drive torque; ``load_power``: power of loads, coefficients of
    (e', w); ``torque_a``: drive torque, coefficient of e''; ``torque_v``: drive torque, coefficients of w e'
    and of e' (the latter does not depend on e).

    The other parts: ``coriolis``: accelerations of e, coefficient of w e'; ``lever``: slip of each joint
    beyond t . e', coefficient of e'; ``torque``: drive torque, coefficients of (1, w', w^2, w); ``torque_e``:
    coefficients of e (1, w', w^2); ``torque_vv``: quadratic form of e'; ``angle``: angles of the bushing's
    and the journal's body [rad], ``turn``: their derivatives by the crank angle; ``toe``: position,
    coefficients of 1 and e, and the derivative of the latter by the crank angle; with dampers, ``viscous``:
    accelerations, and ``damper``: dissipated power as a quadratic form, both in (e', w).

    In square parts the second index is that of the result (in a form, of the first vector), so that loops run
    along rows.
    """
    d = 2 * k
    return {
        "inverse_mass": (d, d),
        "free": (3, d),
        "lever_drive": (k,),
        "load_power": (d + 1,),
        "torque_a": (d,),
        "torque_v": (2, d),
        "coriolis": (d, d),
        "lever": (d, k),
        "torque": (4,),
        "torque_e": (3, d),
        "torque_vv": (d, d),
        "angle": (k, 2),
        "turn": (k, 2),
        "toe": (2, 1 + 2 * d),
        "viscous": (d, d + 1) if damped else (0, 0),
        "damper": (d + 1, d + 1) if damped else (0, 0),
    }


def changing_shapes(k: int) -> Shapes:
    """Shapes of the parts at the start of the row of `motion_shapes` that depend on e."""
    d = 2 * k
    return {
        "inverse_mass": (d, d),
        "free": (3, d),
        "lever_drive": (k,),
        "load_power": (d + 1,),
        "torque_a": (d,),
        "torque_v": (d,),
    }


def stored_shapes(k: int) -> Shapes:
    """Shapes of the parts of the stored energy: the Lagrangian's A, B, B_e, c, c_e, c_ee, and the potential.

    ``push`` and ``push_e`` are minus the first and second derivatives of the potential energy by e.
    """
    d = 2 * k
    square, line, one = (d, d), (d,), (1,)
    return {
        "a": square, "b": line, "b_e": square, "c": one, "c_e": line, "c_ee": square,
        "potential": one, "push": line, "push_e": square,
    }  # fmt: skip


def views(flat: Floats, shapes: Shapes) -> dict[str, Floats]:
    """Named views of consecutive parts of a flat array."""
    parts, start = {}, 0
    for name, shape in shapes.items():
        size = math.prod(shape)
        parts[name] = flat[start : start + size].reshape(shape)
        start += size
    return parts
