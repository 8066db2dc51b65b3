"""What the log of a node says while something takes long."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY_S = 10.0


@contextmanager
def repeated(say: Callable[[float], None], every_s: float = EVERY_S) -> Iterator[None]:
    """Call a function with the seconds passed, again and again, while the work inside lasts.

    Parameters
    ----------
    say : callable
        Is called in a thread of its own.
    every_s : float, s
    """
    done = threading.Event()

    def repeat() -> None:
        passed_s = every_s
        while not done.wait(every_s):
            say(passed_s)
            passed_s += every_s

    thread = threading.Thread(target=repeat, daemon=True)  # a signal may end the process meanwhile
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
