"""Wear around each bushing and journal, on an axis that shows it in its size."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.chart import Chart, Panel, Series
from leg_wear_monitor.report.figures.units import length_unit
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Text
from leg_wear_monitor.report.replay.words import not_valid

_LEAST_M = 1.0e-6  # end of the depth axis: less wear than this does not fill the picture
_TITLE = "Wear around each bushing"


def wear_section(summary: ReplaySummary) -> Section:
    """Depth over the angle, a panel a joint, all on the same axis."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    if doubt:
        return Section(_TITLE, [Text(doubt, is_not_valid=True)], is_folded=True)
    return Section(_TITLE, [Text(_deepest(summary)), wear_chart(summary)], is_folded=True)


def _deepest(summary: ReplaySummary) -> str:
    """The deepest wear beside the clearance limit, which tells how much it is."""
    depths = {name: _greatest(worn.bushing, worn.journal) for name, worn in summary.wear_depth_m.items()}
    name = max(depths, key=lambda joint: depths[joint], default="")
    if not name or not depths[name]:
        return "No wear is counted."
    factor, unit = length_unit(depths[name])
    limit = summary.clearances[name].limit_m if name in summary.clearances else None
    beside = f", {100.0 * depths[name] / limit:.2g} % of the limit of its clearance" if limit else ""
    joint = summary.leg.joint_words(name)
    return f"The deepest wear is {factor * depths[name]:.3g} {unit}, in joint {joint}{beside}."


def wear_chart(summary: ReplaySummary) -> Chart:
    """Wear depth of each joint over the angle."""
    greatest = max(
        (_greatest(worn.bushing, worn.journal) for worn in summary.wear_depth_m.values()), default=0.0
    )
    most = max(1.1 * greatest, _LEAST_M)
    factor, unit = length_unit(most)
    sectors = max((len(worn.bushing) for worn in summary.wear_depth_m.values()), default=0)
    angle = np.asarray((np.arange(sectors) + 0.5) * (360.0 / max(sectors, 1)), np.float64)
    panels = [
        Panel(
            title=summary.leg.joint_words(name),
            series=[
                Series(name=f"bushing {name}", unit=unit, values=factor * worn.bushing),
                Series(name=f"journal {name}", unit=unit, values=factor * worn.journal, colour="--series-1"),
            ],
            low=0.0,
            high=factor * most,
            height=150,
        )
        for name, worn in summary.wear_depth_m.items()
    ]
    return Chart(
        name="wear",
        alt="Wear depth around bushing and journal of each joint",
        caption="Depth of the wear by the angle in each body's own frame, from the start of the ledger, or "
        "of the replay if none was continued. All joints on the same axis, which is never shorter than 1 µm.",
        x=Series(name="angle", unit="deg", values=angle),
        panels=panels,
        group="angle",
    )


def _greatest(*depths: Floats) -> float:
    return max(float(depth.max(initial=0.0)) for depth in depths)
