"""Pictures of results and mechanisms as methods of theirs, for notebooks."""

from importlib import import_module
from typing import Any


class Drawable:
    """Base of what ``report/`` draws.

    The report stands above the results in the order of imports, so it is looked up when it is asked for.
    """

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

    def _repr_html_(self) -> str:
        """What a notebook shows: HTML without scripts, with every name escaped."""
        html: str = import_module("leg_wear_monitor.report.notebook").notebook_html(self)
        return html
