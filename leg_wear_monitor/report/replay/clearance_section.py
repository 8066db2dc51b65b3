"""Clearances over time and at the end, as counted and as further encoders show them."""

from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Table, Text
from leg_wear_monitor.report.replay.charts import estimates_chart, has_estimates, openings_chart
from leg_wear_monitor.report.replay.joint_view import counted_mm
from leg_wear_monitor.report.replay.words import NOT_VALID, not_valid, value

_TITLE = "Clearance over time"


def clearance_section(summary: ReplaySummary) -> Section:
    """Clearances by estimate, and the counted ones where they are valid."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    seen = [estimates_chart(summary)] if has_estimates(summary) else []
    if doubt:
        text = Text(f"Counted clearances: {doubt}.", is_not_valid=True)
        return Section(_TITLE, [*seen, text], is_folded=True)
    return Section(_TITLE, [openings_chart(summary), *seen, _table(summary)], is_folded=True)


def _table(summary: ReplaySummary) -> Table:
    has_growth = Figure.GROWTH not in summary.verdict.not_valid
    is_sampled = any(joint.sampling_sigma_m for joint in summary.joints.values())
    rows = []
    for name, joint in summary.joints.items():
        clearance = joint.clearance_m
        growth = (
            value(1.0e12, joint.growth_m_per_cycle),
            value(1.0e12, joint.growth_error_m_per_cycle),
        )
        rows.append(
            (
                summary.leg.joint_words(name),
                counted_mm(summary, name),
                value(1.0e9, clearance.last - clearance.first),
                *((value(1.0e9, joint.sampling_sigma_m),) if is_sampled else ()),
                *(growth if has_growth else (NOT_VALID, NOT_VALID)),
            )
        )
    return Table(
        caption="Clearances at the end",
        head=(
            *("joint", "counted clearance [mm]", "opened [nm]"),
            *(("standard error of sampling [nm]",) if is_sampled else ()),
            *("growth [pm/cycle]", "± [pm/cycle]"),
        ),
        rows=rows,
        note="Counted: the clearance when new plus the wear counted by the model since, in its "
        "significant digits. ± is one standard deviation of the growth: gait cycles of a chaotic "
        "motion scatter, and the leg may be built with other masses than its file has.",
    )


def clearance_sentences(summary: ReplaySummary) -> list[str]:
    """Joints that surely are not as counted, a sentence each."""
    sentences = []
    for name, joint in summary.joints.items():
        off = joint.seen.departure_m if joint.seen and joint.seen.is_other else None
        if off is not None:
            sentences.append(
                f"Encoders show that {summary.leg.joint_words(name)} is {1.0e6 * abs(off):.0f} µm "
                f"{'wider' if off > 0.0 else 'narrower'} than counted."
            )
    return sentences


def encoder_sections(summary: ReplaySummary) -> list[Section]:
    """Clearances as further encoders show them, if there are such."""
    is_counted_leg = Figure.CLEARANCES not in summary.verdict.not_valid
    rows = [
        (
            summary.leg.joint_words(name),
            _millimetres(joint.clearance_m.last) if is_counted_leg else NOT_VALID,
            _millimetres(joint.seen.clearance_m),
            _millimetres(joint.seen.sigma_m),
            "other than counted" if joint.seen.is_other else joint.seen.observation.value,
        )
        for name, joint in summary.joints.items()
        if joint.seen
    ]
    if not rows:
        return []
    title = "Clearances estimated from encoders"
    table = Table(
        caption=title,
        head=("joint", "counted [mm]", "estimated [mm]", "± [mm]", ""),
        rows=rows,
        note="Counted: by the law of wear with the nominal coefficient. Estimated: from the angles of "
        "further encoders over the last gait cycles; the standard deviation includes the model error.",
    )
    return [Section(title, [table], is_folded=True)]


def _millimetres(metres: float | None) -> str:
    return "-" if metres is None else f"{1.0e3 * metres:.4f}"
