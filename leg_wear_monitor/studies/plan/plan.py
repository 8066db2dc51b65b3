"""From a study's description to its points."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import attrs

from leg_wear_monitor.studies.plan.settings import (
    Bifurcation,
    Chaos,
    Ensemble,
    Laws,
    Location,
    Multi,
    Size,
    Speed,
    Study,
    Wear,
)
from leg_wear_monitor.studies.point import Point

_Place = dict[str, Any]

PORTRAIT_CYCLES = 6

_EACH_JOINT = 0.7  # cost of a further clearance joint, in that of the first
_LIKELY_JUMPS = 2.7  # of a life, for each time that the longest one is in the mean opening
_MOMENTS = 20.0  # cost of watching a cycle, in that of a cycle of one clearance joint


def set_name(clearance_joints: Sequence[str]) -> str:
    """Name of a set of clearance joints."""
    return ", ".join(clearance_joints)


def millimetres(clearance_m: float) -> str:
    """A clearance for people."""
    return f"{1.0e3 * clearance_m:g} mm"


def points_of(settings: Study) -> list[Point]:
    """Points of a study, in the order in which they are shown; two may be one and the same."""
    return _PLANS[type(settings)](settings)


def _place(clearance_joints: Sequence[str], clearance_m: float, speed_rpm: float, **more: Any) -> _Place:
    return {
        "clearance_joints": list(clearance_joints),
        "clearance_m": clearance_m,
        "speed_rpm": speed_rpm,
        **more,
    }


def _cycle_cost(clearance_joints: Sequence[str], speed_rpm: float) -> float:
    return (1.0 + _EACH_JOINT * (len(clearance_joints) - 1)) * math.sqrt(60.0 / speed_rpm)


def _response(label: str, place: _Place, ensemble: Ensemble) -> Point:
    cycles = ensemble.cycles + ensemble.skip_cycles
    each = (
        cycles * _cycle_cost(place["clearance_joints"], place["speed_rpm"])
        + _MOMENTS * ensemble.traced_cycles
    )
    settings = place | attrs.asdict(ensemble)
    return Point(label=label, task="response", settings=settings, cost=ensemble.runs * each)


def _size(study: Size) -> list[Point]:
    return [
        _response(millimetres(clearance), _place(study.joints, clearance, study.speed_rpm), study.ensemble)
        for clearance in study.clearances_m
    ]


def _speed(study: Speed) -> list[Point]:
    return [
        _response(f"{speed:g} rpm", _place(study.joints, study.clearance_m, speed), study.ensemble)
        for speed in study.speeds_rpm
    ]


def _location(study: Location) -> list[Point]:
    return [
        _response(
            set_name(clearance_joints),
            _place(clearance_joints, study.clearance_m, study.speed_rpm),
            study.ensemble,
        )
        for clearance_joints in study.sets
    ]


def _multi(study: Multi) -> list[Point]:
    """The sets, and last all of their joints at once."""
    everything = list(dict.fromkeys(joint for clearance_joints in study.sets for joint in clearance_joints))
    place = _place(everything, study.clearance_m, study.speed_rpm)
    return [*_location(study), _response(set_name(everything), place, study.ensemble)]


def _wear(study: Wear) -> list[Point]:
    """The response of every set, and its life."""
    lives = []
    for clearance_joints in study.sets:
        settings = _place(
            clearance_joints, study.clearance_m, study.speed_rpm, **attrs.asdict(study.life),
            perturb_fraction=study.ensemble.perturb_fraction, seed=study.ensemble.seed,
        )  # fmt: skip
        cycles = _LIKELY_JUMPS * study.life.opens_m / study.life.jump_m * (study.life.cycles + 1)
        cost = study.life.runs * cycles * _cycle_cost(clearance_joints, study.speed_rpm)
        lives.append(Point(label=set_name(clearance_joints), task="life", settings=settings, cost=cost))
    return _location(study) + lives


def _laws(study: Laws) -> list[Point]:
    def point(label: str, **more: Any) -> Point:
        place = _place(study.joints, study.clearance_m, study.speed_rpm, **more)
        return _response(label, place, study.ensemble)

    points = [point(law, normal_law=law) for law in study.normal_laws]
    points += [point(f"friction {law}", friction={"law": law}) for law in study.friction_laws]
    return points + [
        point(f"friction coefficient {value:g}", friction={"coefficient": value})
        for value in study.friction_coefficients
    ]


def _chaos(study: Chaos) -> list[Point]:
    start = {"perturb_fraction": study.ensemble.perturb_fraction, "seed": study.ensemble.seed}
    whole = _place(study.joints, study.clearance_m, study.speed_rpm)
    points = [_response(set_name(study.joints), whole, study.ensemble)]
    points.append(_section("section", whole | start, study, study.section_cycles, PORTRAIT_CYCLES))
    for clearance_joints in (study.joints, *study.others):
        place = (
            _place(clearance_joints, study.clearance_m, study.speed_rpm)
            | start
            | attrs.asdict(study.exponent)
        )
        place["skip_cycles"] = study.ensemble.skip_cycles
        cost = (
            2.0 * study.exponent.runs * study.exponent.cycles * _cycle_cost(clearance_joints, study.speed_rpm)
        )
        points.append(
            Point(label=set_name(clearance_joints), task="exponent", settings=place, cost=3.0 * cost)
        )
    return points + _bifurcation(study, study.bifurcation, start)


def _section(label: str, place: _Place, study: Chaos, cycles: int, portrait_cycles: int = 0) -> Point:
    settings = place | {
        "cycles": cycles,
        "portrait_cycles": portrait_cycles,
        "skip_cycles": study.bifurcation.skip_cycles,
        "crank_angle_deg": study.section_crank_angle_deg,
        "runs": 1,
    }
    cost = (cycles + study.bifurcation.skip_cycles) * _cycle_cost(
        place["clearance_joints"], place["speed_rpm"]
    )
    return Point(label=label, task="section", settings=settings, cost=cost)


def _bifurcation(study: Chaos, over: Bifurcation, start: _Place) -> list[Point]:
    sizes = [
        (millimetres(clearance), _place(study.joints, clearance, study.speed_rpm))
        for clearance in over.clearances_m
    ]
    speeds = [(f"{speed:g} rpm", _place(study.joints, study.clearance_m, speed)) for speed in over.speeds_rpm]
    return [_section(label, place | start, study, over.cycles) for label, place in sizes + speeds]


_PLANS: dict[type[Study], Callable[[Any], list[Point]]] = {
    Size: _size,
    Speed: _speed,
    Location: _location,
    Multi: _multi,
    Wear: _wear,
    Laws: _laws,
    Chaos: _chaos,
}
