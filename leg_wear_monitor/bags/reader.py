"""Reads recordings, damaged ones too, as blocks of gait samples in log-time order, in bounded memory."""

import heapq
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from itertools import repeat
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.bag import TABLES, BagFile, Recordable, find_files
from leg_wear_monitor.bags.budget import DEFAULT_MB, Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError, Severity
from leg_wear_monitor.bags.joint_names import JointNames
from leg_wear_monitor.bags.mcap.file import Piece
from leg_wear_monitor.bags.one_leg import OneLeg, check_topics
from leg_wear_monitor.bags.pauses import Block, Pauses
from leg_wear_monitor.bags.sources import assign, open_sources
from leg_wear_monitor.bags.topics import roles
from leg_wear_monitor.messages.clocks import Clocks
from leg_wear_monitor.messages.decode import Decoder, mark_zero_stamps
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, NO_FAULT, ZERO_STAMP, Samples

TIMES = ("header", "log", "publish")
_TOGETHER = 4096  # smallest intended number of samples in a block
_OF_A_SAMPLE = 800  # memory of one queued sample, including copies [bytes]


class Recording:
    """One or more open recordings, read as one.

    Messages are ordered by log time, which is the order of reception. Messages of equal log time keep their
    order in the file.

    Parameters
    ----------
    paths : iterable
        MCAP, .db3, CSV and Parquet files, zstd-compressed or not; bag directories; tables in memory.
    config : MonitorConfig
        Provides the name of the crank joint and the source of the torque.
    joint_states, drive_torque, foot_load : str, optional
        Topics; by default found by their relative names.
    time : str
        Time that stamps the samples, one of `TIMES`. Float64 messages have no header and use the log time.
    memory_mb : float
        Memory limit for reading, including temporary files [10⁶ bytes].

    Attributes
    ----------
    topics : dict
        Topics that are read, by their relative name in the node.

    Raises
    ------
    RecordingError
        If the recordings contain nothing usable.
    """

    def __init__(
        self,
        paths: Iterable[Recordable],
        config: MonitorConfig,
        *,
        joint_states: str | None = None,
        drive_torque: str | None = None,
        foot_load: str | None = None,
        time: str = "header",
        memory_mb: float = DEFAULT_MB,
    ) -> None:
        if time not in TIMES:
            raise RecordingError("time", "", f"{time!r} is not one of {', '.join(TIMES)}")
        self.time = time
        self._clocks = Clocks()
        self._decoder = Decoder(config)
        self._budget = Budget(memory_mb)
        self._joints = JointNames(config.crank_joint)
        self._one_leg = OneLeg()
        bag_files, self._findings = find_files(paths)
        with ExitStack() as stack:
            self._sources, lost = open_sources(bag_files, config, self._budget, stack)
            given = {"joint_states": joint_states, "drive_torque": drive_torque, "foot_load": foot_load}
            self.topics, missing = assign(self._sources, roles(config, given))
            self._findings += lost + missing + check_topics(self._sources, self.topics, joint_states)
            self._close = stack.pop_all()
        recordings = [source.bag_file.recording for source in self._sources]
        self._pauses = Pauses(self.files, recordings, round(config.tracker.gap_limit_s * 1.0e9))

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
        """Findings so far; complete after all blocks have been read."""
        found = [each for source in self._sources for each in source.file.findings]
        return self._findings + found + self._pauses.findings

    @property
    def is_partial(self) -> bool:
        """Whether recorded data are lost or may be wrong."""
        return any(finding.severity is Severity.LOSS for finding in self.findings)

    def blocks(self) -> Iterator[Block]:
        """Iterate over the samples of the whole recording; possible once only.

        Raises
        ------
        RecordingError
            At the end, if no message contains the crank; immediately, if the files are of two legs.
        """
        for block in self._joined():
            yield from self._pauses.cut(block)
        self._findings += self._joints.findings()
        notes = self._clocks.notes()
        self._findings += [Finding(self.files[0], text, Severity.NOTE) for text in notes]

    def _joined(self) -> Iterator[Block]:
        """Samples of all files in order of log time."""
        read, total = 0, max(1, sum(source.file.size for source in self._sources))
        none: NDArray[np.int64] = np.zeros(0, np.int64)
        waiting = Block(np.zeros(0, GAIT_SAMPLE), none, 0.0, none)
        for number, piece in self._pieces():
            bag_file = self._sources[number].bag_file
            passed = int(np.searchsorted(waiting.log_time_ns, piece.start_ns))
            if passed >= _TOGETHER:
                yield waiting.part(slice(passed))
                waiting = waiting.part(slice(passed, None))
            elif len(waiting.samples) * _OF_A_SAMPLE > self._budget.left:
                self._too_many_wait(bag_file.path)
                yield waiting
                waiting = waiting.part(slice(0))
            read += piece.stored
            times = piece.messages["log_time_ns"]
            source = np.full(len(times), number, np.int64)
            new = Block(self._samples(bag_file, piece), times, min(read / total, 1.0), source)
            waiting = _merged(waiting, new)
        if len(waiting.samples):
            yield attrs.evolve(waiting, fraction=1.0)

    def _pieces(self) -> Iterator[tuple[int, Piece]]:
        """Pieces of all files, with their file index, ordered by start time; loaded only when needed."""
        dues = (
            zip(repeat(number), source.pieces(), strict=False) for number, source in enumerate(self._sources)
        )
        for number, due in heapq.merge(*dues, key=lambda each: each[1].start_ns):
            piece = due.load()
            if piece is not None:
                yield number, piece

    def _too_many_wait(self, path: Path) -> None:
        text = (
            "has chunks that overlap in time by more messages than --memory-mb allows: some come out of order"
        )
        if not any(finding.text == text for finding in self._findings):
            self._findings.append(Finding(path, text))

    def _samples(self, bag_file: BagFile, piece: Piece) -> Samples:
        """Decode a piece, and stamp its samples with the selected time."""
        samples = self._decoder.many(piece.data, piece.messages)
        self._joints.add_samples(bag_file.path, piece.data, piece.messages, samples)
        if len(self._sources) > 1:
            self._one_leg.add_samples(bag_file.path, samples)
        if bag_file.storage not in TABLES:  # which have one clock only
            self._clocks.compare(samples, piece.messages)
        if self.time != "header":
            samples["fault"][samples["fault"] == ZERO_STAMP] = NO_FAULT
            samples["stamp_ns"] = piece.messages[f"{self.time}_time_ns"]
            mark_zero_stamps(samples)
        return samples


def _merged(block: Block, new: Block) -> Block:
    """Merge two blocks in order of log time."""
    times = np.concatenate([block.log_time_ns, new.log_time_ns])
    samples = np.concatenate([block.samples, new.samples])
    source = np.concatenate([block.source, new.source])
    if np.any(times[1:] < times[:-1]):
        order = np.argsort(times, kind="stable")
        times, samples, source = times[order], samples[order], source[order]
    return Block(samples, times, new.fraction, source)
