"""Doubtful values of a mechanism: valid, but far outside the usual range, likely in a wrong unit.

Values that are unusual by themselves are declared with their bounds. This module checks values that are
unusual in relation to other values.

The ranges are wide: the shipped mechanisms, from Andrews' squeezer with links of 7 mm to a leg, lie well
within.
"""

import math
from collections.abc import Iterator
from itertools import islice

import attrs

from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.configuration import doubts as unusual
from leg_wear_monitor.mechanism import spec
from leg_wear_monitor.mechanism.materials import lacks_wear, spread_of
from leg_wear_monitor.mechanism.position import TURN

_USUAL_LENGTH = 5.0e-3, 5.0  # m, of the largest link
_LEAST_SPREAD = 0.3  # of ln k: repeats of one careful test scatter by 0.1 to 0.3, parts by more
_ROUND = 1.0e-3  # rpm: a converted speed in rad/s is within this of a whole number of rpm


def doubts(mechanism: spec.Mechanism) -> tuple[Doubt, ...]:
    """All doubtful values of a mechanism, the most significant first."""
    parts = (_lengths, _angles, _speed, _masses, _gravity, _joints, _loads)
    return tuple(doubt for part in parts for doubt in part(mechanism))


def suspects(mechanism: spec.Mechanism) -> str:
    """End of an error message about a mechanism that cannot move: its doubtful values; empty without any."""
    found = [str(doubt) for doubt in doubts(mechanism)]
    return f"; look at {'; '.join(found)}" if found else ""


def span(points: dict[str, spec.Vector]) -> float:
    """Longest distance between two points [m], 0 without two."""
    return max((math.dist(a, b) for a in points.values() for b in points.values()), default=0.0)


def largest_link(mechanism: spec.Mechanism) -> tuple[str, float]:
    """The body with the longest distance between two of its points, and that distance [m]."""
    spans = {name: span(body.points) for name, body in mechanism.bodies.items()}
    name = max(spans, key=lambda body: spans[body])
    return name, spans[name]


def _beyond(value: float, least: float, most: float) -> bool:
    return not least <= abs(value) <= most


def _lengths(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    name, length = largest_link(mechanism)
    if _beyond(length, *_USUAL_LENGTH):
        slip = "mm" if length > 5.0 else "km"
        yield Doubt(
            f"bodies.{name}.points",
            f"{length:g} m from point to point, usually 0.005 to 5 m. Is it in {slip}?",
        )
        return
    for name, body in mechanism.bodies.items():
        away = math.hypot(*body.com)
        if away > 20.0 * max(span(body.points), 0.05 * length):
            yield Doubt(
                f"bodies.{name}.com", f"{away:g} m away from a link that is much shorter. Is it in mm?"
            )


def _angles(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    angles = {"crank_angle": mechanism.assembly.crank_angle}
    angles |= {body: pose[2] for body, pose in mechanism.assembly.poses.items()}
    name = max(angles, key=lambda each: abs(angles[each]))  # if one angle is in degrees, all angles are
    if _beyond(angles[name], 0.0, TURN):
        turns = angles[name] / TURN
        yield Doubt(f"assembly.{name}", f"{angles[name]:g} rad is {turns:.3g} turns. Is it in degrees?")


def _speed(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    drive = mechanism.drive
    if isinstance(drive, spec.TorqueDrive):
        yield from unusual(drive, "drive.")
        return
    key, speed = "drive.speed", drive.speed if isinstance(drive, spec.SpeedDrive) else drive.track.speed_radps
    if not isinstance(drive, spec.SpeedDrive):
        key = "drive.track.speed_radps"
    rpm = 60.0 * speed / TURN
    # a speed that was converted is a whole number of rpm; one that is a whole number of rad/s may be rpm
    if _beyond(speed, 0.0, 20.0) and speed == round(speed) and abs(rpm - round(rpm)) > _ROUND:
        meant = f"{speed:g} rpm is {speed * TURN / 60.0:.6g} rad/s"
        yield Doubt(key, f"{speed:g} rad/s is {rpm:.4g} rpm. Is it in rpm? {meant}")
    elif _beyond(rpm, 0.1, 30_000.0):
        yield Doubt(key, f"{speed:g} rad/s is {rpm:.3g} rpm, usually 0.1 to 30000 rpm")


def _masses(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    heaviest = max(mechanism.bodies, key=lambda name: mechanism.bodies[name].mass)
    yield from unusual(mechanism.bodies[heaviest], f"bodies.{heaviest}.")
    length = largest_link(mechanism)[1]
    if not _beyond(length, *_USUAL_LENGTH):
        each = (doubt for name, body in mechanism.bodies.items() for doubt in _inertia(name, body, length))
        yield from islice(each, 1)


def _inertia(name: str, body: spec.Body, length: float) -> Iterator[Doubt]:
    """Doubt about an inertia with a radius of gyration above 10 or below 0.001 times the largest link."""
    gyration = math.sqrt(body.inertia / body.mass)
    if _beyond(gyration, 1.0e-3 * length, 10.0 * length):
        slip = "kg mm^2" if gyration > length else "t m^2"
        yield Doubt(
            f"bodies.{name}.inertia",
            f"{body.inertia:g} kg m^2 of {body.mass:g} kg is a radius of gyration of {gyration:.3g} m with "
            f"links of {length:.3g} m. Is it in {slip}?",
        )


def _gravity(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    pull = math.hypot(*mechanism.gravity)
    if pull > 30.0:
        yield Doubt("gravity", f"{pull:g} m/s^2, on earth it is 9.81 m/s^2. Is it in mm/s^2?")


def _joints(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    """Doubts about clearance settings, each with all joints concerned: most come from the defaults."""
    concerned: dict[Doubt, list[str]] = {}
    for joint, clearance in mechanism.clearances.items():
        for doubt in _clearance(clearance):
            concerned.setdefault(doubt, []).append(joint)
    for doubt, joints in concerned.items():
        yield attrs.evolve(doubt, key=f"clearances ({', '.join(joints)}): {doubt.key}")


def _clearance(c: spec.Clearance) -> Iterator[Doubt]:
    yield from unusual(c)
    if fault := ratio_fault(c.radial_clearance, c.bushing_radius):
        yield Doubt("radial_clearance", fault)
    if lacks_wear(c):
        fault = (
            "gives no wear coefficient, so the joint does not wear. Expected "
            "wear_coefficient next to material"
        )
        yield Doubt("material", f"{c.material} {fault}")
    spread = spread_of(c, math.inf)
    if spread is not None and spread < _LEAST_SPREAD:
        fault = f"spread {spread:.2g} of {c.material} is below {_LEAST_SPREAD}. Is it the spread of repeats?"
        yield Doubt("material", fault)


def ratio_fault(clearance_m: float, radius_m: float) -> str | None:
    """Doubt about a radial clearance [m] relative to its bushing's radius [m]; None if it is usual."""
    ratio = clearance_m / radius_m
    if not _beyond(ratio, 1.0e-5, 0.25):
        return None
    return (
        f"{clearance_m:g} m is {100.0 * ratio:.3g} % of the bushing's radius of {radius_m:g} m, "
        "usually 0.01 to 5 %. Is it in a different unit than the radius?"
    )


def _loads(mechanism: spec.Mechanism) -> Iterator[Doubt]:
    for name, load in mechanism.loads.items():
        forces = load.force if isinstance(load, spec.PhaseLoad) else (load.force,)
        force = max((math.hypot(*each) for each in forces), default=0.0)
        if force > 1.0e5:
            yield Doubt(f"loads.{name}.force", f"{force:g} N, usually below 1e5 N. Is it in mN?")


# Valid ranges of clearances and their limits, with a hint at the likely wrong unit of an invalid value.


LEAST_FRACTION = 0.01  # least measured clearance over the new one: wear widens it, so less is a typing error
LEAST_SIGMA_M = 1.0e-7  # least standard deviation: no clearance gauge resolves 0.1 um

_SLIPS = (1.0e-3, 1.0e3, 1.0e-6, 1.0e6)  # factors of wrong units: mm for m, m for mm, um for m, m for um


def limit_fault(joint: str, fresh_m: float, radius_m: float, limit_m: float) -> str | None:
    """Error message for an invalid limit of a joint's mean radial clearance.

    Parameters
    ----------
    joint : str
    fresh_m, radius_m : float
        Clearance when new and radius of the bushing: the limit must lie between them.
    limit_m : float

    Returns
    -------
    str or None
        None if the limit is valid.
    """
    if fresh_m < limit_m < radius_m:
        return None
    meant = _meant(limit_m, fresh_m, radius_m)
    hint = "" if meant is None else f"; did you mean {meant:g} m ({1.0e3 * meant:g} mm)?"
    return (
        f"{limit_m:g} m is not between {fresh_m:g} m, the new clearance of joint {joint}, "
        f"and {radius_m:g} m, the radius of its bushing{hint}"
    )


def measured_fault(joint: str, fresh_m: float, radius_m: float, measured_m: float) -> str | None:
    """Error message for an invalid measured radial clearance [m]; otherwise as `limit_fault`."""
    least_m = LEAST_FRACTION * fresh_m
    if least_m <= measured_m <= radius_m:
        return None
    meant = _meant(measured_m, least_m, radius_m)
    hint = "" if meant is None else f"; did you mean {1.0e3 * meant:g} mm?"
    return (
        f"{1.0e3 * measured_m:g} mm is not between {1.0e3 * least_m:g} mm, {100.0 * LEAST_FRACTION:g} % of "
        f"the new clearance of joint {joint}, and {1.0e3 * radius_m:g} mm, the radius of its bushing{hint}"
    )


def sigma_fault(measured_m: float, sigma_m: float) -> str | None:
    """Error message for an invalid standard deviation [m] of a measured clearance; None if it is valid."""
    if LEAST_SIGMA_M <= sigma_m <= measured_m:
        return None
    meant = _meant(sigma_m, LEAST_SIGMA_M, measured_m)
    hint = "" if meant is None else f"; did you mean {1.0e3 * meant:g} mm?"
    bounds = f"from {1.0e3 * LEAST_SIGMA_M:g} mm to {1.0e3 * measured_m:g} mm, the measured clearance"
    return f"{1.0e3 * sigma_m:g} mm is not a standard deviation {bounds}{hint}"


def _meant(value_m: float, above_m: float, below_m: float) -> float | None:
    """The value [m] after a unit mistake is undone, if it lies between the bounds; None if none does."""
    return next((value_m * slip for slip in _SLIPS if above_m < value_m * slip < below_m), None)
