"""Range of the linkage: where it closes, and how far its crank turns."""

from collections import deque

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats, com_poses, compile_arrays
from leg_wear_monitor.mechanism.constraints import select_rows
from leg_wear_monitor.mechanism.loader import suspects
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    far_from_start,
    find_assembly,
    follow,
    furthest,
    mobility,
    nearest,
    open_joint,
    point_path,
)
from leg_wear_monitor.mechanism.spec import Mechanism, PrismaticJoint

# Positions of a mechanism over its crank's range: all of them if it works, the possible ones if not.


POINTS = 180  # positions per cycle, enough to look smooth
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
        Rising; a whole turn from 0 if the crank turns through, else between two dead points, which the crank
        cannot pass.
    q : (p, n, 3) array
        Coordinates at these angles; the coordinates with the least gap if the mechanism does not close.
    turns : bool
        True if it closes all over a turn of the crank.
    open_joint : str
        Joint that does not close at the crank angle of the assembly, with all others closed; empty if all
        close there.
    gap_m : float
        Gap of this joint.
    fault : str
        Fault of the assembly; empty if there is none.
    """

    linkage: Linkage
    mobility: int
    crank_angle: Floats
    q: Floats
    turns: bool = False
    open_joint: str = ""
    gap_m: float = 0.0
    fault: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return self.linkage.mechanism

    @property
    def rocks(self) -> bool:
        """True if it closes between two dead points only."""
        return not self.turns and len(self.q) > 1

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


def reach_of(mechanism: Mechanism) -> Reach:
    """Positions of a mechanism over the range of its crank.

    Raises
    ------
    AssemblyError
        If its lengths are too far apart for numbers.
    """
    arrays = compile_arrays(mechanism)
    linkage = Linkage(mechanism, arrays, select_rows(arrays, range(len(mechanism.joints)), driven=True))
    with np.errstate(all="ignore"):  # the result is checked below
        reach = _reach(linkage)
    if not np.isfinite(reach.q).all():
        raise AssemblyError(f"{mechanism.source}: bodies: lengths are too far apart to place the bodies")
    return reach


def _reach(linkage: Linkage) -> Reach:
    freedom, start = mobility(linkage.mechanism), linkage.mechanism.assembly.crank_angle
    if freedom != 1:
        q = nearest(linkage, com_poses(linkage.mechanism), start, np.ones(len(linkage.rows.body)))
        return Reach(linkage, freedom, np.array([start]), q[None])
    found = find_assembly(linkage)
    if found is None:
        joint, gap_m, q = open_joint(linkage)
        return Reach(linkage, 1, np.array([start]), q[None], open_joint=joint, gap_m=gap_m)
    return attrs.evolve(_closed(linkage, found, start), fault=far_from_start(linkage, found))


def _closed(linkage: Linkage, q: Floats, angle: float) -> Reach:
    """Reach of a linkage that closes at a crank angle [rad] with coordinates q."""
    high, at_high = furthest(linkage, q, angle, angle + TURN)
    if high == angle + TURN:
        angles = np.asarray(np.arange(POINTS) * (TURN / POINTS), np.float64)
        return Reach(linkage, 1, angles, _followed(linkage, q, angle, angles), turns=True)
    low, at_low = furthest(linkage, q, angle, angle - TURN)
    angles = np.asarray(np.linspace(low, high, POINTS), np.float64)
    between = _followed(linkage, q, angle, angles[1:-1])
    return Reach(linkage, 1, angles, np.stack([at_low, *between, at_high]))


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


# Faults of a mechanism that does not close or turn, in words.


def headline(reach: Reach) -> str:
    """In a few words, whether the mechanism works."""
    if reach.mobility != 1:
        return f"mobility is {reach.mobility}. Expected 1"
    if reach.open_joint:
        return f"does not close: {_gap(reach)}"
    if reach.rocks:
        return f"the crank does not turn through: {_range(reach)}"
    return "closes, and the crank turns through" if not reach.fault else "closes far from the given start"


def findings(reach: Reach) -> tuple[str, ...]:
    """Description of the faults, one sentence each with numbers; empty for a mechanism that works."""
    found = [*_mobility(reach), *_open_words(reach), *_turns(reach)]
    if reach.fault:
        found.append(f"assembly.{reach.fault}")
    doubts = suspects(reach.mechanism)
    return (*found[:-1], found[-1] + doubts) if found else ()


def _gap(reach: Reach) -> str:
    joint = reach.mechanism.joint_words(reach.open_joint)
    return f"joint {joint} is open by {1e3 * reach.gap_m:.3g} mm"


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
    mechanism = reach.mechanism
    bodies = " and ".join(mechanism.sides(reach.open_joint))
    angle = f"{np.rad2deg(reach.crank_angle[0]):.1f} deg"
    text = f"assembly: {_gap(reach)} between {bodies} at crank angle {angle}, with all other joints closed"
    if loop := loop_of(mechanism, reach.open_joint):
        text += f"; check the lengths of {', '.join(loop)}"
    return [text]


def _turns(reach: Reach) -> list[str]:
    if not reach.rocks:
        return []
    return [f"drive.body: {reach.mechanism.drive.body} turns only {_range(reach)}, between two dead points"]


def _range(reach: Reach) -> str:
    low, high = np.rad2deg(reach.crank_angle[[0, -1]])
    return f"from {low:.1f} deg to {high:.1f} deg, {high - low:.1f} of 360 deg"
