"""The one root of everything this package raises on purpose, and text that is fit to be shown."""

_MOST_SHOWN = 2000


def printable(text: str, most: int = _MOST_SHOWN) -> str:
    r"""Text from a file as it may be shown: on one line, nothing in it that a terminal obeys, not too long.

    What cannot be printed stands as its escape (``\x1b``); so do line breaks, marks that turn the direction
    of writing, and bytes of a file name that are no UTF-8.

    Parameters
    ----------
    text : str
    most : int
        Characters that are kept.
    """
    shown = "".join(
        each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in text[:most]
    )
    return shown if len(text) <= most else f"{shown} and {len(text) - most} characters more"


class LegWearError(Exception):
    """An error that a user can correct; the command line prints it as one line and returns 2."""


class ConfigError(LegWearError):
    """A file or an option has an unusable value.

    Parameters
    ----------
    source : str
        File or command-line option the value came from.
    key : str
        Dotted path of the key, empty if the fault concerns the whole file.
    fault : str
        What was found and what was expected, with its unit.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> try:
    ...     lw.simulate("four_bar", clearance_m=-0.001)
    ... except lw.ConfigError as error:
    ...     print(error)
    clearance-m: -0.001 is not above 0 m (joint B)
    """

    def __init__(self, source: str, key: str, fault: str) -> None:
        self.source, self.key, self.fault = source, key, fault
        super().__init__(": ".join(part for part in (source, key, fault) if part))

    def __reduce__(self) -> tuple[type["ConfigError"], tuple[str, str, str]]:
        """By its parts, so that it survives the way from a worker process; the message alone does not."""
        return type(self), (self.source, self.key, self.fault)


class AssemblyError(LegWearError):
    """The linkage cannot be put together, or its crank cannot pass a dead point."""


class SimulationError(LegWearError):
    """A run that stopped; the message gives the place, the time and the remedy."""


class ConfigWarning(UserWarning):
    """Something that can be used but may not do what was meant; the command line prints it as one line."""
