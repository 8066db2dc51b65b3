"""Interactive picture of the leg over a gait cycle: contact forces, and each journal in its bushing."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.ideal import one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.reach.reach import Reach
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figures.leg_data import leg_data
from leg_wear_monitor.report.page import render, template_text
from leg_wear_monitor.report.parts import Live
from leg_wear_monitor.report.study.text import Labelled
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import clearance_joints_of

_ALT = "The leg at the chosen crank angle, with the contact forces in its clearance joints"
CLEARANCE_FRACTION = 0.3  # drawn clearance, as a fraction of the bushing's radius


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
    reach = Reach(linkage, 1, motion.crank_angle, motion.q, turns=True)
    data = leg_data(reach) | {"digits": 0, "skip": 2}
    data["runs"] = [
        _run_data(label, arrays, clearance)
        for (label, arrays), clearance in zip(runs, clearances_m, strict=True)
    ]
    data["longest_n"] = max(float(np.abs(run["largest_n"])) for run in data["runs"])
    radius = _bushing_radius(mechanism, data["runs"])
    factors = [CLEARANCE_FRACTION * radius / clearance for clearance in clearances_m]
    return Live(
        markup=render("leg_slider.html", data=data, names=[run["label"] for run in data["runs"]], alt=_ALT),
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
