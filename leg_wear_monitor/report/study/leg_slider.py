"""Interactive picture of the leg over a gait cycle: contact forces, and each journal in its bushing."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import IdealMotion, one_cycle, point_motion
from leg_wear_monitor.mechanism.outline import corners
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.report.figures.figure import BODY_COLOURS
from leg_wear_monitor.report.page import render, template_text
from leg_wear_monitor.report.parts import Live
from leg_wear_monitor.report.study.text import Labelled
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import clearance_joints_of

CLEARANCE_FRACTION = 0.3  # drawn clearance, as a fraction of the bushing's radius
_ARROW_FRACTION = 0.3  # length of the longest arrow, as a fraction of the leg's height


def leg_slider(mechanism: Mechanism, runs: Labelled, clearances_m: Sequence[float], speed_rpm: float) -> Live:
    """Interactive picture of the leg with one cycle of an example run of each point.

    Parameters
    ----------
    mechanism : Mechanism
    runs : sequence of (label, arrays)
        Results of `leg_wear_monitor.studies.tasks.response.run_ensemble`.
    clearances_m : sequence of float
        Radial clearance of each run [m].
    speed_rpm : float
        Crank speed [rpm]; the drawn positions are ideal and depend on its sign only.

    Returns
    -------
    Live
    """
    linkage = build_linkage(mechanism)
    frames = len(runs[0][1]["example_eccentricity_m"])
    motion = one_cycle(linkage, frames, speed_rpm * np.pi / 30.0)
    data = _leg_data(linkage, motion)
    data["runs"] = [
        _run_data(label, arrays, clearance)
        for (label, arrays), clearance in zip(runs, clearances_m, strict=True)
    ]
    data["longest_n"] = max(float(np.abs(run["largest_n"])) for run in data["runs"])
    data["arrow_mm"] = round(_ARROW_FRACTION * data["box"][3], 1)
    radius = _bushing_radius(mechanism, data["runs"])
    factors = [CLEARANCE_FRACTION * radius / clearance for clearance in clearances_m]
    return Live(
        markup=render("leg_slider.html", data=data, names=[run["label"] for run in data["runs"]]),
        script=template_text("leg_slider.js"),
        caption=_caption(factors, data["longest_n"]),
    )


def _caption(factors: Sequence[float], longest_n: float) -> str:
    low, high = min(factors), max(factors)
    factor = f"{low:.3g}" if high - low < 1.0e-6 * high else f"{low:.3g} to {high:.3g}"
    return (
        "One gait cycle of one run, an example. The leg is to scale, its bodies in ideal positions: "
        "clearance moves them by millimetres. Arrows: force of the bushing on the pin; their length grows "
        f"with the root of the force, up to {longest_n:.0f} N. Circles: each pin in its bushing, the "
        f"clearance magnified {factor} times, with the path of the pin's centre over the cycle."
    )


def _leg_data(linkage: Linkage, motion: IdealMotion) -> dict[str, Any]:
    """Bodies, joints and the toe's path [mm], with y downwards as in SVG."""
    mechanism = linkage.mechanism
    colours = cycle(BODY_COLOURS)
    bodies, every = [], []
    for body in mechanism.bodies:
        points = mechanism.points_of(body)
        shape = corners({name: np.array([point])[0] for name, point in points.items()})
        origin, angle = _pose(linkage, motion, body)
        bodies.append({
            "name": body,
            "colour": next(colours),
            "outline": _millimetres(shape),
            "poses": [
                [round(1.0e3 * x, 1), round(-1.0e3 * y, 1), round(-float(turn), 2)]
                for (x, y), turn in zip(origin, np.rad2deg(angle), strict=True)
            ],
        })  # fmt: skip
        every += [point_motion(motion, linkage, body, name)[0] for name in points]
    joints = {
        name: point_motion(motion, linkage, mechanism.sides(name)[1], name)[0] for name in mechanism.joints
    }
    low, high = np.concatenate(every).min(axis=0), np.concatenate(every).max(axis=0)
    margin = 0.09 * float((high - low).max())
    corner = 1.0e3 * np.array([low[0] - margin, -high[1] - margin])
    size = 1.0e3 * (high - low + 2.0 * margin)
    data = {
        "bodies": sorted(bodies, key=lambda body: -float(np.ptp(np.array(body["outline"]), axis=0).sum())),
        "joints": [{"name": name, "path": _millimetres(path)} for name, path in joints.items()],
        "box": [round(float(value), 1) for value in (*corner, *size)],
        "toe": [],
        "frames": len(motion.crank_angle),
    }
    if mechanism.toe is not None:
        data["toe"] = _millimetres(point_motion(motion, linkage, *mechanism.toe)[0])
    return data


def _pose(linkage: Linkage, motion: IdealMotion, body: str) -> tuple[Floats, Floats]:
    """Origin (N, 2) [m] and angle (N,) [rad] of a body's frame over the motion."""
    mechanism = linkage.mechanism
    i = 0 if body == GROUND else 1 + list(mechanism.bodies).index(body)
    angle, first = motion.q[:, i, 2], next(iter(mechanism.points_of(body)))
    c, s = np.cos(angle), np.sin(angle)
    x, y = mechanism.points_of(body)[first]
    place = point_motion(motion, linkage, body, first)[0]
    return place - np.stack([c * x - s * y, s * x + c * y], axis=-1), angle


def _run_data(label: str, arrays: Arrays, clearance_m: float) -> dict[str, Any]:
    """Eccentricities [clearances] and contact forces [N] of an example cycle, with y downwards."""
    e, force = arrays["example_eccentricity_m"] / clearance_m, arrays["example_contact_force_n"]
    flip = np.array([1.0, -1.0])
    pins = {
        name: {
            "e": (e[:, k] * flip).round(3).tolist(),
            "f": (force[:, k] * flip).round(1).tolist(),
        }
        for k, name in enumerate(clearance_joints_of(arrays))
    }
    largest = float(np.linalg.norm(force, axis=-1).max())
    return {"label": label, "clearance_mm": round(1.0e3 * clearance_m, 4), "pins": pins, "largest_n": largest}


def _bushing_radius(mechanism: Mechanism, runs: Sequence[dict[str, Any]]) -> float:
    """Bushing radius [m] of the first clearance joint, to which the stated magnification refers."""
    return mechanism.clearances[next(iter(runs[0]["pins"]))].bushing_radius


def _millimetres(points: Floats) -> list[list[float]]:
    return [[round(1.0e3 * float(x), 1), round(-1.0e3 * float(y), 1)] for x, y in points]
