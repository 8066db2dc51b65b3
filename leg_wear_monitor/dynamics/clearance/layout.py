"""How the tables over the crank angle are laid out: named parts of flat rows.

One row is interpolated in one loop; names are views of it.
"""

import math

from leg_wear_monitor.mechanism.arrays import Floats

Shapes = dict[str, tuple[int, ...]]


def motion_shapes(k: int, damped: bool) -> Shapes:
    """Parts of a row that moves k clearance joints, d = 2 k eccentricities e.

    What changes with e comes first, as `changing_shapes` says: ``inverse_mass`` of e; forces on e
    without contact, ``free`` by 1, w' and w^2; slip of each joint by w, ``lever_drive``, which is also what
    its friction force takes from the drive torque; ``load_power`` the power of loads by (e', w); drive
    torque, ``torque_a`` by e'', ``torque_v`` by w e' and (this row does not change) by e'.

    Acceleration of e: ``coriolis`` by w e'. Slip of each joint beyond t . e': ``lever`` by e'. Drive torque:
    ``torque`` by (1, w', w^2, w), ``torque_e`` by e times (1, w', w^2), and the form ``torque_vv`` of
    (e', e'). In square parts the second
    index is the one that results (of the form the first vector's), so that loops run along rows. ``angle``
    of the bushing's and the journal's bodies, ``turn`` its derivative; ``toe`` its position, by 1 and e, and
    the derivative of the latter by the crank angle. With dampers, ``viscous`` accelerations and ``damper``
    the power taken as a quadratic form, both by (e', w).
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
        "lever": (k, d),
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
    """Parts at the start of that row that change with e."""
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
    """Parts of the stored energy: the Lagrangian's A, B, B_e, c, c_e, c_ee, and the potential energy.

    ``push`` and ``push_e`` are minus the gradient of the potential energy by e and minus its curvature.
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
