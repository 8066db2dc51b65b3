"""Positions of a mechanism over its crank's range: all of them where it works, what there is where not."""

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats, com_poses, compile_arrays
from leg_wear_monitor.mechanism.constraints import select_rows
from leg_wear_monitor.mechanism.continuation import follow, furthest
from leg_wear_monitor.mechanism.ideal import TURN, point_path
from leg_wear_monitor.mechanism.position import (
    Linkage,
    all_but,
    far_from_start,
    find_assembly,
    mobility,
    nearest,
    newton,
    open_joint,
)
from leg_wear_monitor.mechanism.reach.dead_point import DeadPoint, dead_point
from leg_wear_monitor.mechanism.spec import Mechanism, PrismaticJoint

POINTS = 180  # a cycle: smooth to the eye
_OPEN_POINTS = 72  # of an open mechanism, whose positions take long
_VISIBLE = 0.02  # of the largest gap
_CLOSED = 1.0e-9  # gap [m] below which a joint counts as closed


@attrs.frozen(eq=False)
class Reach:
    """Positions of a mechanism, working or not, with all joints ideal.

    Attributes
    ----------
    linkage : Linkage
    mobility : int
        Degrees of freedom; 1 for a mechanism with one drive. With another, there is one position.
    crank_angle : (p,) array, rad
        Rising; a whole turn from 0 if the crank turns through.
    q : (p, n, 3) array
        Coordinates at these angles. Where the mechanism does not close, those with the least gap.
    turns : bool
        Whether it closes all over a turn of the crank.
    open_joint : str
        Joint that does not close at the crank angle of the assembly, with all others closed; empty if all
        close there.
    gap_m : (p,) array
        Gap of this joint.
    low, high : DeadPoint or None
        Ends of the range in which it closes; None if the crank turns through, or it never closes.
    fault : str
        What is wrong with the assembly found; empty if nothing is.
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
        """Whether the two points of a joint are visibly apart in a mechanism that does not close."""
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
        An angle [rad] that is to be among those of the result, if the crank reaches it.
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
    with np.errstate(all="ignore"):  # what comes of it is looked at
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
    high = dead_point(linkage, last, there)
    low = dead_point(linkage, *furthest(linkage, q, angle, angle - TURN))
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
    """Ends of the range of crank angles in which the joint that is open at the start closes."""
    i = int(gaps.argmin())
    angle = float(reach.crank_angle[i])
    q = newton(linkage, reach.q[i], angle) if gaps[i] < _CLOSED else None
    if q is None:
        return None, None
    ends = (furthest(linkage, q, angle, angle + side * TURN) for side in (-1.0, 1.0))
    low, high = (dead_point(linkage, *end) for end in ends)
    return low, high
