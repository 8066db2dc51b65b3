"""Contact forces of each joint over time."""

from leg_wear_monitor.mechanism.materials.load import BushingLoad
from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Part, Table, Text
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
    return Section("Impact forces", [force_chart(summary), table, *_loads(summary)], is_folded=True)


def _loads(summary: ReplaySummary) -> list[Part]:
    """Pressure, sliding speed and p v of each joint in the last gait cycle, against its material's limits."""
    loads = {summary.leg.joint_words(name): joint.load for name, joint in summary.joints.items()}
    rows = [(name, *_load_cells(load)) for name, load in loads.items() if load is not None]
    if not rows:
        return []
    table = Table(
        caption="Pressure and sliding speed in the last gait cycle, and the limits of the materials",
        head=("joint", "p mean [MPa]", "p p99 [MPa]", "limit", "v [m/s]", "limit", "p v [MPa m/s]", "limit"),
        rows=rows,
        note="p: force over diameter times width. v: mean sliding speed under load. A dash: the material has "
        "no such limit. Beyond a limit, the wear coefficient does not hold.",
    )
    told = [f"{name}: {load.outside_limits}." for name, load in loads.items() if load and load.outside_limits]
    return [table, *(Text(text, is_not_valid=True) for text in told)]


def _load_cells(load: BushingLoad) -> tuple[str, ...]:
    return (
        value(1.0e-6, load.mean_pressure_pa),
        value(1.0e-6, load.p99_pressure_pa),
        value(1.0e-6, load.pressure_limit_pa),
        value(1.0, load.mean_sliding_speed_mps),
        value(1.0, load.sliding_speed_limit_mps),
        value(1.0e-6, load.mean_pressure_speed_pa_mps),
        value(1.0e-6, load.pressure_speed_limit_pa_mps),
    )
