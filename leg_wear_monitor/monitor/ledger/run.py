"""A run of the monitor, as stored in the ledger."""

import attrs


@attrs.frozen
class Run:
    """A run of the monitor.

    Attributes
    ----------
    number : int
        Number of the run, 0 before the first.
    closed : bool
        Whether the run ended normally.
    interval_s : float
        Longest time in motion between two of its entries.
    epoch : int
        Epoch of the clock at the end of the run.
    boot_id : str
        Boot of the computer; empty if unknown.
    """

    number: int = 0
    closed: bool = True
    interval_s: float = 0.0
    epoch: int = 0
    boot_id: str = ""
