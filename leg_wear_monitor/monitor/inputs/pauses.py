"""Pauses in a stream of samples: times in which nobody recorded, apart from times that the input lost."""

import attrs


@attrs.frozen
class Pauses:
    """Pauses between recordings.

    Attributes
    ----------
    number : int
    total_s : float
    passed_before_s : float
        What of the pauses before the last is in the twin's time without a leg.
    last_s : float
        The last pause.
    unmonitored_s : float
        The twin's time without a leg when the last pause began; the pause is in it once the leg is found
        again.
    """

    number: int = 0
    total_s: float = 0.0
    passed_before_s: float = 0.0
    last_s: float = 0.0
    unmonitored_s: float = 0.0

    def passed_s(self, unmonitored_s: float) -> float:
        """What of the pauses is in the twin's time without a leg [s]."""
        return self.passed_before_s + min(self.last_s, max(0.0, unmonitored_s - self.unmonitored_s))

    def with_pause(self, pause_s: float, unmonitored_s: float) -> "Pauses":
        """One more, at a value of the twin's time without a leg [s]."""
        return Pauses(
            self.number + 1, self.total_s + pause_s, self.passed_s(unmonitored_s), pause_s, unmonitored_s
        )
