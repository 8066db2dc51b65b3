"""What stands behind a verdict on the page of a replay: its guide, and how often such a verdict is right."""

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.verdict.decision import decision_of, figures_of
from leg_wear_monitor.monitor.verdict.verdict import guide_to
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.guide import enclosed
from leg_wear_monitor.report.page import Fragment, Section, Table, Text

_MEASURE = "docs/howto/measure_clearance.md"


def guide_sections(summary: ReplaySummary) -> list[Section]:
    """What to do step by step, folded; beside the guide of the verdict, how a clearance is measured.

    They are in the page, since it may be read where the package is not installed.
    """
    guides = [enclosed(share_directory() / name) for name in (guide_to(summary.verdict), _MEASURE)]
    return [
        Section(
            f"Guide: {guide.title}", [Fragment(f'<div class="guide">{guide.markup}</div>')], is_folded=True
        )
        for guide in guides
    ]


def certainty_section(summary: ReplaySummary) -> Section:
    """What the verdict's certainty was measured on."""
    rows = [(each.counted, each.words, each.where, each.date, each.source) for each in figures_of(summary)]
    table = Table(
        caption="How often such a verdict is right, where the truth is known",
        head=("cases", "", "measured on", "date", "page of the package"),
        rows=rows,
        note="Nothing was measured on a real leg.",
        is_text=True,
    )
    unknown = Text(decision_of(summary, summary.leg.joint_words).certainty)
    return Section("How sure is the verdict?", [table if rows else unknown], is_folded=True)
