"""A person on the leg: the weight of a leg by Winter, and the reaction of the ground on the foot."""

import csv
import math
import warnings
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, ConfigWarning
from leg_wear_monitor.files import number_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, Linkage, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import GROUND, Body, Load, Mechanism, Vector

# A person's leg that hangs on a linkage: segments added to its thigh, shank and foot (physics.md section 9).
#
# Segments by Winter, *Biomechanics and Motor Control of Human Movement*. Masses are relative to the body's
# mass. The distance of the centre of mass from the proximal joint, and the radius of gyration about the
# centre of mass, are relative to the length of the segment.


PERSON_TOLERANCE = 0.2  # tolerance of a person's mass as a fraction, for food, clothes and loads


# mass, distance of the centre of mass, radius of gyration
SEGMENTS = {"thigh": (0.100, 0.433, 0.323), "shank": (0.0465, 0.433, 0.302), "foot": (0.0145, 0.500, 0.475)}


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
        If the mechanism lacks such bodies, joints or toe.

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


def _with(
    body: Body, segment: tuple[float, float, float], person_kg: float, upper: Vector, lower: Vector
) -> Body:
    """A body with a segment between two of its points."""
    fraction, away, gyration = segment
    mass, length = fraction * person_kg, math.dist(upper, lower)
    centre = [a + away * (b - a) for a, b in zip(upper, lower, strict=True)]
    whole = body.mass + mass
    x, y = ((body.mass * a + mass * b) / whole for a, b in zip(body.com, centre, strict=True))
    inertia = body.inertia + mass * (gyration * length) ** 2
    inertia += body.mass * mass / whole * math.dist(body.com, centre) ** 2
    return attrs.evolve(body, mass=whole, inertia=inertia, com=(x, y))


# Force of the ground on the toe: a template of human stance over the gait cycle (physics.md section 9).
#
# The vertical force is the mean of two measured overground stances (opensim-models, Gait2354_Simbody,
# subject01_walk1_grf.mot); the fore-aft force brakes in the first half of stance and pushes in the second
# one.


PHASES = 128  # entries of a load's table; a divisor of the number of points of the leg's tables
FORE_AFT = 0.145  # mean of the peaks of braking and of pushing, over the peak of the vertical force

# coefficients of sin(k pi s), with s from 0 to 1 over stance
_VERTICAL = (1.143, -0.042, 0.337, 0.0, -0.0125, -0.016, -0.0655, 0.0105)
_STANCE = 0.8  # middle part of the toe's way backwards that is stance
_POINTS = 1024

GROUND_LOAD = "ground"  # name of the load in a mechanism

_OF_FORCE = ("crank_angle", "foot_load", "foot_load_along")  # columns of a file with the force on the toe
_LEAST_ROWS = 11  # after the first one
USUAL_PEAK_N = 10.0, 5000.0  # bounds of the vertical force: a child's step, and a running person of 150 kg


@attrs.frozen
class Stance:
    """When and where the foot stands.

    Attributes
    ----------
    heel_strike, toe_off : float
        Crank angle at its begin and at its end, as a fraction of a turn.
    turned : float
        1 where the crank angle increases in time, -1 otherwise.
    up, back : (2,) arrays
        Unit vectors: upwards, and horizontally as the toe moves in stance.
    """

    heel_strike: float
    toe_off: float
    turned: float
    up: Floats
    back: Floats

    def force(self, fore_aft: float = FORE_AFT, points: int = PHASES) -> Floats:
        """Force (points, 2) at equal steps of the crank angle from 0, per newton of the vertical peak.

        Parameters
        ----------
        fore_aft : float, optional
            Largest fore-aft force, over the largest vertical one.
        points : int, optional
        """
        vertical, along = stance_template(self.fractions(points))
        return np.outer(vertical, self.up) + fore_aft * np.outer(along, self.back)

    def fractions(self, points: int = PHASES) -> Floats:
        """Fractions (points,) of stance at equal steps of the crank angle from 0; above 1 it is over."""
        whole = (self.turned * (self.toe_off - self.heel_strike)) % 1.0
        since = (self.turned * (np.arange(points) / points - self.heel_strike)) % 1.0
        return np.asarray(since / whole)


def stance_template(s: Floats) -> tuple[Floats, Floats]:
    """Vertical and fore-aft force (n,) over their peaks, at fractions (n,) of stance; 0 beyond 1.

    The fore-aft force is positive where it points as the toe moves: it brakes.
    """
    vertical, in_stance = _vertical(s), s <= 1.0
    return np.where(in_stance, vertical / _PEAK, 0.0), np.where(in_stance, np.sin(TURN * s), 0.0)


def nominal_stance(linkage: Linkage) -> Stance:
    """Stance by the toe's motion: the middle part of its way backwards, on which its lowest point is.

    Raises
    ------
    ConfigError
        If the mechanism has no toe, or a toe that does not move to and fro.
    """
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        raise ConfigError(mechanism.source, "bodies", "has no point called toe for the ground to push")
    up = upwards(mechanism)
    across = np.array([up[1], -up[0]])
    position, velocity, _ = point_motion(one_cycle(linkage, _POINTS, 1.0), linkage, *mechanism.toe)
    lowest = int((position @ up).argmin())
    along = np.roll(velocity @ across, -lowest)
    back = np.sign(along[0])
    forth = np.flatnonzero(back * along <= 0.0)
    if not forth.size:
        raise ConfigError(mechanism.source, "bodies", "has a toe that does not move back and forth")
    end, begin = int(forth[0]), int(forth[-1]) - _POINTS
    middle, half = lowest + 0.5 * (begin + end), 0.5 * _STANCE * (end - begin)
    ends = [float(at / _POINTS % 1.0) for at in (middle - half, middle + half)]
    turned = float(np.sign(getattr(mechanism.drive, "speed", 1.0)) or 1.0)
    heel_strike, toe_off = ends if turned > 0.0 else reversed(ends)
    return Stance(heel_strike, toe_off, turned, up, turned * back * across)


def read_toe_force(path: Path) -> Floats:
    """Force of the ground on the toe (PHASES, 2) [N] of a CSV file with one gait cycle.

    Its columns are the same as in a table for `replay`: ``crank_angle`` [rad], ``foot_load`` (up) and
    optionally ``foot_load_along`` (along x) [N]. Between its rows the force is linear.

    Warns of a force that is far outside the usual.

    Raises
    ------
    ConfigError
        If the file cannot be read, lacks a column, has a value that is not a finite number, has a crank that
        does not turn once in one direction, without wide gaps, or a ground that pulls.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(str(path), "", f"cannot be read: {reason}") from error
    angle, up, along = (_column(path, rows, name) for name in _OF_FORCE)
    way = np.diff(angle)
    if len(way) < _LEAST_ROWS or not ((way > 0.0).all() or (way < 0.0).all()) or np.ptp(angle) > TURN:
        fault = (
            f"too few rows, or not in order. Expected {_LEAST_ROWS + 1} or more of one gait cycle, by angle"
        )
        raise ConfigError(str(path), _OF_FORCE[0], fault)
    widest = max(float(np.abs(way).max()), TURN - float(np.ptp(angle)))
    if widest > TURN / _LEAST_ROWS:
        fault = f"no rows over {widest:.3g} rad of the turn. Expected at most {TURN / _LEAST_ROWS:.2g} rad"
        raise ConfigError(str(path), _OF_FORCE[0], fault)
    peak_n, (least_n, most_n) = float(up.max()), USUAL_PEAK_N
    if peak_n <= -float(up.min()):
        fault = f"{peak_n:.3g} N at most and {up.min():.3g} N at least. Expected a ground that pushes up"
        raise ConfigError(str(path), _OF_FORCE[1], fault)
    if not least_n <= peak_n <= most_n:
        fault = f"{peak_n:.3g} N at most, usually {least_n:g} to {most_n:g} N. Is it in a different unit?"
        warnings.warn(f"{path}: {_OF_FORCE[1]}: {fault}", ConfigWarning, stacklevel=2)
    at = np.arange(PHASES) * (TURN / PHASES)
    return np.stack([np.interp(at, angle, force, period=TURN) for force in (along, up)], axis=1)


def _column(path: Path, rows: Sequence[Mapping[str, str]], name: str) -> Floats:
    """Column of a table with a toe's force (n,); 0 if the optional column is missing."""
    if rows and name not in rows[0]:
        if name == _OF_FORCE[-1]:
            return np.zeros(len(rows))
        raise ConfigError(str(path), name, f"unknown column. The file has {', '.join(rows[0])}")
    found = np.array([number_of(row[name]) for row in rows], float)
    for i in np.flatnonzero(~np.isfinite(found)).tolist():
        raise ConfigError(str(path), name, f"row {i + 1}: {rows[i][name]!r} is not a finite number")
    return found


def upwards(mechanism: Mechanism) -> Floats:
    """Unit vector (2,) opposite to gravity; the y axis without gravity."""
    gravity = np.array(mechanism.gravity)
    size = float(np.hypot(*gravity))
    return -gravity / size if size > 0.0 else np.array([0.0, 1.0])


def with_toe_force(mechanism: Mechanism, force: Floats, name: str = GROUND_LOAD) -> Mechanism:
    """The mechanism with a force (n, 2) [N] on its toe, at equal steps of the crank angle from 0.

    A load of the same name that it had is replaced.

    Raises
    ------
    ConfigError
        If the mechanism has no toe.
    """
    if mechanism.toe is None:
        raise ConfigError(mechanism.source, "bodies", "has no point called toe for the ground to push")
    body, point = mechanism.toe
    phases = tuple((np.arange(len(force)) / len(force)).tolist())
    load = Load(body=body, point=point, phase=phases, force=tuple((float(x), float(y)) for x, y in force))
    return attrs.evolve(mechanism, loads={**mechanism.loads, name: load})


def with_ground_reaction(mechanism: Mechanism, peak_n: float) -> Mechanism:
    """The mechanism under the force of the ground on its toe, in the stance of a person.

    Parameters
    ----------
    mechanism : Mechanism
        A load named *ground* that it has is replaced.
    peak_n : float
        Largest vertical force [N].

    Raises
    ------
    ConfigError
        If the mechanism has no toe that moves to and fro.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> leg = lw.with_ground_reaction(lw.load_mechanism("bionic_leg"), 300.0)
    >>> round(max(up for _, up in leg.loads["ground"].force))
    300
    """
    return with_toe_force(mechanism, peak_n * nominal_stance(build_linkage(mechanism)).force())


def _vertical(s: Floats) -> Floats:
    order = np.arange(1, len(_VERTICAL) + 1)
    return np.asarray(np.sin(0.5 * TURN * np.multiply.outer(s, order)) @ np.array(_VERTICAL))


_PEAK = float(_vertical(np.linspace(0.0, 1.0, 2001)).max())
