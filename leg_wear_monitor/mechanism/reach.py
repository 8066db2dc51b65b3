"""Range of the linkage: where it closes, and how far its crank turns."""

from collections import deque
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats, com_poses, compile_arrays
from leg_wear_monitor.mechanism.constraints import select_rows
from leg_wear_monitor.mechanism.loader import suspects
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    all_but,
    far_from_start,
    find_assembly,
    follow,
    furthest,
    mobility,
    nearest,
    newton,
    open_joint,
    point_path,
)
from leg_wear_monitor.mechanism.spec import Mechanism, PrismaticJoint


class DeadPoint(NamedTuple):
    """A position that the crank cannot pass: its angle [rad], and coordinates (n, 3)."""

    crank_angle: float
    q: Floats


# Positions of a mechanism over its crank's range: all of them if it works, the possible ones if not.


POINTS = 180  # positions per cycle, enough to look smooth
_OPEN_POINTS = 72  # fewer steps for an open mechanism, because its positions take long
_VISIBLE = 0.02  # fraction of the largest gap
_CLOSED = 1.0e-9  # gap [m] below which a joint counts as closed


@attrs.frozen(eq=False)
class Reach:
    """Positions of a mechanism, working or not, with all joints ideal.

    Attributes
    ----------
    linkage : Linkage
    mobility : int
        Degrees of freedom; 1 for a mechanism with one drive. With any other number, there is one position.
    crank_angle : (p,) array, rad
        Rising; a whole turn from 0 if the crank turns through.
    q : (p, n, 3) array
        Coordinates at these angles; the coordinates with the least gap if the mechanism does not close.
    turns : bool
        True if it closes all over a turn of the crank.
    open_joint : str
        Joint that does not close at the crank angle of the assembly, with all others closed; empty if all
        close there.
    gap_m : (p,) array
        Gap of this joint.
    low, high : DeadPoint or None
        Ends of the range in which it closes; None if the crank turns through, or it never closes.
    fault : str
        Fault of the assembly; empty if there is none.
    """

    linkage: Linkage
    mobility: int
    crank_angle: Floats
    q: Floats
    turns: bool = False
    open_joint: str = ""
    gap_m: Floats = attrs.field(factory=lambda: np.zeros(1))
    low: DeadPoint | None = None
    high: DeadPoint | None = None
    fault: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return self.linkage.mechanism

    def path(self, body: str, point: str) -> Floats:
        """Position (p, 2) [m] of a point of a body."""
        return point_path(self.mechanism, self.q, body, point)

    def gap_of(self, joint: str) -> Floats:
        """Distance (p,) [m] of the two points of a joint; 0 for a slider's, which part along the guide."""
        if isinstance(self.mechanism.joints[joint], PrismaticJoint):
            return np.zeros(len(self.q))
        bushing, journal = (self.path(body, joint) for body in self.mechanism.sides(joint))
        return np.asarray(np.linalg.norm(journal - bushing, axis=1))

    def is_open(self, joint: str) -> bool:
        """True if the two points of a joint are visibly apart in a mechanism that does not close."""
        if self.turns or (self.mobility == 1 and not self.open_joint):
            return False
        largest = max(float(self.gap_of(name).max()) for name in self.mechanism.joints)
        return float(self.gap_of(joint).max()) > max(_VISIBLE * largest, _CLOSED)


def reach_of(mechanism: Mechanism, crank_angle: float | None = None, points: int = POINTS) -> Reach:
    """Positions of a mechanism over the range of its crank.

    Parameters
    ----------
    mechanism : Mechanism
    crank_angle : float, optional
        An angle [rad] that the result must include, if the crank reaches it.
    points : int
        Positions over the range, where the mechanism closes.

    Raises
    ------
    AssemblyError
        If its lengths are too far apart for numbers.
    """
    arrays = compile_arrays(mechanism)
    linkage = Linkage(mechanism, arrays, select_rows(arrays, range(len(mechanism.joints)), driven=True))
    wanted = () if crank_angle is None else (crank_angle,)
    with np.errstate(all="ignore"):  # the result is checked below
        reach = _reach(linkage, np.array(wanted), points)
    if not np.isfinite(reach.q).all():
        raise AssemblyError(f"{mechanism.source}: bodies: lengths are too far apart to place the bodies")
    return reach


def _reach(linkage: Linkage, wanted: Floats, points: int) -> Reach:
    freedom, start = mobility(linkage.mechanism), linkage.mechanism.assembly.crank_angle
    if freedom != 1:
        q = nearest(linkage, com_poses(linkage.mechanism), start, np.ones(len(linkage.rows.body)))
        return Reach(linkage, freedom, np.array([start]), q[None])
    found = find_assembly(linkage)
    if found is None:
        return _open(linkage, wanted)
    return attrs.evolve(_closed(linkage, found, start, wanted, points), fault=far_from_start(linkage, found))


def _closed(linkage: Linkage, q: Floats, angle: float, wanted: Floats, points: int) -> Reach:
    """Reach of a linkage that closes at a crank angle [rad] with coordinates q."""
    last, there = furthest(linkage, q, angle, angle + TURN)
    if last == angle + TURN:
        angles = np.union1d(np.arange(points) * (TURN / points), wanted % TURN)
        return Reach(
            linkage, 1, angles, _followed(linkage, q, angle, angles), True, gap_m=np.zeros(len(angles))
        )
    high, low = DeadPoint(last, there), DeadPoint(*furthest(linkage, q, angle, angle - TURN))
    angles = np.linspace(low.crank_angle, high.crank_angle, points)[1:-1]
    inside = low.crank_angle + (wanted - low.crank_angle) % TURN
    angles = np.union1d(angles, np.clip(inside[inside <= high.crank_angle], angles[0], angles[-1]))
    between = _followed(linkage, q, angle, angles)
    return Reach(
        linkage,
        1,
        np.array([low.crank_angle, *angles, high.crank_angle]),
        np.stack([low.q, *between, high.q]),
        gap_m=np.zeros(len(angles) + 2),
        low=low,
        high=high,
    )


def _followed(linkage: Linkage, q: Floats, angle: float, angles: Floats) -> Floats:
    """Coordinates (p, n, 3) at rising crank angles, from q at one of them outwards."""
    found = np.empty((len(angles), *q.shape))
    first = int(np.searchsorted(angles, angle))
    for order in (range(first, len(angles)), range(first - 1, -1, -1)):
        here, at = q, angle
        for i in order:
            here, at = follow(linkage, here, at, float(angles[i])), float(angles[i])
            found[i] = here
    return found


def _open(linkage: Linkage, wanted: Floats) -> Reach:
    """Reach of a linkage that does not close at the crank angle of its assembly."""
    joint, gap_m, q = open_joint(linkage)
    start, weight = linkage.mechanism.assembly.crank_angle, all_but(linkage, joint)
    angles = np.arange(_OPEN_POINTS) * (TURN / _OPEN_POINTS)
    angles = start + np.union1d(angles, (wanted - start) % TURN)
    places = np.empty((len(angles), *q.shape))
    for i, angle in enumerate(angles):
        q = places[i] = nearest(linkage, q, float(angle), weight)
    reach = Reach(linkage, 1, angles, places, open_joint=joint)
    gaps = (
        np.array([gap_m])
        if isinstance(linkage.mechanism.joints[joint], PrismaticJoint)
        else reach.gap_of(joint)
    )
    gaps = np.broadcast_to(gaps, (len(angles),)).copy()
    low, high = _closes_between(linkage, reach, gaps)
    return attrs.evolve(reach, gap_m=gaps, low=low, high=high)


def _closes_between(
    linkage: Linkage, reach: Reach, gaps: Floats
) -> tuple[DeadPoint | None, DeadPoint | None]:
    """Ends of the range of crank angles that close the joint that is open at the start."""
    i = int(gaps.argmin())
    angle = float(reach.crank_angle[i])
    q = newton(linkage, reach.q[i], angle) if gaps[i] < _CLOSED else None
    if q is None:
        return None, None
    ends = (furthest(linkage, q, angle, angle + side * TURN) for side in (-1.0, 1.0))
    low, high = (DeadPoint(*end) for end in ends)
    return low, high


# Faults of a mechanism that does not close or turn, in words.


def headline(reach: Reach) -> str:
    """In a few words, whether the mechanism works."""
    if reach.mobility != 1:
        return f"mobility is {reach.mobility}. Expected 1"
    if reach.open_joint:
        return f"does not close: {gap_words(reach, 0)}"
    if not reach.turns:
        return f"the crank does not turn through: {_range(reach)}"
    return "closes, and the crank turns through" if not reach.fault else "closes far from the given start"


def findings(reach: Reach) -> tuple[str, ...]:
    """Description of the faults, one sentence each with numbers; empty for a mechanism that works."""
    found = [*_mobility(reach), *_open_words(reach), *_turns(reach)]
    if reach.fault:
        found.append(f"assembly.{reach.fault}")
    doubts = suspects(reach.mechanism)
    return (*found[:-1], found[-1] + doubts) if found else ()


def gap_words(reach: Reach, i: int) -> str:
    """The gap of the open joint at position ``i``."""
    joint = reach.mechanism.joint_words(reach.open_joint)
    return f"joint {joint} is open by {1e3 * reach.gap_m[i]:.3g} mm"


def loop_of(mechanism: Mechanism, joint: str) -> tuple[str, ...]:
    """Bodies of the shortest loop through a joint, from one of its bodies to the other; empty without one."""
    first, last = mechanism.sides(joint)
    ways: deque[tuple[str, ...]] = deque([(first,)])
    seen = {first}
    while ways:
        way = ways.popleft()
        if way[-1] == last:
            return way
        for other in mechanism.joints:
            sides = mechanism.sides(other)
            if other != joint and way[-1] in sides:
                body = sides[1] if sides[0] == way[-1] else sides[0]
                if body not in seen:
                    seen.add(body)
                    ways.append((*way, body))
    return ()


def _mobility(reach: Reach) -> list[str]:
    if reach.mobility == 1:
        return []
    bodies, joints = len(reach.mechanism.bodies), len(reach.mechanism.joints)
    sum_ = f"3 x {bodies} bodies - 2 x {joints} joints"
    more = "a joint is missing" if reach.mobility > 1 else "a joint is too many, or a body is missing"
    return [f"joints: mobility is {reach.mobility} ({sum_}). Expected 1: {more}"]


def _open_words(reach: Reach) -> list[str]:
    if not reach.open_joint:
        return []
    mechanism, least = reach.mechanism, int(reach.gap_m.argmin())
    bodies = " and ".join(mechanism.sides(reach.open_joint))
    text = (
        f"assembly: {gap_words(reach, 0)} between {bodies} at crank angle {_degrees(reach.crank_angle[0])}, "
        "with all other joints closed"
    )
    if reach.low is not None:
        text += f"; it closes only {_range(reach)}"
    else:
        angle = _degrees(reach.crank_angle[least] % TURN)
        text += f"; the least gap is {1e3 * reach.gap_m[least]:.3g} mm, at {angle}"
    if loop := loop_of(mechanism, reach.open_joint):
        text += f"; check the lengths of {', '.join(loop)}"
    return [text]


def _turns(reach: Reach) -> list[str]:
    if reach.open_joint or reach.low is None:
        return []
    return [f"drive.body: {reach.mechanism.drive.body} turns only {_range(reach)}, between two dead points"]


def _range(reach: Reach) -> str:
    if reach.low is None or reach.high is None:
        return ""
    low, high = reach.low.crank_angle, reach.high.crank_angle
    return f"from {_degrees(low)} to {_degrees(high)}, {np.rad2deg(high - low):.1f} of 360 deg"


def _degrees(angle: float) -> str:
    return f"{np.rad2deg(angle):.1f} deg"
