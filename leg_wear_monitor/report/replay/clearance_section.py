"""Clearances as further encoders show them, on the page of a replay."""

from typing import Any

from leg_wear_monitor.report.page import Section, Table


def clearance_sentences(record: dict[str, Any]) -> list[str]:
    """Joints that surely are not as counted, a sentence each."""
    sentences = []
    for name, joint in record["joints"].items():
        if joint.get("seen", {}).get("is_other"):
            off = joint["seen"]["departure_m"]
            sentences.append(
                f"Encoders show that {name} is {1.0e6 * abs(off):.0f} µm "
                f"{'wider' if off > 0.0 else 'narrower'} than counted."
            )
    return sentences


def clearance_sections(record: dict[str, Any]) -> list[Section]:
    """Clearances as further encoders show them, if there are such."""
    shown = {name: joint for name, joint in record["joints"].items() if "seen" in joint}
    if not shown:
        return []
    rows = [
        (
            name,
            f"{1.0e3 * joint['clearance_m']['last']:.4f}",
            _millimetres(joint["seen"]["clearance_m"]),
            _millimetres(joint["seen"]["sigma_m"]),
            "other than counted" if joint["seen"]["is_other"] else joint["seen"]["observation"],
        )
        for name, joint in shown.items()
    ]
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
