"""What something took."""

import time


class Watch:
    """Seconds since it was made, by the wall clock and by the processor's time: less on a shared core."""

    def __init__(self) -> None:
        self._wall, self._processor = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Seconds by the wall clock and by the processor's time."""
        return time.perf_counter() - self._wall, time.process_time() - self._processor

    @property
    def processor(self) -> float:
        """Seconds by the processor's time."""
        return self.read()[1]
