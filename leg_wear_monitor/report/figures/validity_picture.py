"""Figure of forecast validity: the quantile of each measured clearance in its predicted distribution."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.monitor.forecast.validity import validity
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.report.figures.figure import BLUE, INK, PALE, SMALL, VERMILION, new_figure, png, tidy


def validity_picture(measurements: Sequence[Measurement]) -> bytes:
    """PNG: predicted probability of a smaller clearance over the part's gait cycles; p10 to p90 shaded."""
    figure = new_figure(6.0, 3.0)
    axes = figure.add_subplot()
    axes.axhspan(0.1, 0.9, color=PALE, alpha=0.6, linewidth=0.0)
    axes.axhline(0.5, color=INK, linewidth=0.6)
    for counts, colour, label in ((True, BLUE, "measured"), (False, VERMILION, "contradicts, not used")):
        chosen = [m for m in measurements if m.counts is counts and not m.is_withdrawn]
        at, below = [m.cycles for m in chosen], [m.expected_below for m in chosen]
        axes.plot(at, below, "o", color=colour, label=label)
        for m in chosen:
            axes.annotate(m.joint, (m.cycles, m.expected_below), xytext=(4, 4), textcoords="offset points")
    axes.set(ylim=(-0.02, 1.02), yticks=np.array([0.0, 0.1, 0.5, 0.9, 1.0]))
    axes.set_xlabel("gait cycles since the part was new", fontsize=SMALL, color=INK)
    axes.set_ylabel("predicted probability of a smaller value", fontsize=SMALL, color=INK)
    axes.set_title(validity(measurements).words, fontsize=SMALL, color=INK, wrap=True)
    axes.legend(fontsize=SMALL, frameon=False)
    tidy(axes)
    return png(figure)
