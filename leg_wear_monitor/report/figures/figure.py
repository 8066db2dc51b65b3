"""How pictures look: matplotlib's objects without pyplot, colours that colour-blind people can tell apart."""

import io

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe and Ito, Color Universal Design, 2008
BLUE, ORANGE, GREEN, VERMILION = "#0072b2", "#e69f00", "#009e73", "#d55e00"
PURPLE, SKY, YELLOW = "#cc79a7", "#56b4e9", "#f0e442"
BODY_COLOURS = (ORANGE, BLUE, GREEN, PURPLE, SKY, VERMILION, YELLOW)
INK, PALE, PAPER = "#222222", "#d9d9d9", "#ffffff"

SMALL, USUAL, LARGE = 8.0, 9.5, 12.0  # of letters, in points


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches, drawn by Agg."""
    figure = Figure(figsize=(width, height), facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure, dots_per_inch: float = 100.0) -> bytes:
    """Draw a figure; the same figure gives the same bytes with the same libraries."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return buffer.getvalue()


def svg(figure: Figure) -> bytes:
    """Draw a figure as lines, for those that stay small so; the same figure gives the same bytes, too."""
    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "leg_wear_monitor"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def tidy(axes: Axes) -> None:
    """A light frame: two sides, a pale grid below all else."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(PALE)
    axes.tick_params(labelsize=SMALL, color=PALE, labelcolor=INK)
    axes.grid(color=PALE, linewidth=0.6, alpha=0.7)
    axes.set_axisbelow(True)
