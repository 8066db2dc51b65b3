"""HTML page of the study of the ground's load."""

import attrs

from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos_page import estimates_of, exponent_table, foretold
from leg_wear_monitor.report.study.sections import (
    Sections,
    asked,
    conclude,
    curves,
    cycle,
    ends_and_middle,
    tables,
    wear,
)
from leg_wear_monitor.report.study.text import PICO, Labelled, joined, number, with_spread, zone_text
from leg_wear_monitor.report.study.trends import Panel, trend_gallery
from leg_wear_monitor.report.study.wear_page import life_table
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.studies.summary import (
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    of_clearance_joints,
    spread,
    worst_zone,
)
from leg_wear_monitor.studies.tasks.lyapunov import Estimate

_HEAD = "load"
_MILLION = 1.0e-6


def load(results: StudyResults, labelled: Labelled) -> Sections:
    """Sections of the load study's page."""
    lives = [(point.label, arrays) for point, arrays in results.of("life")]
    exponents = [(point.label, arrays) for point, arrays in results.of("exponent")]
    estimates = estimates_of(exponents)
    sentences = [*_order(labelled), *_change(labelled), *_zones(labelled)]
    sentences += [_of_a_life(label, arrays) for label, arrays in lives]
    sentences += [foretold(label, one) for (label, _), one in zip(exponents, estimates, strict=True)]
    chosen = ends_and_middle(results.of("response"))
    shown = [(point.label, arrays) for point, arrays in chosen]
    more = [*_joint_panels(labelled), _life_panel(labelled, lives)]
    more.append(_exponent_panel(labelled, dict(zip(dict(exponents), estimates, strict=True))))
    values = [float(point.settings["ground_n"]) for point, _ in results.of("response")]
    gallery = trend_gallery(values, "vertical force, peak [N]", [arrays for _, arrays in labelled], more)
    gallery = attrs.evolve(gallery, caption=f"{gallery.caption} Exponents: bars of two standard errors.")
    table = tables(labelled, _HEAD)
    further = [exponent_table(exponents, estimates, _HEAD)] if exponents else []
    further += [life_table(lives, _HEAD)] if lives else []
    return [
        asked(results),
        conclude(sentences + findings.regular_where(labelled)),
        Section("Over the load", [gallery]),
        cycle(results, chosen),
        curves(shown),
        wear(results, shown),
        Section(table.title, [*table.parts, *further]),
    ]


def _order(labelled: Labelled) -> list[str]:
    """The joints by worn depth under each load."""
    texts = []
    for label, arrays in labelled:
        depth = {joint: depth_per_cycle(arrays, joint) for joint in clearance_joints_of(arrays)}
        ranked = sorted(depth, key=lambda joint: -depth[joint].mean)
        texts.append(f"{label}: {' > '.join(ranked)}")
    return [f"Joints by the greatest wear depth of a cycle, at {'; '.join(texts)}."]


def _change(labelled: Labelled) -> list[str]:
    """Force and wear of each joint under the largest load, against the least one."""
    (first, before), (last, after) = labelled[0], labelled[-1]
    sentences = []
    for joint in clearance_joints_of(before):
        force = [joint_force(each, "mean_force_n", joint) for each in (before, after)]
        depth = [depth_per_cycle(each, joint) for each in (before, after)]
        volume = [
            of_clearance_joints(each, "archard_integral_j_per_cycle", joint) for each in (before, after)
        ]
        grown = [number(two.mean / one.mean) for one, two in (force, volume, depth)]
        sentences.append(
            f"Joint {joint}, from {first} to {last}: mean force {with_spread(force[0])} to "
            f"{with_spread(force[1])} N (× {grown[0]}), worn volume × {grown[1]}, greatest depth "
            f"{with_spread(depth[0], PICO)} to {with_spread(depth[1], PICO)} pm a cycle (× {grown[2]})."
        )
    return sentences


def _zones(labelled: Labelled) -> list[str]:
    """Where half of each joint's wear is, under each load."""
    return [
        f"Joint {joint}, zone that holds half of the bushing's wear: "
        + "; ".join(f"{label} {zone_text(worst_zone(arrays, joint, 0.5))}" for label, arrays in labelled)
        + "."
        for joint in clearance_joints_of(labelled[0][1])
    ]


def _of_a_life(label: str, arrays: Arrays) -> str:
    """Which joint opens first, when, and how far the others are by then."""
    mean, names = arrays["clearance_mean_m"], clearance_joints_of(arrays)
    opened = 1.0e3 * (mean[:, -1] - mean[:, 0]).mean(axis=0)
    first = int(opened.argmax())
    others = [f"{name} {number(opened[k])}" for k, name in enumerate(names) if k != first]
    rest = f"; by then the others by {joined(others)} mm" if others else ""
    cycles = with_spread(spread(arrays["cycles"][:, -1]), _MILLION)
    return f"{label}: {names[first]} opens by {number(opened[first])} mm in {cycles} million cycles{rest}."


def _joint_panels(labelled: Labelled) -> list[Panel]:
    names = clearance_joints_of(labelled[0][1])
    force: dict[str, list[Spread | None]] = {
        name: [joint_force(arrays, "mean_force_n", name) for _, arrays in labelled] for name in names
    }
    volume: dict[str, list[Spread | None]] = {
        name: [of_clearance_joints(arrays, "archard_integral_j_per_cycle", name) for _, arrays in labelled]
        for name in names
    }
    return [Panel("mean force [N]", force, 1.0), Panel("∫ F |v| dt [J a cycle]", volume, 1.0)]


def _life_panel(labelled: Labelled, lives: Labelled) -> Panel:
    cycles = {label: spread(arrays["cycles"][:, -1]) for label, arrays in lives}
    line = [cycles.get(label) for label, _ in labelled]
    return Panel("life of the joint that opens first [million cycles]", {"": line}, _MILLION)


def _exponent_panel(labelled: Labelled, estimates: dict[str, Estimate]) -> Panel:
    """Bars of two standard errors."""
    line: list[Spread | None] = []
    for label, _ in labelled:
        one = estimates.get(label)
        around = (one.value - 2.0 * one.error, one.value + 2.0 * one.error) if one else None
        line.append(Spread(one.value, one.error, *around) if one and around else None)
    return Panel("largest Lyapunov exponent [1/cycle]", {"": line}, 1.0)
