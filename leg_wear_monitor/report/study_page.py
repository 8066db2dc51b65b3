"""HTML page of a study: its question, tables and pictures, from the results in its directory."""

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from ruamel.yaml import YAML

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figure import (
    BLUE,
    BODY_COLOURS,
    INK,
    LEAST_N,
    SKY,
    SMALL,
    finish,
    leg_picture,
    new_figure,
    png,
    use_own_style,
)
from leg_wear_monitor.report.page import Gallery, Page, Part, Picture, Section, Table, Text
from leg_wear_monitor.studies.paper import CLAIMS, STANDARD_ERRORS, Responses, responses_of
from leg_wear_monitor.studies.run import StudyResults
from leg_wear_monitor.studies.tables import (
    ARCHARD,
    DEPTH,
    FORGET,
    TITLES,
    Found,
    Spread,
    clearance_joints_of,
    exponent,
    fraction_of_range,
    largest_error,
    of_joint,
    worst_zone,
)
from leg_wear_monitor.studies.tasks import ERRORS, Arrays

_UNITS = (("mm", 1.0e3), ("m/s", 1.0), ("m/s²", 1.0), ("N m", 1.0))
_QUANTITIES = tuple((name, title, *unit) for name, title, unit in zip(ERRORS, TITLES, _UNITS, strict=True))
# settings that may vary from point to point: label of the axis, factor from SI
_AXES = {
    "clearance_m": ("radial clearance [mm]", 1.0e3),
    "speed_rpm": ("crank speed [rpm]", 1.0),
    "ground_n": ("vertical force of the ground, peak [N]", 1.0),
}
_Figures = Mapping[str, tuple[str, float]]  # title and factor from SI of a statistic, by name
_FORCES = {
    "peak_force_n": ("largest force in a cycle [N]", 1.0),
    "p99_force_n": ("99th percentile of the force [N]", 1.0),
    "mean_force_n": ("mean force [N]", 1.0),
    "impacts": ("impacts per cycle", 1.0),
    "impact_speed_mps": ("mean approach speed [mm/s]", 1.0e3),
    "contact_fraction": ("time in contact [%]", 100.0),
    "repeats_contact_force": ("variance of the force that repeats [%]", 100.0),
}
_WEAR = {
    DEPTH: ("greatest wear depth [pm/cycle]", 1.0e12),
    ARCHARD: ("∫ F |v| dt [J/cycle]", 1.0),
}
_OF_FORCES = (
    "Mean and standard deviation: largest forces and impacts over the cycles of all runs, the rest over "
    "runs. A single largest force is random; compare the percentile. A periodic force repeats to 100 %."
)
_OF_WEAR = (
    "1 pm per cycle is 1 µm in a million cycles. Mean and standard deviation over runs. Angles are in the "
    "frame of the body with the bushing. Depths are proportional to the wear coefficient."
)
_CHARTS = ("peak_force_n", "p99_force_n", "mean_force_n", DEPTH, ARCHARD)
_MOST_SHOWN = 6  # points with curves and surfaces; of more points, the first, the middle and the last
_KEY = "Shaded: the middle 90 % of all cycles. Blue: one cycle of one run, as an example. Dashed: ideal leg."


def study_page(results: StudyResults) -> Page:
    """The page of a study; a study without any result has a page that lists the missing points."""
    use_own_style()
    found, exponents = results.of("response"), results.of("exponent")
    lines = [f"{label}: {fault}." for label, fault in results.faults]
    lines += [f"Not computed yet: {', '.join(results.missing)}."] if results.missing else []
    parts: dict[str, Sequence[Part]] = {"Missing points": [Text(line) for line in lines]}
    parts["Question"] = _question(results)
    if responses := responses_of(found):
        parts["Claims of the paper"] = [_claims(responses)]
    if found:
        shown = found if len(found) <= _MOST_SHOWN else [found[0], found[len(found) // 2], found[-1]]
        parts["Results"] = [
            _error_table(found),
            _joint_table("Contact forces and impacts", found, _FORCES, (), _OF_FORCES),
            _joint_table("Wear of the bushings", found, _WEAR, (0.5, 0.9), _OF_WEAR),
        ]
        parts["Comparison"] = [_comparison(found)] if len(found) > 1 else []
        parts["Curves of a cycle"] = _curves(shown)
    if exponents:
        parts["Lyapunov exponents"] = [_exponent_table(exponents)]
    parts |= _sections_of_cycles(results)
    buffer = io.StringIO()
    YAML().dump(attrs.asdict(results.settings), buffer)
    return Page(
        title=f"{results.settings.title}: {results.mechanism.name}",
        summary=results.settings.question,
        sections=[Section(title, each) for title, each in parts.items() if each],
        configuration=buffer.getvalue(),
        versions={**results.versions, "seed": str(results.settings.ensemble.seed)},
        has_dark=True,
    )


def _question(results: StudyResults) -> list[Part]:
    """Description of the ensemble, and a picture of the leg."""
    ensemble = results.settings.ensemble
    text = (
        f"Each value is a mean over {ensemble.runs} runs with different initial crank angles and journal "
        f"positions. The first {ensemble.skip_cycles} cycles of each run are skipped, "
        f"and the next {ensemble.cycles} are used. Motion with clearance is chaotic, "
        "so a single run is only an example."
    )
    joints = list(dict.fromkeys(name for point in results.points for name in point.settings["clearances"]))
    caption = f"The leg to scale. Clearance joints of this study: {', '.join(joints)}."
    return [
        Text(text),
        Picture(image=png(leg_picture(results.mechanism, joints)), alt=caption, caption=caption, wide=True),
    ]


# Tables.


def number(value: float) -> str:
    """A number with three significant digits; a dash if it is not known."""
    return f"{float(f'{value:.3g}'):g}" if math.isfinite(value) else "–"


def with_spread(value: Spread, factor: float = 1.0) -> str:
    """Mean with three digits, and standard deviation with two."""
    deviation = float(f"{factor * value.deviation:.2g}")
    return number(factor * value.mean) + (f" ± {deviation:g}" if deviation > 0.0 else "")


def _zone_text(zone: tuple[float, float] | None) -> str:
    return (
        "–"
        if zone is None
        else f"{zone[0] % 360.0:.0f}° to {zone[1] % 360.0:.0f}° ({zone[1] - zone[0]:.0f}°)"
    )


def _known(found: Found) -> list[tuple[str, str, str, float]]:
    """Quantities that have an ideal curve in all results; a leg without a toe has the drive torque only."""
    return [each for each in _QUANTITIES if all(f"ideal_{each[0]}" in arrays for _, arrays in found)]


def _error_table(found: Found) -> Table:
    known = _known(found)
    rows = [
        [point.label]
        + [with_spread(largest_error(arrays, name), factor) for name, _, _, factor in known]
        + [f"{number(100.0 * fraction_of_range(arrays, name))} %" for name, *_ in known]
        for point, arrays in found
    ]
    note = (
        "Mean and standard deviation over the cycles of all runs. The range is the range of the ideal curve."
    )
    head = [f"{title} [{unit}]" for _, title, unit, _ in known] + [
        f"{title}, fraction of its range" for _, title, *_ in known
    ]
    return Table(
        caption="Largest error against the ideal leg in one cycle", head=["", *head], rows=rows, note=note
    )


def _joint_table(caption: str, found: Found, figures: _Figures, zones: Sequence[float], note: str) -> Table:
    """A row per clearance joint of each point: figures, and the zones with some fractions of the wear."""
    rows = [
        [
            point.label if point.label == joint else f"{point.label}: {joint}",
            *(with_spread(of_joint(arrays, name, joint), factor) for name, (_, factor) in figures.items()),
            *(_zone_text(worst_zone(arrays, joint, fraction)) for fraction in zones),
        ]
        for point, arrays in found
        for joint in clearance_joints_of(arrays)
    ]
    titles = [title for title, _ in figures.values()]
    head = ["joint", *titles, *(f"zone with {100.0 * fraction:g} % of the wear" for fraction in zones)]
    return Table(caption=caption, head=head, rows=rows, note=note)


def _exponent_table(exponents: Found) -> Table:
    rows = []
    for point, arrays in exponents:
        one, (runs, cycles) = (
            exponent(arrays["stretch_per_cycle"], 1.0, FORGET),
            arrays["stretch_per_cycle"].shape,
        )
        grows = number(math.log(1000.0) / one.value) if one.value > 0.0 else "–"
        rows.append([point.label, f"{one.value:.2f} ± {one.error:.2f}", grows, f"{runs} × {cycles - FORGET}"])
    head = ("", "exponent [1/cycle]", "cycles in which an error grows a thousand times", "pairs × cycles")
    note = "Mean and standard error over pairs of neighbours (Benettin and others 1980). Above 0: chaotic."
    return Table(caption="Largest Lyapunov exponent", head=head, rows=rows, note=note)


def _claims(responses: Responses) -> Table:
    rows = [[claim.place, claim.text, claim.state(responses)] for claim in CLAIMS]
    note = f"Undecided: within {STANDARD_ERRORS:g} standard errors over the runs."
    head = ("clearance in", "claim", "this leg")
    return Table(caption="The paper's claims", head=head, rows=rows, note=note, is_text=True)


# Pictures.


def _axis(found: Found) -> tuple[str, list[float]] | None:
    """Label and values of the only quantity that varies between points; None if several vary."""
    varied = [key for key in _AXES if len({point.settings.get(key) for point, _ in found}) > 1]
    if len(varied) != 1:
        return None
    label, factor = _AXES[varied[0]]
    return label, [factor * point.settings[varied[0]] for point, _ in found]


def _comparison(found: Found) -> Gallery:
    """A chart of each statistic over the varied quantity, or over the points by name."""
    joints = list(dict.fromkeys(joint for _, arrays in found for joint in clearance_joints_of(arrays)))
    pictures = []
    for name, title, unit, factor in _known(found):
        errors = [largest_error(arrays, name) for _, arrays in found]
        pictures.append(_chart(found, f"{title}, largest error [{unit}]", factor, {"": errors}))
    for name in _CHARTS:
        title, factor = (_FORCES | _WEAR)[name]
        lines = {
            joint: [
                of_joint(arrays, name, joint) if joint in clearance_joints_of(arrays) else None
                for _, arrays in found
            ]
            for joint in joints
        }
        pictures.append(_chart(found, title, factor, lines))
    return Gallery(pictures=pictures, caption="Points: means. Bars: from the 10th to the 90th percentile.")


def _chart(found: Found, title: str, factor: float, lines: Mapping[str, Sequence[Spread | None]]) -> Picture:
    """Means with bars; each line has one value, or None, per point."""
    axis, texts, figure = _axis(found), [], new_figure(4.6, 3.0)
    axes = figure.subplots()
    for k, (name, spreads) in enumerate(lines.items()):
        known = [(i, one) for i, one in enumerate(spreads) if one]
        x = [axis[1][i] if axis else i + 0.06 * (k - 0.5 * len(lines)) for i, _ in known]
        low, mean, high = factor * np.array([(one.low, one.mean, one.high) for _, one in known]).T
        look: dict[str, Any] = {"color": BODY_COLOURS[k % 7], "marker": "os^Dv"[k % 5], "ms": 4.0}
        bars = np.maximum(0.0, (mean - low, high - mean))
        axes.errorbar(
            x, mean, bars, label=name or None, linewidth=float(axis is not None), elinewidth=1.0, **look
        )
        texts.append(f"{name} {', '.join(f'{value:.3g}' for value in mean)}")
    if not axis:
        labels = [point.label for point, _ in found]
        axes.set_xticks(range(len(found)), labels, rotation=20 if len(found) > 4 else 0)
        axes.set_xlim(-0.5, len(found) - 0.5)
    axes.set_ylim(0.0, 1.15 * axes.dataLim.y1 or 1.0)
    finish(axes, title, x=axis[0] if axis else "", columns=5)
    return Picture(image=png(figure), alt=f"{title}: {'; '.join(texts)}")


def _curves(found: Found) -> list[Gallery]:
    """Curves over the crank angle: a gallery for each quantity, with a picture for each point."""
    galleries = []
    for name, title, unit, factor in _known(found):
        is_toe, apart = name.startswith("toe"), name == "toe_position_m"
        panels = []
        for _, arrays in found:
            ideal = factor * arrays[f"ideal_{name}"] * (not apart)
            band, example = (
                factor * arrays[f"{kind}_{name}"] + ideal * is_toe for kind in ("band", "example")
            )
            panels.append(
                [each.reshape(*each.shape[: each.ndim - is_toe], -1) for each in (ideal, band, example)]
            )
        what = f"{title}, deviation from the ideal leg" if apart else title
        galleries.append(
            _curve_gallery(found, f"{what} [{unit}]", panels, [["x", "y"] if is_toe else [""]] * len(found))
        )
    panels = [
        [
            arrays["ideal_joint_force_n"][:, np.searchsorted(arrays["joints"], arrays["clearance_joints"])],
            arrays["band_contact_force_n"],
            arrays["example_contact_force_n"],
        ]
        for _, arrays in found
    ]
    title = f"contact force [N], logarithmic; at {LEAST_N} N the journal is free"
    return [
        *galleries,
        _curve_gallery(found, title, panels, [clearance_joints_of(arrays) for _, arrays in found], True),
    ]


def _curve_gallery(
    found: Found, title: str, panels: list[list[Floats]], names: list[list[str]], is_log: bool = False
) -> Gallery:
    """Pictures of curves: ideal (s, n), band (3, s, n) and example (s, n) of n components at each point."""
    low = min(float(curve.min()) for point in panels for curve in point[:2])
    high = max(float(curve.max()) for point in panels for curve in point[:2])
    margin, pictures = 0.05 * (high - low) or 1.0, []
    for (point, _), curves, components in zip(found, panels, names, strict=True):
        figure = new_figure(4.6, 1.2 * len(components) + 0.75)
        every = np.atleast_1d(figure.subplots(len(components), 1, sharex=True))
        for i, (axes, component) in enumerate(zip(every, components, strict=True)):
            ideal, band, example = (
                np.maximum(each[..., i], LEAST_N) if is_log else each[..., i] for each in curves
            )
            angle = np.arange(len(example)) * (360.0 / len(example))
            axes.fill_between(angle, band[0], band[-1], color=SKY, alpha=0.45, linewidth=0.0)
            axes.plot(angle, ideal, color=INK, linewidth=1.2, linestyle=(0, (4, 2)))
            axes.plot(angle, example, color=BLUE, linewidth=0.7)
            axes.set(xlim=(0.0, 360.0), xticks=(0.0, 90.0, 180.0, 270.0, 360.0))
            axes.set(yscale="log") if is_log else axes.set(ylim=(low - margin, high + margin))
            finish(axes, "" if i else point.label, y=component)
        every[-1].set_xlabel("crank angle [°]", fontsize=SMALL)
        pictures.append(Picture(image=png(figure), alt=f"{title} over the crank angle, {point.label}"))
    return Gallery(pictures=pictures, caption=f"{title[0].upper()}{title[1:]}. {_KEY}")


# Poincaré maps, phase portraits and bifurcation diagrams.


def _sections_of_cycles(results: StudyResults) -> dict[str, Sequence[Part]]:
    """Parts of the points of the task ``section``, by the title of their section of the page."""
    pairs, parts = results.of("section"), dict[str, Sequence[Part]]()
    for point, arrays in results.of("portrait"):
        cycles, angle = len(arrays["section_rate_mps"]), point.settings["crank_angle_deg"]
        text = f"One point per cycle at crank angle {angle:g}°, over {cycles} cycles."
        parts["Poincaré maps"] = [_planes(point.clearance_m, arrays, "section", text)]
        text = "The journal's place in its bushing against its rate, some cycles of one run as an example."
        parts["Phase portraits"] = [_planes(point.clearance_m, arrays, "portrait", text)]
    diagrams = []
    for key, fixed in (("clearance_m", "speed_rpm"), ("speed_rpm", "clearance_m")):
        base = getattr(results.settings, fixed)
        along = [pair for pair in pairs if pair[0].settings[fixed] == base]
        if len(along) > 1:
            diagrams.append(_bifurcation(key, sorted(along, key=lambda pair: pair[0].settings[key])))
    return parts | {"Bifurcation diagrams": diagrams}


def _planes(clearance_m: float, arrays: Arrays, kind: str, caption: str) -> Gallery:
    """A picture for each joint: its place against its rate, x and y side by side."""
    places, rates = arrays[f"{kind}_eccentricity_m"] / clearance_m, 1.0e3 * arrays[f"{kind}_rate_mps"]
    style, pictures = "." if kind == "section" else "-", []
    for k, joint in enumerate(clearance_joints_of(arrays)):
        figure = new_figure(4.8, 2.5)
        for i, axes in enumerate(figure.subplots(1, 2)):
            axes.plot(places[:, k, i], rates[:, k, i], style, color=BLUE, markersize=2.0, linewidth=0.35)
            finish(axes, joint, x=f"{'xy'[i]} / clearance", y="" if i else "rate [mm/s]")
        pictures.append(Picture(image=png(figure), alt=f"{caption.partition('.')[0]}: joint {joint}"))
    return Gallery(
        pictures=pictures,
        caption=f"{caption} Beyond 1 and -1 clearances the journal presses into the bushing.",
    )


def _bifurcation(key: str, found: Found) -> Gallery:
    """Places of the journals once per cycle over a setting, a picture for each joint."""
    (label, factor), pictures = _AXES[key], []
    for k, joint in enumerate(clearance_joints_of(found[0][1])):
        figure = new_figure(4.8, 3.2)
        for i, axes in enumerate(figure.subplots(2, 1, sharex=True)):
            for point, arrays in found:
                places = arrays["section_eccentricity_m"][:, k, i] / point.clearance_m
                at = np.full(len(places), factor * point.settings[key])
                axes.plot(at, places, "o", color=BLUE, markersize=1.8, markeredgewidth=0.0, alpha=0.6)
            finish(axes, "" if i else joint, x=label if i else "", y=f"{'xy'[i]} / clearance")
        pictures.append(Picture(image=png(figure), alt=f"Places of joint {joint} over the {label}"))
    return Gallery(
        pictures=pictures, caption=f"The journal's place in its bushing once per cycle, over the {label}."
    )
