"""Style of the figures: matplotlib without pyplot, in colours that colour-blind readers can distinguish."""

import io

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from leg_wear_monitor.errors import printable

# Okabe and Ito, Color Universal Design, 2008
BLUE, ORANGE, GREEN, VERMILION = "#0072b2", "#e69f00", "#009e73", "#d55e00"
PURPLE, SKY, YELLOW = "#cc79a7", "#56b4e9", "#f0e442"
BODY_COLOURS = (ORANGE, BLUE, GREEN, PURPLE, SKY, VERMILION, YELLOW)
INK, PALE, PAPER = "#222222", "#d9d9d9", "#ffffff"

SMALL, USUAL = 8.0, 9.5  # font sizes in points


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of the given width and height [inch], with the Agg backend."""
    figure = Figure(figsize=(width, height), facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure, dots_per_inch: float = 100.0) -> bytes:
    """The figure as PNG; with the same libraries, equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return buffer.getvalue()


def svg(figure: Figure, creator: str | None = None) -> bytes:
    """The figure as SVG, for figures with few lines; equal figures give equal bytes."""
    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "leg_wear_monitor"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": creator})
    return buffer.getvalue()


def plain(text: str) -> str:
    """A name from a file as matplotlib writes it: on one line, and a dollar sign begins no formula."""
    return printable(text, 200).replace("$", r"\$")


def tidy(axes: Axes) -> None:
    """Format axes: left and bottom frame lines only, a pale grid below the data."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(PALE)
    axes.tick_params(labelsize=SMALL, color=PALE, labelcolor=INK)
    axes.grid(color=PALE, linewidth=0.6, alpha=0.7)
    axes.set_axisbelow(True)
