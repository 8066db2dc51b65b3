"""A recording as blocks of gait samples: any files, any damage, in order of log time, in bounded memory."""

import heapq
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from operator import attrgetter
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.monitor.config import MonitorConfig
from leg_wear_monitor.recording.bag import find_files
from leg_wear_monitor.recording.clocks import Clocks
from leg_wear_monitor.recording.decoder import Decoder, mark_zero_stamps
from leg_wear_monitor.recording.findings import Finding, RecordingError, Weight
from leg_wear_monitor.recording.mcap_file import Piece
from leg_wear_monitor.recording.sources import assign, open_sources
from leg_wear_monitor.recording.topics import roles
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, NO_FAULT, ZERO_STAMP, Samples

TIMES = ("header", "log", "publish")
_TOGETHER = 4096  # samples that a block should have at least


@attrs.frozen(eq=False)
class Block:
    """Samples in order of log time.

    Attributes
    ----------
    samples : (n,) array of GAIT_SAMPLE
    log_time_ns : (n,) array of int
    share : float
        Part of the recording's bytes read so far, 0 to 1.
    """

    samples: Samples
    log_time_ns: NDArray[np.int64]
    share: float


class Recording:
    """Open recordings, several as one.

    Messages come in order of their log time, and as they stand in the file where it is the same: the order
    in which they were received.

    Parameters
    ----------
    paths : iterable
        MCAP and .db3 files, bag directories; zstd-compressed or not.
    config : MonitorConfig
        What the crank is called and where the torque comes from.
    joint_states, drive_torque : str, optional
        Topics; found by their relative names if not given.
    time : str
        One of `TIMES`: which time stamps the samples. Float64 has no header, it takes the log time.

    Attributes
    ----------
    topics : dict
        Topics that are read, by what they are in the node.

    Raises
    ------
    RecordingError
        If there is nothing in them that can be used.
    """

    def __init__(
        self,
        paths: Iterable[str | Path],
        config: MonitorConfig,
        *,
        joint_states: str | None = None,
        drive_torque: str | None = None,
        time: str = "header",
    ) -> None:
        if time not in TIMES:
            raise RecordingError("time", "", f"{time!r} is not one of {', '.join(TIMES)}")
        self.time = time
        self._clocks = Clocks()
        self._decoder = Decoder(config)
        bag_files, self._findings = find_files(paths)
        with ExitStack() as stack:
            self._sources, lost = open_sources(bag_files, stack)
            wanted = roles(config.drive_torque.source, joint_states, drive_torque)
            self.topics, missing = assign(self._sources, wanted)
            self._close = stack.pop_all()
        self._findings += lost + missing

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._close.close()

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return [source.bag_file.path for source in self._sources]

    @property
    def findings(self) -> list[Finding]:
        """What was found so far; complete once all blocks are read."""
        return self._findings + [each for source in self._sources for each in source.file.findings]

    @property
    def is_partial(self) -> bool:
        """Whether something that was recorded is lost, or may be wrong."""
        return any(finding.weight is Weight.LOSS for finding in self.findings)

    def blocks(self) -> Iterator[Block]:
        """Samples of the whole recording; once."""
        read, total = 0, max(1, sum(source.file.size for source in self._sources))
        waiting = Block(np.zeros(0, GAIT_SAMPLE), np.zeros(0, np.int64), 0.0)
        pieces = (source.pieces() for source in self._sources)
        for piece in heapq.merge(*pieces, key=attrgetter("start_ns")):
            passed = int(np.searchsorted(waiting.log_time_ns, piece.start_ns))
            if passed >= _TOGETHER:
                yield _part(waiting, slice(passed))
                waiting = _part(waiting, slice(passed, None))
            read += piece.stored
            waiting = _merged(waiting, piece, self._samples(piece), min(read / total, 1.0))
        if len(waiting.samples):
            yield attrs.evolve(waiting, share=1.0)
        notes = self._clocks.notes()
        self._findings += [Finding(self.files[0], text, Weight.NOTE) for text in notes]

    def _samples(self, piece: Piece) -> Samples:
        """Decode a piece, and stamp its samples as asked for."""
        samples = self._decoder.many(piece.data, piece.messages)
        self._clocks.compare(samples, piece.messages)
        if self.time != "header":
            samples["fault"][samples["fault"] == ZERO_STAMP] = NO_FAULT
            samples["stamp_ns"] = piece.messages[f"{self.time}_time_ns"]
            mark_zero_stamps(samples)
        return samples


def _part(block: Block, which: slice) -> Block:
    return Block(block.samples[which], block.log_time_ns[which], block.share)


def _merged(block: Block, piece: Piece, samples: Samples, share: float) -> Block:
    """Samples of a block and of a piece in order of log time."""
    times = np.concatenate([block.log_time_ns, piece.messages["log_time_ns"]])
    samples = np.concatenate([block.samples, samples])
    if np.any(times[1:] < times[:-1]):
        order = np.argsort(times, kind="stable")
        times, samples = times[order], samples[order]
    return Block(samples, times, share)
