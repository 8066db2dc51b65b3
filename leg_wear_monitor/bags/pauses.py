"""Pauses between recordings that are replayed together: time without recording, not an input fault."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import Finding, Severity
from leg_wear_monitor.twin.sample import Samples


@attrs.frozen(eq=False)
class Block:
    """Samples in order of log time.

    Attributes
    ----------
    samples : (n,) array of GAIT_SAMPLE
    log_time_ns : (n,) array of int
    fraction : float
        Fraction of the recording's bytes read so far, 0 to 1.
    source : (n,) array of int
        File index of each sample.
    pause_ns : int
        Duration of the pause before this block, in log time [ns]; 0 if there was no pause.
    """

    samples: Samples
    log_time_ns: NDArray[np.int64]
    fraction: float
    source: NDArray[np.int64]
    pause_ns: int = 0

    def part(self, which: slice, pause_ns: int = 0) -> "Block":
        """Block of a subset of the samples."""
        return Block(
            self.samples[which], self.log_time_ns[which], self.fraction, self.source[which], pause_ns
        )


class Pauses:
    """Splits blocks where one recording has ended and the next one begins later.

    Parameters
    ----------
    files : sequence of pathlib.Path
        File by source index.
    recordings : sequence of int
        Recording index of each file; files of one bag have no pauses between them.
    shortest_ns : int
        Shortest gap that counts as a pause [ns].

    Attributes
    ----------
    findings : list of Finding
    """

    def __init__(self, files: Sequence[Path], recordings: Sequence[int], shortest_ns: int) -> None:
        self._files, self._shortest_ns = files, shortest_ns
        self._recordings = np.array(recordings, np.int64)
        self._known: set[int] = set()
        self._last_ns = 0
        self.findings: list[Finding] = []

    def cut(self, block: Block) -> Iterator[Block]:
        """Split a block at its pauses."""
        times = np.concatenate([[self._last_ns], block.log_time_ns])
        begin, pause_ns = 0, 0
        for at in np.flatnonzero(np.diff(times) > self._shortest_ns).tolist():
            recordings = self._recordings[block.source]
            self._known.update(recordings[:at].tolist())
            if self._known and recordings[at] not in self._known:
                if at > begin:
                    yield block.part(slice(begin, at), pause_ns)
                begin, pause_ns = at, int(times[at + 1] - times[at])
                self._report(block.source[at], pause_ns)
        self._known.update(self._recordings[block.source].tolist())
        self._last_ns = int(times[-1])
        if begin < len(block.samples):
            yield block.part(slice(begin, None), pause_ns)

    def _report(self, source: int, pause_ns: int) -> None:
        text = (
            f"begins {pause_ns * 1.0e-9:.4g} s after the recording before it ended; the leg was not "
            "monitored during this pause, which is not a fault of the input"
        )
        self.findings.append(Finding(self._files[source], text, Severity.NOTE))
