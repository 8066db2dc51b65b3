"""Where the commands start: ^C is answered from the first moment, with one line and exit code 130."""

import os
import signal
from types import FrameType

from leg_wear_monitor.interrupt import put_in_order, would_be_lost

INTERRUPTED = 130


def main() -> None:
    """Entry point of ``leg-wear-monitor``."""
    _start()


def monitor() -> None:
    """Entry point of ``ros2 run leg_wear_monitor monitor``."""
    _start("monitor")


def gait_publisher() -> None:
    """Entry point of ``ros2 run leg_wear_monitor gait_publisher``."""
    _start("gait_publisher")


def _start(node: str | None = None) -> None:
    """Run the command line, or a node as a program of its own."""
    try:
        signal.signal(signal.SIGINT, _interrupt)
        from leg_wear_monitor.cli.main import main as run

        run(node)
    except KeyboardInterrupt:
        end_at_once()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done; what is left is to go


def _interrupt(_number: int, frame: FrameType | None) -> None:
    """Raise where that is safe, and only once; end the process here where it is not."""
    if would_be_lost(frame):
        end_at_once()
    signal.signal(signal.SIGINT, _insist)
    raise KeyboardInterrupt


def _insist(_number: int, _frame: FrameType | None) -> None:
    """The second time nobody wants to wait for what is being put in order."""
    os._exit(INTERRUPTED)


def end_at_once() -> None:
    """Put in order what is open, say so in one line, and end the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        put_in_order()
    finally:
        os.write(2, b"error: interrupted\n")
        os._exit(INTERRUPTED)
