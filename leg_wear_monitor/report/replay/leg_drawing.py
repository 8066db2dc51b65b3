"""The leg as an inline drawing, its clearance joints marked by how much of their limit is used."""

from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.playback.result.leg import Place, ReplayLeg
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import render
from leg_wear_monitor.report.parts import Fragment
from leg_wear_monitor.report.replay.joint_view import JointView

_WIDTH, _LABELS = 400.0, 176.0  # of the drawing, and of the column of labels at its right
_MARGIN = 20.0
_TALLEST = 400.0
_LABEL_HEIGHT = 40.0
_APART = 11.0  # joints at one place are drawn side by side
_NEAR_M = 1.0e-3


@attrs.frozen(kw_only=True)
class _Mark:
    """A clearance joint: its place, that of its label, and its words."""

    view: JointView
    x: float
    y: float
    label_x: float
    label_y: float
    words: str


class _Plane:
    """From the leg's plane [m], y up, to the drawing's, y down."""

    def __init__(self, leg: ReplayLeg) -> None:
        places = [place for shape in leg.bodies_m.values() for place in shape]
        places += [joint.place_m for joint in leg.joints.values()]
        xs, ys = ([place[k] for place in places] for k in (0, 1))
        wide, tall = max(xs) - min(xs), max(ys) - min(ys)
        room = _WIDTH - _LABELS - 2.0 * _MARGIN
        self._scale = min(room / max(wide, 1.0e-6), (_TALLEST - 2.0 * _MARGIN) / max(tall, 1.0e-6))
        self._left, self._top = min(xs), max(ys)
        self.height = max(self._scale * tall + 2.0 * _MARGIN, 160.0)

    def at(self, place: Place) -> Place:
        x, y = place
        return (
            round(_MARGIN + self._scale * (x - self._left), 1),
            round(_MARGIN + self._scale * (self._top - y), 1),
        )


def leg_drawing(summary: ReplaySummary, views: Sequence[JointView]) -> Fragment:
    """The drawing; a note instead for a summary without the leg's shape."""
    leg = summary.leg
    if not leg.bodies_m or not leg.joints:
        return Fragment(render("replay/leg.html", drawing=None))
    plane, shown = _Plane(leg), {view.joint for view in views}
    marks = _marks(plane, leg, [view for view in views if view.joint in leg.joints])
    height = max([plane.height, *(mark.label_y + _LABEL_HEIGHT / 2.0 for mark in marks)])
    drawing: dict[str, Any] = {
        "width": _WIDTH,
        "height": height,
        "bodies": [[plane.at(place) for place in shape] for shape in _largest_first(leg)],
        "supports": sorted({plane.at(joint.place_m) for joint in leg.joints.values() if joint.is_on_ground}),
        "ideal": [plane.at(joint.place_m) for name, joint in leg.joints.items() if name not in shown],
        "marks": marks,
        "title": f"The leg {summary.monitor.mechanism}: " + "; ".join(_spoken(mark) for mark in marks),
    }
    return Fragment(render("replay/leg.html", drawing=drawing))


def _largest_first(leg: ReplayLeg) -> list[tuple[Place, ...]]:
    def size(shape: tuple[Place, ...]) -> float:
        return sum(max(place[k] for place in shape) - min(place[k] for place in shape) for k in (0, 1))

    return sorted(leg.bodies_m.values(), key=lambda shape: -size(shape))


def _marks(plane: _Plane, leg: ReplayLeg, views: Sequence[JointView]) -> list[_Mark]:
    """Marks with their labels in a column, from the highest joint to the lowest, and not over each other."""
    placed = [(view, _beside(plane, leg, view, views)) for view in views]
    placed.sort(key=lambda each: each[1][1])
    marks, below = [], 0.0
    room = plane.height - _LABEL_HEIGHT * len(placed)
    for k, (view, (x, y)) in enumerate(placed):
        latest = max(0.0, room) + _LABEL_HEIGHT * (k + 0.5)
        label_y = max(below + _LABEL_HEIGHT / 2.0, min(y, latest))
        below = label_y + _LABEL_HEIGHT / 2.0
        label_x = _WIDTH - _LABELS + 14.0
        marks.append(_Mark(view=view, x=x, y=y, label_x=label_x, label_y=label_y, words=_words(view)))
    return marks


def _beside(plane: _Plane, leg: ReplayLeg, view: JointView, views: Sequence[JointView]) -> Place:
    """A joint's place; joints that share one stand side by side."""
    here = leg.joints[view.joint].place_m
    there = [other.joint for other in views if _is_near(leg.joints[other.joint].place_m, here)]
    x, y = plane.at(here)
    return x + _APART * (2.0 * there.index(view.joint) - len(there) + 1.0), y


def _is_near(one: Place, other: Place) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) < _NEAR_M


def _words(view: JointView) -> str:
    if view.clearance is None or view.shown_m is None:
        return "not valid" if view.doubt.startswith("not valid") else "not known"
    if view.used is None:
        return "not monitored"
    if view.used >= 1.0:
        return f"{1.0e3 * view.shown_m:.3g} mm, limit {1.0e3 * view.clearance.limit_m:.3g} mm"
    if view.look == "over":  # the verdict says so, and is newer than the joint's last report
        return "at its limit, see the verdict"
    return f"{100.0 * view.used:.0f} % used"


def _spoken(mark: _Mark) -> str:
    label = f" ({mark.view.label})" if mark.view.label else ""
    return f"joint {mark.view.joint}{label} {mark.words}"
