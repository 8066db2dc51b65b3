"""Entry point of the commands: handles ^C from the first moment, with one line and exit code 130.

A node is also ended by SIGTERM, and either signal is an orderly end: exit code 0.

Imports of this module delay the ^C handling, so it imports next to nothing.
"""

import os
import signal
import sys

from leg_wear_monitor.errors import interrupt, leave

_NODES = ("monitor", "gait-publisher", "gait_publisher")

LOADING = "{name}: loading libraries; the node's first message follows in seconds"

_BLAS = "OPENBLAS_NUM_THREADS"


def main() -> None:
    """Entry point of ``leg-wear-monitor``."""
    _start()


def monitor() -> None:
    """Entry point of ``ros2 run leg_wear_monitor monitor``."""
    _start("monitor")


def gait_publisher() -> None:
    """Entry point of ``ros2 run leg_wear_monitor gait_publisher``."""
    _start("gait_publisher")


def _leave_node(*_: object) -> None:
    """End the process of a node before it has opened anything."""
    os._exit(0)


def _start(node: str | None = None) -> None:
    """Run the command line, or a node as a separate program."""
    is_node = node is not None or (len(sys.argv) > 1 and sys.argv[1] in _NODES)
    try:
        if is_node:  # `ros.running.run` follows
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, _leave_node)  # there is nothing yet to put in order
            if not {"-h", "--help"} & set(sys.argv):
                print(LOADING.format(name=node or sys.argv[1]), flush=True)
        else:
            signal.signal(signal.SIGINT, interrupt)
        # before numpy is imported: a second thread on the small matrices here takes ten times the time
        os.environ.setdefault(_BLAS, os.environ.get("OMP_NUM_THREADS", "1"))
        from leg_wear_monitor.cli.main import main as run

        run(node)
    except KeyboardInterrupt:
        leave()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all work is done; only the exit is left
