"""HTML page of the wear study: wear of new joints, and its development over a life."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.report.figures.figure import INK, SMALL, new_figure, png, tidy
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Gallery, Picture, Table
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.sections import Sections, asked, conclude, cycle, wear
from leg_wear_monitor.report.study.text import (
    PICO,
    Labelled,
    joint_table,
    number,
    wear_table,
    with_spread,
    zone_text,
)
from leg_wear_monitor.report.study.trends import MARKS
from leg_wear_monitor.report.study.wear_pictures import wear_gallery
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.studies.summary import clearance_joints_of, spread
from leg_wear_monitor.wear.surfaces import BUSHING, wear_zone

_NEW, _END = 0, 1  # indices of states: rates when new and at the end (depths: halfway and at the end)
_MILLION = 1.0e-6


def life(results: StudyResults, labelled: Labelled) -> Sections:
    """Sections of the wear study's page."""
    lives = [(point.label, arrays) for point, arrays in results.of("life")]
    sentences = [*findings.wear(labelled), *findings.zones(labelled)]
    for label, arrays in lives:
        sentences += _of_a_life(label, arrays, several=len(lives) > 1)
    sections = [asked(results), conclude(sentences), wear(results, labelled)]
    if lives:
        sections += [_clearances(lives), _worn_surfaces(results, lives)]
    sections.append(cycle(results, results.of("response")))
    tables = [wear_table(labelled, "clearance joints"), joint_table(labelled, "clearance joints")]
    return [*sections, Section("Tables", tables + ([life_table(lives, "clearance joints")] if lives else []))]


def _of_a_life(label: str, arrays: Arrays, several: bool) -> list[str]:
    """Sentence on a life: its length, the opened joints, the change of the wear rate, the toe's error."""
    cycles, mean = arrays["cycles"][:, -1], arrays["clearance_mean_m"]
    opened = 1.0e3 * (mean[:, -1] - mean[:, 0]).mean(axis=0)
    first = clearance_joints_of(arrays)[int(opened.argmax())]
    parts = [
        f"{joint} {number(each)} mm" for joint, each in zip(clearance_joints_of(arrays), opened, strict=True)
    ]
    rates = [
        f"{joint} × {number(_rate(arrays, k, _END) / _rate(arrays, k, _NEW))}"
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    sets = f"With clearance in {label}, " if several else ""
    toe = arrays["toe_position_m"]
    return [
        f"{sets}{first} opens first, after {with_spread(spread(cycles), _MILLION)} million cycles; opened "
        "by then, "
        ""
        ""
        f"on the mean: {', '.join(parts)}. Wear of a cycle at the end against new: {', '.join(rates)}; "
        "largest toe "
        f"error {number(1.0e3 * toe[:, 0].mean())} mm when new, {number(1.0e3 * toe[:, -1].mean())} mm at "
        "the end."
    ]


def _rate(arrays: Arrays, k: int, when: int) -> float:
    """Mean wear depth of a joint's bushing per cycle [m]."""
    return float(arrays["rate_m_per_cycle"][:, when, k, BUSHING].mean())


def _clearances(lives: Labelled) -> Section:
    """Section with the mean and the largest clearance of every joint over the cycles."""
    pictures = []
    for label, arrays in lives:
        figure = new_figure(4.6, 3.0)
        axes = figure.subplots()
        for k, ((colour, mark), joint) in enumerate(zip(MARKS, clearance_joints_of(arrays), strict=False)):
            for run in range(len(arrays["cycles"])):
                cycles = _MILLION * arrays["cycles"][run]
                mean, largest = (1.0e3 * arrays[f"clearance_{kind}_m"][run, :, k] for kind in ("mean", "max"))
                axes.plot(cycles, mean, color=colour, linewidth=1.2, marker=mark, markevery=(run, 8),
                          markersize=4.0, label=joint if run == 0 else None)  # fmt: skip
                axes.plot(cycles, largest, color=colour, linewidth=0.8, linestyle=(0, (4, 2)))
        tidy(axes)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("gait cycles [millions]", fontsize=SMALL)
        axes.set_ylabel("radial clearance [mm]", fontsize=SMALL)
        axes.set_title(label, fontsize=SMALL + 1.0, color=INK, fontweight="bold")
        axes.legend(fontsize=SMALL, frameon=False, ncols=5, handletextpad=0.3)
        pictures.append(
            Picture(image=png(figure), alt=f"Clearances of {label} over the life: {_ends(arrays)}")
        )
    caption = (
        "Clearances as wear feeds back. Full: mean around the joint; dashed: where it is largest, both "
        "surfaces "
        "added up in their own frames. A line for each run."
    )
    return Section("Over a life", [Gallery(pictures=pictures, caption=caption)])


def _ends(arrays: Arrays) -> str:
    mean = 1.0e3 * arrays["clearance_mean_m"].mean(axis=0)
    parts = [
        f"{joint} {mean[0, k]:.3f} to {mean[-1, k]:.3f} mm"
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    return ", ".join(parts)


def _worn_surfaces(results: StudyResults, lives: Labelled) -> Section:
    worn = [
        (label, joint, np.asarray(arrays["depth_m"][:, _END, k], dtype=float))
        for label, arrays in lives
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    return Section(
        "Worn surfaces", [wear_gallery(results.mechanism, worn, "Surfaces at the end of the life")]
    )


def life_table(lives: Labelled, head: str) -> Table:
    """Table of lives, a row for each clearance joint; ``head`` begins the title of the first column."""
    rows: list[Sequence[str]] = []
    for label, arrays in lives:
        for k, joint in enumerate(clearance_joints_of(arrays)):
            depth = arrays["depth_m"][:, _END, k, BUSHING].astype(float)
            rate = arrays["rate_m_per_cycle"][:, :, k, BUSHING].astype(float)
            rows.append([
                f"{label}: {joint}" if label != joint else joint,
                with_spread(spread(arrays["cycles"][:, -1]), _MILLION),
                with_spread(spread(arrays["clearance_mean_m"][:, -1, k]), 1.0e3),
                with_spread(spread(depth.max(axis=1)), 1.0e6),
                zone_text(wear_zone(depth.mean(axis=0))),
                with_spread(spread(rate[:, _NEW].mean(axis=1)), PICO),
                with_spread(spread(rate[:, _END].mean(axis=1)), PICO),
            ])  # fmt: skip
    return Table(
        caption="A life with wear fed back",
        head=(
            f"{head}, joint",
            "cycles [millions]",
            "mean clearance at the end [mm]",
            "greatest depth of the bushing [µm]",
            "zone with 90 % of the bushing's wear",
            "mean depth a cycle when new [pm]",
            "at the end [pm]",
        ),
        rows=rows,
        note="Mean and standard deviation over runs; the life ends where the joint that wears fastest has "
        "opened as far as the configuration says.",
    )
