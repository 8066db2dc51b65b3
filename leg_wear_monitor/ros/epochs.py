"""Samples whose time is already in the ledger: the clock was reset, or a recording is played back.

A live leg cannot walk through the same time twice. If stamps agree with the node's own clock, the samples are
live and the clock was reset: simulation time restarted, the board has no hardware clock, or the clock was
set back. After a reboot, the same holds for stamps that are not calendar dates. Any other samples may
come from playback of a recording whose wear is already counted; this case is undecidable here.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.fault_codes import ALREADY_COUNTED
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

NOW_NS = 10 * 10**9  # live samples are within this time of the node's clock; the inbox holds no more
NO_DATE_NS = 10**17  # stamps below are of 1970 to 1973: they count from the start of something

UNDECIDED = (
    "the ledger contains the time of these samples already, so they are skipped and nothing is monitored. "
    "If they are simulated, set use_sim_time: true; "
    "if their clock restarts with each start, set ledger.skip_counted: false; "
    "if they are from a recording, use replay, or no ledger"
)
BEGUN = "the clock of the samples has restarted: they are counted as a new epoch"

_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def boot_id() -> str:
    """Identifier of the computer's current boot; empty if unknown."""
    try:
        return _BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


class Epochs:
    """Detects clock resets, and reports samples for which a reset is undecidable.

    Parameters
    ----------
    monitor : WearMonitor
    boot : str
        See `boot_id`.
    now_ns : callable
        The node's clock [ns].
    report : callable
        Called with whether it is an error, and a line: at each clock reset, and at the first undecidable one.
    """

    def __init__(
        self, monitor: WearMonitor, boot: str, now_ns: Callable[[], int], report: Callable[[bool, str], None]
    ) -> None:
        self._monitor, self._now_ns, self._report = monitor, now_ns, report
        self._is_other_boot = monitor.begin_run(boot)
        self._begun, self._left_out, self._reported = 0, 0, 0

    def check(self, samples: Samples) -> None:
        """Check samples before they are passed to the monitor."""
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
        """Clock status: an error if samples were left out since the last call."""
        values = {"left_out_samples": float(self._left_out), "epochs_begun": float(self._begun)}
        is_undecided, self._reported = self._left_out > self._reported, self._left_out
        if is_undecided:
            return Status("clock", Level.ERROR, UNDECIDED, values, ALREADY_COUNTED)
        return Status("clock", Level.OK, BEGUN if self._begun else "continues", values)
