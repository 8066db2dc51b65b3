"""A gait cycle before and after a finding, to play: the leg, its pins, forces, and the drive torque."""

import math
from collections.abc import Mapping
from itertools import cycle, starmap
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import rotated
from leg_wear_monitor.messages.leg_motion import PHASES, CycleMotion
from leg_wear_monitor.playback.result import ReplayLeg, ReplaySummary
from leg_wear_monitor.report.figure import BODY_COLOURS
from leg_wear_monitor.report.leg_slider import drawn_pin, millimetres, picture_data
from leg_wear_monitor.report.page import (
    Fragment,
    Section,
    is_of_recording,
    render,
    since_words,
    template_text,
)
from leg_wear_monitor.state import JointClearance, State

TITLE = "A gait cycle to play"


def motion_section(summary: ReplaySummary) -> list[Section]:
    """The leg as it walks, and its torque; nothing where no gait cycle was kept."""
    leg, clearances = summary.leg, summary.clearances
    if not summary.motion or not leg.poses or not clearances:
        return []
    cycles = summary.motion if _is_found_later(summary) else summary.motion[-1:]
    names = ["before the finding", "after the finding"] if len(cycles) > 1 else ["the last one"]
    new = {joint: attrs.evolve(each, believed_m=each.counted_m) for joint, each in clearances.items()}
    known = clearances if is_of_recording(summary) else new
    runs = [_run(each, known if each is cycles[-1] else new) for each in cycles]
    forces = [
        f for run in runs for pin in run.values() for f in (*pin["hit"], *starmap(math.hypot, pin["f"]))
    ]
    named = [{"label": name, "pins": run} for name, run in zip(names, runs, strict=True)]
    ends = (since_words(summary, each.stamp_ns) for each in cycles)
    said = "; ".join(f"{name}, ended {end}" for name, end in zip(names, ends, strict=True))
    markup = render(
        "replay/motion.html",
        data=_leg(leg) | {"runs": named, "longest_n": max([1.0, *forces])},
        names=names,
        alt="The leg over a gait cycle, with the contact forces in its clearance joints",
        said=f"Gait cycle: {said}.",
        limit=summary.monitor.limits.torque_mismatch,
        cycles=[attrs.asdict(each.torque) for each in cycles],
    )
    script = "\n".join(map(template_text, ("leg_slider.js", "torque_phase.js", "replay/motion.js")))
    return [Section(TITLE, [Fragment(markup, script)])]


def _is_found_later(summary: ReplaySummary) -> bool:
    """Whether the verdict asks for something that was found between the first and the last kept gait cycle.

    What was measured after the recording is in none of them.
    """
    verdict = summary.verdict
    is_found = verdict.state not in (State.HEALTHY, State.NOT_MONITORED)
    return is_found and summary.motion[0].stamp_ns < verdict.since_ns <= summary.motion[-1].stamp_ns


def _run(shown: CycleMotion, clearances: Mapping[str, JointClearance]) -> dict[str, Any]:
    """Pins as the picture draws them."""
    pins: dict[str, dict[str, Any]] = {}
    for joint in shown.joints.keys() & clearances.keys():
        drawn = [drawn_pin(motion, clearances[joint]) for motion in shown.joints[joint]]
        pins[joint] = {key: [each[key] for each in drawn] for key in ("e", "f", "hit")}
        pins[joint]["gap"] = drawn[0]["gap"]
    return dict(sorted(pins.items()))


def _leg(leg: ReplayLeg) -> dict[str, Any]:
    """Geometry of the picture in mm and degrees, with the y axis downwards."""
    poses = {body: np.array(each) for body, each in leg.poses.items()}
    colours = cycle(BODY_COLOURS)
    bodies = [
        {
            "name": body,
            "colour": next(colours),
            "outline": millimetres(np.array(leg.bodies_m[body])),
            "poses": np.column_stack([millimetres(pose[:, 1:]), -np.rad2deg(pose[:, 0])]).round(2).tolist(),
        }
        for body, pose in poses.items()
    ]
    still = np.zeros((PHASES, 3))
    paths = {
        name: _moved(poses.get(joint.body, still), np.array(joint.place_m))
        for name, joint in leg.joints.items()
    }
    corners = [_moved(pose, np.array(place)) for body, pose in poses.items() for place in leg.bodies_m[body]]
    joints = [
        {"name": name, "path": millimetres(path), "ground": leg.joints[name].is_on_ground}
        for name, path in paths.items()
    ]
    angles = (360.0 / PHASES * np.arange(PHASES)).tolist()
    return picture_data(bodies, joints, np.concatenate([*corners, *paths.values()]), angles)


def _moved(pose: Floats, place: Floats) -> Floats:
    """Path (p, 2) [m] of a point that a pose (p, 3) turns about the origin and moves."""
    return np.asarray(rotated(place, pose[:, 0]) + pose[:, 1:])
