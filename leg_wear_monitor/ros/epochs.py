"""Samples whose time is in the ledger already: a clock that began anew, or something that is played back.

A live leg never walks the same time twice. If stamps agree with the node's own clock, samples are of now, and
it is the clock that stands where it stood before: simulated time that began anew, a board without a clock of
its own, a clock that was set back. The same holds for stamps that are no dates after the computer was started
again. Anything else may be a recording that is played, whose wear is counted: that cannot be decided here.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

NOW_NS = 10 * 10**9  # samples of now are no farther from it; the inbox holds no more
NO_DATE_NS = 10**17  # stamps below are of 1970 to 1973: they count from the start of something

UNDECIDED = (
    "samples of a time that is in the ledger already are skipped: nothing is monitored. "
    "If they are simulated, set use_sim_time: true; "
    "if their clock restarts with each start, ledger.skip_counted: false; "
    "if a recording is played, use replay or no ledger"
)
BEGUN = "the clock of the samples has restarted: they are counted as a new epoch"

_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def boot_id() -> str:
    """What tells this start of the computer from others; empty where that is not known."""
    try:
        return _BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


class Epochs:
    """Decides whether the clock has begun anew, and says what it could not decide.

    Parameters
    ----------
    monitor : WearMonitor
    boot : str
        See `boot_id`.
    now_ns : callable
        The node's clock [ns].
    report : callable
        Told once of each, whether it is an error and a line.
    """

    def __init__(
        self, monitor: WearMonitor, boot: str, now_ns: Callable[[], int], report: Callable[[bool, str], None]
    ) -> None:
        self._monitor, self._now_ns, self._report = monitor, now_ns, report
        self._is_other_boot = monitor.begin_run(boot)
        self._begun, self._left_out, self._told = 0, 0, 0

    def see(self, samples: Samples) -> None:
        """Look at samples before the monitor does."""
        known = self._monitor.counted(samples) & (samples["fault"] == NO_FAULT)
        if not known.any():
            return
        stamp_ns = int(samples["stamp_ns"][known][-1])
        is_now = abs(self._now_ns() - stamp_ns) <= NOW_NS
        if is_now or (self._is_other_boot and stamp_ns < NO_DATE_NS):
            self._monitor.begin_epoch(stamp_ns, "clock")
            self._begun += 1
            self._report(False, BEGUN)
            return
        if not self._left_out:
            self._report(True, UNDECIDED)
        self._left_out += int(np.count_nonzero(known))

    def status(self) -> Status:
        """Whether samples are left out since the last time that this was asked."""
        values = {"left_out_samples": float(self._left_out), "epochs_begun": float(self._begun)}
        is_undecided, self._told = self._left_out > self._told, self._left_out
        if is_undecided:
            return Status("clock", Level.ERROR, UNDECIDED, values)
        return Status("clock", Level.OK, BEGUN if self._begun else "continues", values)
