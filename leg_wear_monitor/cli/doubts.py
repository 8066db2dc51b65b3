"""Values that are likely meant in another unit, as warnings: one line each on stderr."""

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

from leg_wear_monitor.errors import ConfigWarning

if TYPE_CHECKING:
    from leg_wear_monitor.configuration.quantity import Doubt


def warn_of(source: str, found: Iterable["Doubt"]) -> None:
    """Warn of what was found in a file."""
    for doubt in found:
        warnings.warn(f"{source}: {doubt}", ConfigWarning, stacklevel=2)
