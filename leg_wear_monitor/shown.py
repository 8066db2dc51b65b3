"""What notebooks show of results, mechanisms and materials, and pictures, as methods of theirs.

Functions of the report make both, and the report stands above all that is shown: the package itself, above
every room, says in `VIEWS` which they are, so that nothing down here names them.
"""

TYPE_CHECKING = False  # as typing has it, without the time to import that
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

VIEWS: "dict[str, Callable[..., Any]]" = {}
"""``html(thing)`` and ``plot(thing, axes)``; the package's ``__init__``, imported first, sets them."""


class Shown:
    """Base of what a notebook shows."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """What a notebook shows: HTML without scripts, with every name escaped."""
        html: str = VIEWS["html"](self)
        return html


class Drawable(Shown):
    """Base of what the report draws, too."""

    __slots__ = ()

    def plot(self, axes: "Any" = None) -> "Any":
        """Draw on matplotlib axes; see `leg_wear_monitor.plot`.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; new axes of pyplot without.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return VIEWS["plot"](self, axes)
