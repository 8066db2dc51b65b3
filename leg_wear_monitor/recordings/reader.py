"""Reads recordings, even if damaged, as blocks of gait samples in log-time order, in bounded memory."""

import heapq
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import repeat
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import system_asked
from leg_wear_monitor.monitor.alarms import amount, time_words
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import bag
from leg_wear_monitor.recordings.cdr import Decoder, mark_zero_stamps
from leg_wear_monitor.recordings.findings import Finding, Piece, RecordingError, Severity, listed
from leg_wear_monitor.recordings.message_checks import MessageChecks
from leg_wear_monitor.recordings.streams import JOINT_STATE, streams_of
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.crank_motion import BACKWARD_JUMP_NS
from leg_wear_monitor.twin.sample import (
    BRIDGE_LIMIT_S,
    GAIT_SAMPLE,
    NO_FAULT,
    ZERO_STAMP,
    Samples,
)

# Check that several files record one leg: the same topics, and the crank joint in their messages.


_ADVICE = "are these two legs? Give one leg at a time, or select its topic with --joint-states"


def check_topics(
    sources: Iterable[bag.Source], topics: dict[str, str], joint_states: str | None
) -> list[Finding]:
    """Check that each file has the crank's topic, or has no other topic that could be a crank's.

    Parameters
    ----------
    sources : iterable of Source
    topics : dict
        Topic by role.
    joint_states : str, optional
        The topic, if the user named it.

    Raises
    ------
    RecordingError
        If a file has a crank's topic in a different namespace and the user named no topic.
    """
    topic, findings = topics["joint_states"], []
    for source in sources:
        recorded = {channel.topic for channel in source.file.channels.values()}
        if topic in recorded:
            continue
        others = [other for other in recorded if other.endswith("/joint_states")]
        if others and joint_states is None:
            text = f"has {listed(sorted(others))}, where other files have {topic}: {_ADVICE}"
            raise RecordingError(str(source.bag_file.path), "joint_states", text)
        text = f"has no topic {topic}: no crank is read from it"
        findings.append(Finding(source.bag_file.path, text, Severity.NOTE))
    return findings


# Pauses between recordings that are replayed together: time without recording, not an input fault.


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


_LONG_NS = 10 * 10**9  # a gap inside a recording that is reported as a pause


class Pauses:
    """Splits blocks where one recording has ended and the next one begins later; reports pauses inside.

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
    total_ns : int
        Total duration of the pauses so far, between and inside recordings.
    """

    def __init__(self, files: Sequence[Path], recordings: Sequence[int], shortest_ns: int) -> None:
        self._files, self._shortest_ns = files, shortest_ns
        self._recordings = np.array(recordings, np.int64)
        self._known: set[int] = set()
        self._last_ns = 0
        self.findings: list[Finding] = []
        self.total_ns = 0

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
            elif self._known and times[at + 1] - times[at] > _LONG_NS:
                self._report_inside(block.source[at], int(times[at]), int(times[at + 1]))
        self._known.update(self._recordings[block.source].tolist())
        self._last_ns = int(times[-1])
        if begin < len(block.samples):
            yield block.part(slice(begin, None), pause_ns)

    def _report(self, source: int, pause_ns: int) -> None:
        text = (
            f"begins {pause_ns * 1.0e-9:.4g} s after the recording before it ended; the leg was not "
            "monitored during this pause, which is not a fault of the input"
        )
        self.total_ns += pause_ns
        self.findings.append(Finding(self._files[source], text, Severity.NOTE))

    def _report_inside(self, source: int, from_ns: int, to_ns: int) -> None:
        """Report a pause, or a clock that was set; the times cannot distinguish the two."""
        text = (
            f"has no samples for {amount(1.0e-9 * (to_ns - from_ns), 's')} after {time_words(from_ns)}: "
            "the recording paused, or the clock was set; cadence and speed ignore this time"
        )
        self.total_ns += to_ns - from_ns
        self.findings.append(Finding(self._files[source], text, Severity.NOTE))


# A clock that was set back.


def clock_steps(path: Path, times_ns: NDArray[np.int64]) -> tuple[NDArray[np.bool_], list[Finding]]:
    """Where times go back although the samples go on, (n,), and a finding for each such step.

    Parameters
    ----------
    path : pathlib.Path
    times_ns : (n,) array of int
        Times in order of arrival. One alone that is wrong is no step.
    """
    beside = np.concatenate([times_ns[:1], times_ns, times_ns[-1:]])
    steady = np.sort([beside[:-2], beside[1:-1], beside[2:]], axis=0)[1]
    back = np.diff(steady, prepend=steady[:1]) < -BACKWARD_JUMP_NS
    findings = []
    for at in np.flatnonzero(back).tolist():
        step = amount(1.0e-9 * int(times_ns[at - 1] - times_ns[at]), "s")
        text = f"has stamps that go back by {step} after {time_words(int(times_ns[at - 1]))}"
        findings.append(Finding(path, f"{text}: the clock was set back", Severity.NOTE))
    return np.asarray(back), findings


TIMES = ("header", "log")
_TOGETHER = 4096  # smallest intended number of samples in a block
_FAR_NS = 1_000_000_000  # difference between header stamps and log times


class Recording:
    """One or more open recordings, read as one.

    Messages are ordered by log time, which is the order of reception. Messages of equal log time keep their
    order in the file.

    Parameters
    ----------
    paths : iterable
        MCAP, .db3, CSV and Parquet files; bag directories; tables in memory.
    config : MonitorConfig
        Provides the name of the crank joint and the source of the torque.
    joint_states, drive_torque, foot_load : str, optional
        Topics; by default found by their relative names.
    time : str
        Time that stamps the samples, one of `TIMES`. Float64 messages have no header and use the log time.

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
        paths: Iterable[bag.Recordable],
        config: MonitorConfig,
        *,
        joint_states: str | None = None,
        drive_torque: str | None = None,
        foot_load: str | None = None,
        time: str = "header",
    ) -> None:
        if time not in TIMES:
            raise RecordingError("time", "", f"{time!r} is not one of {', '.join(TIMES)}")
        self.time = time
        self._apart_ns: int | None = None  # from the crank's header stamps to its log times
        self._unstamped = [stream.topic for stream in streams_of(config) if not stream.has_stamp]
        self._last_ns = dict[int, NDArray[np.int64]]()
        self._decoder = Decoder(config)
        bag_files, self._findings = bag.find_files(paths), list[Finding]()
        self._crank, self._checks = config.crank_joint, MessageChecks(config)
        with ExitStack() as stack:
            self._sources, lost = bag.open_sources(bag_files, config, stack)
            given = {"joint_states": joint_states, "drive_torque": drive_torque, "foot_load": foot_load}
            given["dynamic_joint_states"] = drive_torque
            self.topics, missing = bag.assign(self._sources, config, given)
            self._findings += lost + missing + check_topics(self._sources, self.topics, joint_states)
            self._close = stack.pop_all()
        numbers = [source.bag_file.recording for source in self._sources]
        self._pauses = Pauses(self.files, numbers, round(BRIDGE_LIMIT_S * 1.0e9))

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
    def paused_s(self) -> float:
        """Total duration of the pauses so far [s]."""
        return 1.0e-9 * self._pauses.total_ns

    @property
    def is_partial(self) -> bool:
        """True if recorded data are lost or may be wrong."""
        return any(finding.weight is Severity.LOSS for finding in self.findings)

    def blocks(self) -> Iterator[Block]:
        """Iterate over the samples of the whole recording; possible once only.

        Raises
        ------
        RecordingError
            At the end, if no message contains the crank; immediately, if the system cannot read the files.
        """
        named = ", ".join(map(str, self.files))
        with system_asked(named, "cannot be read", error_of=RecordingError):
            for block in self._joined():
                self._note_clock_steps(block)
                yield from self._pauses.cut(block)
        self._report_checks(self.files[0])
        apart_ns = self._apart_ns or 0
        for topic in self._unstamped:
            if topic in self.topics and abs(apart_ns) > _FAR_NS:
                text = f"{topic} has no header, so its stamps are log times; they are {apart_ns / 1e9:.6g} s"
                text += " after the header stamps of joint_states; try --time log"
                self._findings.append(Finding(self.files[0], text, Severity.NOTE))

    def _report_checks(self, path: Path) -> None:
        checks = self._checks
        if checks.crank_fault:
            raise RecordingError(str(path), self._crank, checks.crank_fault)
        if checks.missing:
            text = f"joint {self._crank} is not in {checks.missing} messages; {checks.found} messages have it"
            self._findings.append(Finding(path, text, Severity.NOTE))
        if checks.interface_fault:
            text = f"{checks.lacking} messages of dynamic_joint_states: {checks.interface_fault}"
            self._findings.append(Finding(path, text))
        if checks.axis_fault:
            self._findings.append(Finding(path, checks.axis_fault))

    def _note_clock_steps(self, block: Block) -> None:
        cranks = (block.samples["kind"] == CRANK) & (block.samples["fault"] == NO_FAULT)
        for number in np.unique(block.source).tolist():
            stamps = block.samples["stamp_ns"][cranks & (block.source == number)]
            stamps = np.append(self._last_ns.get(number, stamps[:1]), stamps)
            steps = clock_steps(self.files[number], stamps)[1]
            self._findings += [one for one in steps if one not in self._findings]
            self._last_ns[number] = stamps[-2:]  # two, because a wrong stamp may be the last one of a block

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
        for number, (_, load) in heapq.merge(*dues, key=lambda each: each[1][0]):
            piece = load()
            if piece is not None:
                yield number, piece

    def _samples(self, bag_file: bag.BagFile, piece: Piece) -> Samples:
        """Decode a piece, and stamp its samples with the selected time."""
        if piece.samples is not None:  # a table has one clock only
            return self._decoder.scaled(piece.samples)
        samples = self._decoder.many(piece.data, piece.messages)
        kinds, good = piece.messages["type"], samples["fault"] == NO_FAULT
        self._findings += clock_steps(bag_file.path, piece.messages["log_time_ns"][kinds == JOINT_STATE])[1]
        self._checks.add(kinds, samples, piece.raw)
        for first in np.flatnonzero(good & (kinds == JOINT_STATE))[:1] if self._apart_ns is None else ():
            self._apart_ns = int(piece.messages["log_time_ns"][first] - samples["stamp_ns"][first])
        if self.time != "header":
            samples["fault"][samples["fault"] == ZERO_STAMP] = NO_FAULT
            samples["stamp_ns"] = piece.messages["log_time_ns"]
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
