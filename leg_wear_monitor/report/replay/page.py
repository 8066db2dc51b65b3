"""The page of a replay, from its summary."""

from typing import Any

import numpy as np

from leg_wear_monitor.monitor.alarms.words import raised_words, time_words
from leg_wear_monitor.report.figures.figure import png
from leg_wear_monitor.report.figures.worn_bushings import worn_bushings
from leg_wear_monitor.report.page import Page, Part, Picture, Section, Sentences, Table, Text
from leg_wear_monitor.report.replay.charts import alarm_chart, clearance_chart, force_chart, health_chart
from leg_wear_monitor.report.replay.clearance_section import clearance_sections, clearance_sentences
from leg_wear_monitor.report.replay.forecast_section import counted_mm, forecast_section, leg_sentence
from leg_wear_monitor.wear.surfaces import Surfaces

_MOST_ROWS = 50


def replay_page(record: dict[str, Any]) -> Page:
    """The page of a replay.

    Parameters
    ----------
    record : dict
        What summary.json holds.
    """
    recording, monitor = record["recording"], record["monitor"]
    summary = (
        f"{monitor['mechanism']}, clearance joints {', '.join(monitor['clearance_joints'])}: "
        f"{_time(recording['duration_s'])} from "
        f"{time_words(recording['begin_ns'])}, {record['cycles']} gait cycles. {record['advice']}"
    )
    sections = [Section("Results", [Sentences(_sentences(record))]), _recording(recording)]
    if _is_believable(record):
        sections += [_clearance(record), *clearance_sections(record), forecast_section(record)]
        sections += [_forces(record), _wear(record)]
    sections += [_alarms(record), _health(record)]
    title = f"Joint wear of {monitor['hardware_id']}"
    return Page(title=title, summary=summary, sections=sections, versions=record["made_with"])


def _sentences(record: dict[str, Any]) -> list[str]:
    """What to know first."""
    sentences = []
    if record["recording"]["is_partial"]:
        sentences.append("The recording is damaged or incomplete: the results are from its readable part.")
    if record.get("gait", {}).get("is_counted"):
        sentences.append("All of it is in the ledger already, so no gait cycle was processed again.")
    elif not _is_believable(record):
        sentences.append("No gait cycle fits this leg, so forces and wear are not reported.")
        if missing := record.get("gait", {}).get("missing"):
            sentences.append(f"Missing: {missing}.")
    raised = [alarm for alarm in record["alarms"]["now"] if alarm["level"] != "OK"]
    for alarm in raised:
        values = (alarm.get(key) for key in ("state", "worst", "limit", "unit", "raised_ns"))
        sentences.append(f"{alarm['name']}: {alarm['level']}, {raised_words(*values)}.")
    if not raised:
        sentences.append("No alarm is raised at the end.")
    growing = {
        name: joint["growth_m_per_cycle"]
        for name, joint in record["joints"].items()
        if joint["growth_m_per_cycle"] is not None
    }
    if growing:
        fastest = max(growing, key=lambda name: growing[name])
        sentences.append(f"{fastest} wears fastest: {1.0e12 * growing[fastest]:.3g} pm a gait cycle.")
    sentences += leg_sentence(record)
    sentences += clearance_sentences(record)
    if record["monitor"]["wear_acceleration"] != 1.0:
        factor = record["monitor"]["wear_acceleration"]
        sentences.append(f"All wear is multiplied by {factor:g}: a demonstration, not a measurement.")
    lost_s = record["lost"]["unmonitored_s"]
    if lost_s:
        sentences.append(f"{_time(lost_s)} could not be followed and is not counted.")
    return sentences


def _is_believable(record: dict[str, Any]) -> bool:
    """Whether a gait cycle can be this leg's; a summary of an older version counts any."""
    return bool(record["gait"]["believable_cycles"] if "gait" in record else record["cycles"])


def _recording(recording: dict[str, Any]) -> Section:
    rows = [
        ("files", ", ".join(recording["files"])),
        ("topics", ", ".join(f"{name}: {topic}" for name, topic in recording["topics"].items())),
        ("stamps", f"{recording['time']} time"),
        ("crank samples", f"{recording['crank_samples']}"),
        ("torque samples", f"{recording['torque_samples']}"),
        ("begin", time_words(recording["begin_ns"])),
        ("end", time_words(recording["end_ns"])),
    ]
    parts: list[Part] = [Table(caption="Topics, time and samples", head=("", ""), rows=rows)]
    findings = [f"{each['file']}: {each['text']}" for each in recording["findings"]]
    if findings:
        more = len(findings) - _MOST_ROWS
        parts.append(Sentences(findings[:_MOST_ROWS] + ([f"and {more} more"] if more > 0 else [])))
    else:
        parts.append(Text("It was read completely, and all of its checksums are valid."))
    return Section("The recording", parts)


def _clearance(record: dict[str, Any]) -> Section:
    picture = Picture(
        image=png(clearance_chart(record)),
        alt="Opening of each joint's mean radial clearance over time",
        caption="Mean radial clearance of each joint, minus its value after the first gait cycle.",
        wide=True,
    )
    head = ("joint", "counted clearance [mm]", "opened [nm]", "growth [pm/cycle]", "± [pm/cycle]")
    rows = []
    for name, joint in record["joints"].items():
        clearance = joint["clearance_m"]
        rows.append(
            (
                name,
                counted_mm(joint),
                _figure(1.0e9, clearance["last"] - clearance["first"]),
                _figure(1.0e12, joint["growth_m_per_cycle"]),
                _figure(1.0e12, joint["growth_error_m_per_cycle"]),
            )
        )
    table = Table(
        caption="Clearances at the end",
        head=head,
        rows=rows,
        note="Counted: the clearance when new plus the wear counted by the model since, in its "
        "significant digits. ± is the standard error of the growth; single gait cycles of a chaotic "
        "motion scatter.",
    )
    return Section("Clearance over time", [picture, table])


def _forces(record: dict[str, Any]) -> Section:
    picture = Picture(
        image=png(force_chart(record)),
        alt="Peak and mean contact force of each joint over time",
        caption="Contact force in each gait cycle: peak (blue) and mean (black). Dashed: the limit, where it "
        "is near. Peaks are of a heavy tail; their scatter does not mean that the joint changes.",
        wide=True,
    )
    rows = [
        (
            name,
            _figure(1.0, joint["peak_force_n"]),
            _figure(1.0, joint["mean_force_n"]),
            str(joint["impacts"]),
        )
        for name, joint in record["joints"].items()
    ]
    table = Table(caption="Contact forces", head=("joint", "peak [N]", "mean [N]", "impacts"), rows=rows)
    return Section("Impact forces", [picture, table])


def _wear(record: dict[str, Any]) -> Section:
    wear = record["wear_depth_m"]
    depth = np.array([[joint["bushing"], joint["journal"]] for joint in wear.values()], float)
    radii = tuple(record["monitor"]["bushing_radius_m"][name] for name in wear)
    cycles = record["history"]["cycle"][-1]
    picture = Picture(
        image=png(worn_bushings(Surfaces(depth, 1), tuple(wear), radii, cycles)),
        alt="Wear depth around bushing and journal of each joint",
        caption="Wear around each bushing and journal, from the start of the ledger, or of the replay if "
        "none was continued. The depth is magnified by the factor above; angles in each body's own "
        "frame.",
        wide=True,
    )
    return Section("Wear around each bushing", [picture])


def _alarms(record: dict[str, Any]) -> Section:
    changes = record["alarms"]["changes"]
    if not changes:
        return Section("Alarms", [Text("No alarm was raised.")])
    begin = record["recording"]["begin_ns"]
    rows = [
        (
            f"{(change['stamp_ns'] - begin) / 1.0e9:.2f}",
            change["name"],
            change["level"],
            change["state"],
            _figure(1.0, change["value"]),
            f"{_figure(1.0, change['limit'])} {change['unit']}".strip(),
        )
        for change in changes[:_MOST_ROWS]
    ]
    more = len(changes) - _MOST_ROWS
    table = Table(
        caption="Changes of alarms",
        head=("time [s]", "alarm", "level", "state", "value", "limit"),
        rows=rows,
        note=f"{more} more are in summary.json." if more > 0 else "",
    )
    picture = Picture(image=png(alarm_chart(record)), alt="Levels of alarms over time", wide=True)
    return Section("Alarms", [picture, table])


def _health(record: dict[str, Any]) -> Section:
    lost = {**record["lost"], **record["lost"]["faulty"]}
    rows = [
        (name.replace("_", " "), _figure(1.0, value))
        for name, value in lost.items()
        if not isinstance(value, dict)
    ]
    parts: list[Part] = []
    if record["cycles"]:
        chart = Picture(
            image=png(health_chart(record)),
            alt="Cadence, drive torque and torque mismatch over time",
            caption="Cadence with the commanded one dashed; measured and predicted drive torque; the "
            "fraction that load, friction and lag do not explain, with its limit.",
            wide=True,
        )
        parts.append(chart)
    parts.append(Table(caption="Unused samples and lost time", head=("", "number"), rows=rows))
    status = [(each["name"], each["level"], each["message"]) for each in record["status"]]
    parts.append(Table(caption="State at the end", head=("", "level", "message"), rows=status))
    return Section("Input health", parts)


def _figure(factor: float, value: float | None) -> str:
    return "-" if value is None else f"{factor * value:.4g}"


def _time(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.3g} h"
