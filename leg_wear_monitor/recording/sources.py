"""The files of a recording, opened alike, and which of their channels are wanted."""

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol

import attrs
import numpy as np

from leg_wear_monitor.recording.bag import MCAP, BagFile
from leg_wear_monitor.recording.compression import expand_file, expand_message
from leg_wear_monitor.recording.findings import Finding, RecordingError, Weight
from leg_wear_monitor.recording.layout import Channel
from leg_wear_monitor.recording.mcap_file import McapFile, Piece
from leg_wear_monitor.recording.topics import Role, check_channel, find_topic, listed


class OpenFile(Protocol):
    """What an MCAP and a .db3 file have in common."""

    path: Path
    size: int
    findings: list[Finding]

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels of the file by their number."""

    def pieces(self, types: dict[int, int]) -> Iterator[Piece]:
        """Messages of channels, given with the codes of their types."""


@attrs.define(eq=False)
class Source:
    """An open file of a recording, and the channels to read with their types."""

    bag_file: BagFile
    file: OpenFile
    types: dict[int, int] = attrs.Factory(dict)

    def pieces(self) -> Iterator[Piece]:
        """Messages that are wanted, in order of log time."""
        for piece in self.file.pieces(self.types):
            yield _expanded(piece) if self.bag_file.by_message else piece


def open_sources(bag_files: Iterable[BagFile], stack: ExitStack) -> tuple[list[Source], list[Finding]]:
    """Open what can be opened; a file that cannot be is lost if there are others.

    Parameters
    ----------
    bag_files : iterable of BagFile
    stack : contextlib.ExitStack
        Closes them.

    Raises
    ------
    RecordingError
        If none can be opened.
    """
    sources: list[Source] = []
    failed: list[RecordingError] = []
    for bag_file in bag_files:
        try:
            sources.append(Source(bag_file, _open(bag_file, stack)))
        except RecordingError as error:
            failed.append(error)
    if not sources:
        raise failed[0]
    return sources, [Finding(Path(error.source), f"{error.fault}: it is lost") for error in failed]


def assign(sources: list[Source], wanted: Iterable[Role]) -> tuple[dict[str, str], list[Finding]]:
    """Find the topics of roles, and set what to read from each source.

    Returns
    -------
    topics : dict
        Topic of each role that is there, by its name.
    findings : list of Finding

    Raises
    ------
    RecordingError
        If the crank's topic is not there, or a topic holds what cannot be read.
    """
    there = [channel.topic for source in sources for channel in source.file.channels.values()]
    first = sources[0].bag_file.path
    topics: dict[str, str] = {}
    findings: list[Finding] = []
    for role in wanted:
        topic = find_topic(role, there, str(first))
        if topic is not None:
            topics[role.name] = topic
            for source in sources:
                source.types |= _types(source, role, topic)
            continue
        text = f"is no topic of the recording, it has {listed(there)}"
        if role.needed:
            raise RecordingError(str(first), role.name, text)
        findings.append(Finding(first, f"{role.name}: {text}", Weight.NOTE))
    return topics, findings


def _types(source: Source, role: Role, topic: str) -> dict[int, int]:
    known = source.bag_file.types.get(topic, "")
    return {
        number: check_channel(role, channel, known, str(source.bag_file.path))
        for number, channel in source.file.channels.items()
        if channel.topic == topic
    }


def _open(bag_file: BagFile, stack: ExitStack) -> OpenFile:
    path = bag_file.path
    try:
        if bag_file.compressed:
            path = _expanded_file(bag_file, stack)
        if bag_file.storage == MCAP:
            return McapFile(bag_file.path, stack.enter_context(path.open("rb")))
    except OSError as error:
        raise RecordingError(str(bag_file.path), "", f"cannot be read: {error.strerror}") from error
    from leg_wear_monitor.recording.sqlite_file import SqliteFile

    return SqliteFile(bag_file.path, path, stack)


def _expanded_file(bag_file: BagFile, stack: ExitStack) -> Path:
    """Temporary file with the content of a compressed one."""
    path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / f"content{bag_file.storage}"
    with path.open("wb") as content:
        expand_file(bag_file.path, content)
    if not path.stat().st_size:
        raise RecordingError(str(bag_file.path), "", "holds nothing that can be decompressed")
    return path


def _expanded(piece: Piece) -> Piece:
    """The same messages, each decompressed."""
    raw = piece.data.tobytes()
    bounds = zip(piece.messages["begin"].tolist(), piece.messages["end"].tolist(), strict=True)
    contents = [expand_message(raw[begin:end]) for begin, end in bounds]
    messages = piece.messages.copy()
    messages["end"] = np.cumsum([len(content) for content in contents])
    messages["begin"] = messages["end"] - [len(content) for content in contents]
    return attrs.evolve(piece, data=np.frombuffer(b"".join(contents), np.uint8), messages=messages)
