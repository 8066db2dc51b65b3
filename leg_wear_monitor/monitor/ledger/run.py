"""A start of the monitor, as the ledger keeps it."""

import attrs


@attrs.frozen
class Run:
    """A start of the monitor.

    Attributes
    ----------
    number : int
        0 before the first.
    closed : bool
        Whether it ended in order.
    interval_s : float
        Longest time in motion between two of its entries.
    epoch : int
        Of its clock, at its end.
    boot_id : str
        Of the computer; empty if not known.
    """

    number: int = 0
    closed: bool = True
    interval_s: float = 0.0
    epoch: int = 0
    boot_id: str = ""
