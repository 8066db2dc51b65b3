"""What the commands do when they are interrupted."""

import os
import signal
from types import FrameType

from leg_wear_monitor.cli.start import INTERRUPTED, leave
from leg_wear_monitor.interrupt import put_in_order, would_be_lost


def interrupt(_number: int, frame: FrameType | None) -> None:
    """Raise where that is safe, and only once; where it is not, put in order what is open and leave."""
    if not would_be_lost(frame):
        signal.signal(signal.SIGINT, _insist)
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        put_in_order()
    finally:
        leave()


def _insist(_number: int, _frame: FrameType | None) -> None:
    """The second time nobody wants to wait for what is being put in order."""
    os._exit(INTERRUPTED)
