"""A number on the command line: finite, within bounds, and told with its unit when it is not."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from leg_wear_monitor.errors import ConfigError


def bounded(
    unit: str = "", *, above: float | None = None, at_least: float | None = None
) -> Callable[[click.Context, click.Parameter, float | None], float | None]:
    """Callback of a click option of type float; for files see `leg_wear_monitor.configuration.quantity`.

    Parameters
    ----------
    unit : str
        SI unit, ``""`` for a pure number.
    above, at_least : float, optional
        Bounds.
    """

    def check(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
        fault = None
        if value is None:
            return None
        if not math.isfinite(value):
            fault = (
                f"{value:g} is not a finite number of {unit}" if unit else f"{value:g} is not a finite number"
            )
        elif above is not None and not value > above:
            fault = f"{value:g} is not above {above:g} {unit}".rstrip()
        elif at_least is not None and not value >= at_least:
            fault = f"{value:g} is not at least {at_least:g} {unit}".rstrip()
        if fault:
            raise click.BadParameter(fault, ctx, param)
        return value

    return check


@contextmanager
def options_named() -> Iterator[None]:
    """Name an option as it is written on the command line, where the library names its parameter."""
    options = {name for option in click.get_current_context().command.params for name in option.opts}
    try:
        yield
    except ConfigError as error:
        option = f"--{error.source}".replace("_", "-")
        if option not in options:
            raise
        raise ConfigError(option, error.key, error.fault) from error
