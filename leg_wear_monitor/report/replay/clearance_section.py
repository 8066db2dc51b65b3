"""Clearances as further encoders show them, on the page of a replay."""

from collections.abc import Mapping

from leg_wear_monitor.playback.result.parts import ReplayJoint
from leg_wear_monitor.report.page import Section, Table


def clearance_sentences(joints: Mapping[str, ReplayJoint]) -> list[str]:
    """Joints that surely are not as counted, a sentence each."""
    sentences = []
    for name, joint in joints.items():
        off = joint.seen.departure_m if joint.seen and joint.seen.is_other else None
        if off is not None:
            sentences.append(
                f"Encoders show that {name} is {1.0e6 * abs(off):.0f} µm "
                f"{'wider' if off > 0.0 else 'narrower'} than counted."
            )
    return sentences


def clearance_sections(joints: Mapping[str, ReplayJoint]) -> list[Section]:
    """Clearances as further encoders show them, if there are such."""
    rows = [
        (
            name,
            _millimetres(joint.clearance_m.last),
            _millimetres(joint.seen.clearance_m),
            _millimetres(joint.seen.sigma_m),
            "other than counted" if joint.seen.is_other else joint.seen.observation.value,
        )
        for name, joint in joints.items()
        if joint.seen
    ]
    if not rows:
        return []
    table = Table(
        caption="Clearances estimated from encoders",
        head=("joint", "counted [mm]", "estimated [mm]", "± [mm]", ""),
        rows=rows,
        note="Counted: by the law of wear with the nominal coefficient. Estimated: from the angles of "
        "further encoders over the last gait cycles; the standard deviation includes the model error.",
    )
    return [Section("Clearances estimated from encoders", [table])]


def _millimetres(metres: float | None) -> str:
    return "-" if metres is None else f"{1.0e3 * metres:.4f}"
