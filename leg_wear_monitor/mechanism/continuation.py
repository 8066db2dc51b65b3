"""Continuation of a position along the crank angle, on one branch (physics.md section 1)."""

from collections import deque
from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import Linkage, assemble, drive_column, evaluate, newton

_LONGEST_STEP = np.deg2rad(2.0)  # crank step that keeps the continuation on its branch
_SHORTEST_STEP = np.deg2rad(1.0e-4)  # crank step below which a dead point is reported


def positions(linkage: Linkage, crank_angles: Floats) -> Floats:
    """Coordinates q (p, n, 3) at p crank angles [rad], visited in this order; see `follow`."""
    q, angle = assemble(linkage), linkage.mechanism.assembly.crank_angle
    found = np.empty((len(crank_angles), *q.shape))
    for i, target in enumerate(crank_angles):
        q, angle = follow(linkage, q, angle, target), target
        found[i] = q
    return found


def follow(linkage: Linkage, q: Floats, angle: float, target: float) -> Floats:
    """Coordinates (n, 3) at the crank angle ``target``, continued on one branch from q at ``angle`` [rad].

    Raises
    ------
    AssemblyError
        If there is a dead point between the angles, naming its crank angle.
    """
    angle, q = furthest(linkage, q, angle, target)
    if angle != target:
        raise AssemblyError(
            f"{linkage.mechanism.source}: drive.body: "
            f"dead point at crank angle {np.rad2deg(angle) % 360.0:.2f} deg: "
            "the crank cannot turn through a full cycle"
        )
    return q


def furthest(linkage: Linkage, q: Floats, angle: float, target: float) -> tuple[float, Floats]:
    """Last crank angle [rad] and coordinates (n, 3) of `walk`: the target's, or those before a dead point."""
    last = deque(walk(linkage, q, angle, target), maxlen=1)
    return last[0] if last else (angle, q)


def walk(linkage: Linkage, q: Floats, angle: float, target: float) -> Iterator[tuple[float, Floats]]:
    """Crank angles [rad] and coordinates (n, 3) from q at ``angle`` to ``target``, continued on one branch.

    Before a dead point, they end early.
    """
    longest = _LONGEST_STEP  # shorter after a step that failed: near a dead point, the next would fail, too
    while angle != target:
        step = float(np.clip(target - angle, -longest, longest))
        while (near := _step(linkage, q, angle, step)) is None:
            step *= 0.5
            if abs(step) < _SHORTEST_STEP:
                return
            longest = abs(step)
        longest = min(2.0 * longest, _LONGEST_STEP)
        q, angle = near, target if step == target - angle else angle + step
        yield angle, q


def _step(linkage: Linkage, q: Floats, angle: float, step: float) -> Floats | None:
    """One continuation step [rad] along the tangent; None if it fails or passes a singular position."""
    here = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).jacobian
    sign = np.linalg.slogdet(here)[0]
    if sign == 0.0:
        return None
    guess = q.copy()
    guess[1:] += (np.linalg.solve(here, drive_column(linkage)) * step).reshape(-1, 3)
    near = newton(linkage, guess, angle + step)
    if near is None or np.abs(near - guess).max() > abs(step):
        return None
    ahead = evaluate(linkage, near, np.zeros_like(q), (angle + step, 0.0, 0.0)).jacobian
    return near if np.linalg.slogdet(ahead)[0] == sign else None
