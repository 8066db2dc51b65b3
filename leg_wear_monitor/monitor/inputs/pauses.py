"""Pauses in a stream of samples: times without a recording, as opposed to faults of the input."""

import attrs


@attrs.frozen
class Pauses:
    """Pauses between recordings.

    Attributes
    ----------
    number : int
    total_s : float
    passed_before_s : float
        Part of the pauses before the last one that the twin's unmonitored time includes.
    last_s : float
        Length of the last pause.
    unmonitored_s : float
        The twin's unmonitored time when the last pause began; it includes the pause once the leg is followed
        again.
    """

    number: int = 0
    total_s: float = 0.0
    passed_before_s: float = 0.0
    last_s: float = 0.0
    unmonitored_s: float = 0.0

    def passed_s(self, unmonitored_s: float) -> float:
        """Part of the pauses that the twin's unmonitored time includes [s]."""
        return self.passed_before_s + min(self.last_s, max(0.0, unmonitored_s - self.unmonitored_s))

    def with_pause(self, pause_s: float, unmonitored_s: float) -> "Pauses":
        """Pauses with one more, at a value of the twin's unmonitored time [s]."""
        return Pauses(
            self.number + 1, self.total_s + pause_s, self.passed_s(unmonitored_s), pause_s, unmonitored_s
        )
