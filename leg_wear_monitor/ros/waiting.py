"""Progress messages in a node's log during long operations."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY_S = 10.0


@contextmanager
def repeated(report: Callable[[float], None], every_s: float = EVERY_S) -> Iterator[None]:
    """Call a function periodically with the elapsed seconds while the body of the context runs.

    Parameters
    ----------
    say : callable
        Called in a separate thread with the elapsed time [s].
    every_s : float, s
    """
    done = threading.Event()

    def repeat() -> None:
        passed_s = every_s
        while not done.wait(every_s):
            report(passed_s)
            passed_s += every_s

    thread = threading.Thread(target=repeat, daemon=True)  # a signal may end the process meanwhile
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
