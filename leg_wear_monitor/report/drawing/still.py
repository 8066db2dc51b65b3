"""A mechanism in one position as SVG, or on matplotlib's axes."""

import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.report.drawing.drawing import CREATOR, Drawing
from leg_wear_monitor.report.figures.figure import INK, SMALL, USUAL, VERMILION, new_figure, plain, svg, tidy
from leg_wear_monitor.report.figures.leg_picture import draw_leg

_LINE = 88  # letters of a finding in a line
_SIDE_IN, _LINE_IN = 6.0, 0.17


def drawing_svg(drawing: Drawing) -> bytes:
    """The picture as SVG, with what is wrong below it."""
    found = [line for text in drawing.findings for line in textwrap.wrap(text, _LINE)]
    below = _LINE_IN * len(found)
    figure = new_figure(_SIDE_IN, _SIDE_IN + below)
    with _any_letter():
        if found:
            axes, words = figure.subplots(2, 1, height_ratios=(_SIDE_IN, below))
            words.set_axis_off()
            text = "\n".join(plain(line) for line in found)
            words.text(0.0, 1.0, text, fontsize=SMALL, color=VERMILION, va="top")
        else:
            axes = figure.subplots()
        draw_drawing(axes, drawing)
        tidy(axes)
        return svg(figure, CREATOR)


def draw_drawing(axes: Axes, drawing: Drawing) -> None:
    """Draw the position that is shown first, titled with the name, the crank angle and what is wrong."""
    reach = drawing.reach
    draw_leg(axes, reach, drawing.shown)
    title = f"{plain(reach.mechanism.name)}, crank at {np.rad2deg(reach.crank_angle[drawing.shown]):.4g}°"
    if drawing.findings:
        title += "\n" + "\n".join(plain(line) for line in textwrap.wrap(drawing.headline, 60))
    axes.set_title(title, fontsize=USUAL, color=VERMILION if drawing.findings else INK)
    axes.set_xlabel("x [m]", fontsize=SMALL)
    axes.set_ylabel("y [m]", fontsize=SMALL)


@contextmanager
def _any_letter() -> Iterator[None]:
    """Do not warn of letters that the font lacks: a box stands for them."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield
