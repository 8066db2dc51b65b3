"""Contact forces of each joint over time."""

from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Table, Text
from leg_wear_monitor.report.replay.charts import force_chart
from leg_wear_monitor.report.replay.words import not_valid, value


def force_section(summary: ReplaySummary) -> Section:
    """Chart and table."""
    doubt = not_valid(summary.verdict, Figure.IMPACT_FORCES)
    if doubt:
        return Section("Impact forces", [Text(doubt, is_not_valid=True)], is_folded=True)
    rows = [
        (
            summary.leg.joint_words(name),
            value(1.0, joint.peak_force_n),
            value(1.0, joint.mean_force_n),
            str(joint.impacts),
        )
        for name, joint in summary.joints.items()
    ]
    table = Table(caption="Contact forces", head=("joint", "peak [N]", "mean [N]", "impacts"), rows=rows)
    return Section("Impact forces", [force_chart(summary), table], is_folded=True)
