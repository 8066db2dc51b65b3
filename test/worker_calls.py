"""Calls that workers can import: one kills its worker, one leaves a mark."""

import os
import signal
import time


def die(mark=None):
    """Kill this worker: once if there is a mark to leave, otherwise always."""
    if mark is None or not mark.exists():
        if mark is not None:
            mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"


def leave(mark, after):
    """Leave a mark after a while [s]."""
    time.sleep(after)
    mark.touch()
