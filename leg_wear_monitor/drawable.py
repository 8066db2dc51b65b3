"""What notebooks show of results, mechanisms and materials, and pictures, as methods of theirs."""

from importlib import import_module
from typing import Any


class Shown:
    """Base of what a notebook shows.

    The report stands above it in the order of imports, so it is looked up when it is asked for.
    """

    __slots__ = ()

    def _repr_html_(self) -> str:
        """What a notebook shows: HTML without scripts, with every name escaped."""
        html: str = import_module("leg_wear_monitor.report.notebook").notebook_html(self)
        return html


class Drawable(Shown):
    """Base of what ``report/`` draws, too."""

    __slots__ = ()

    def plot(self, axes: Any = None) -> Any:
        """Draw on matplotlib axes; see `leg_wear_monitor.plot`.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; new axes of pyplot without.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return import_module("leg_wear_monitor.report.plot").plot(self, axes)
