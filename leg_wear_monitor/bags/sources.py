"""Uniform access to the files of a recording, and selection of the channels to read."""

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Protocol

import attrs
import numpy as np

from leg_wear_monitor.bags.bag import IN_MEMORY, MCAP, TABLES, BagFile
from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.mcap.compression import ZSTD_MAGIC, expand_message, expanded
from leg_wear_monitor.bags.mcap.file import Due, McapFile, Piece
from leg_wear_monitor.bags.mcap.layout import Channel
from leg_wear_monitor.bags.regular_file import open_regular
from leg_wear_monitor.bags.tables.file import TableFile
from leg_wear_monitor.bags.topics import Role, check_channel, find_topic, listed
from leg_wear_monitor.monitor.config.settings import MonitorConfig


class OpenFile(Protocol):
    """Common interface of MCAP files, .db3 files and tables."""

    path: Path
    size: int
    findings: list[Finding]

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels of the file by channel number."""

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the channels in `types` (stream code by channel number)."""


@attrs.define(eq=False)
class Source:
    """An open file of a recording, and the channels to read with their stream codes."""

    bag_file: BagFile
    file: OpenFile
    budget: Budget
    types: dict[int, int] = attrs.Factory(dict)

    def pieces(self) -> Iterator[Due]:
        """Pieces of the selected channels, in order of log time."""
        for due in self.file.pieces(self.types):
            yield attrs.evolve(due, load=partial(self._expanded, due)) if self.bag_file.by_message else due

    def _expanded(self, due: Due) -> Piece | None:
        """Load a piece and decompress each of its messages."""
        piece = due.load()
        return None if piece is None else _expanded(piece, self.budget.at_once // 2)


def open_sources(
    bag_files: Iterable[BagFile], config: MonitorConfig, budget: Budget, stack: ExitStack
) -> tuple[list[Source], list[Finding]]:
    """Open the files of a recording; an unreadable file becomes a finding if another one can be opened.

    Parameters
    ----------
    bag_files : iterable of BagFile
    config : MonitorConfig
        Columns and units of tables.
    budget : Budget
    stack : contextlib.ExitStack
        Closes the files.

    Raises
    ------
    RecordingError
        If no file can be opened.
    """
    sources: list[Source] = []
    failed: list[RecordingError] = []
    for bag_file in bag_files:
        try:
            sources.append(Source(bag_file, _open(bag_file, config, budget, stack), budget))
        except RecordingError as error:
            failed.append(error)
    if not sources:
        raise failed[0]
    return sources, [Finding(Path(error.source), f"{error.fault}: it is lost") for error in failed]


def assign(sources: list[Source], wanted: Iterable[Role]) -> tuple[dict[str, str], list[Finding]]:
    """Find the topics of roles, and select the channels to read from each source.

    Returns
    -------
    topics : dict
        Topic by role name, for each role that was found.
    findings : list of Finding

    Raises
    ------
    RecordingError
        If the crank's topic is missing, or the type of a topic cannot be read.
    """
    recorded = [channel.topic for source in sources for channel in source.file.channels.values()]
    first = sources[0].bag_file.path
    topics: dict[str, str] = {}
    findings: list[Finding] = []
    for role in wanted:
        topic = find_topic(role, recorded, str(first))
        if topic is not None:
            topics[role.name] = topic
            for source in sources:
                source.types |= _types(source, role, topic)
            continue
        text = f"is not a topic of the recording, it has {listed(recorded)}"
        if role.stream.is_needed:
            raise RecordingError(str(first), role.name, text)
        findings.append(Finding(first, f"{role.name}: {text}", Severity.NOTE))
    return topics, findings


def _types(source: Source, role: Role, topic: str) -> dict[int, int]:
    known = source.bag_file.types.get(topic, "")
    return {
        number: check_channel(role, channel, known, str(source.bag_file.path))
        for number, channel in source.file.channels.items()
        if channel.topic == topic
    }


def _open(bag_file: BagFile, config: MonitorConfig, budget: Budget, stack: ExitStack) -> OpenFile:
    path = bag_file.path
    try:
        if bag_file.storage == IN_MEMORY:
            return TableFile(path, bag_file.table, bag_file.storage, config, budget)
        if bag_file.compressed:
            path = _expanded_file(bag_file, budget, stack)
        if bag_file.storage in TABLES:
            content = stack.enter_context(open_regular(path))
            return TableFile(bag_file.path, content, bag_file.storage, config, budget)
        if bag_file.storage == MCAP:
            return McapFile(bag_file.path, stack.enter_context(open_regular(path)), budget)
    except DamageError as error:
        raise RecordingError(str(bag_file.path), "", str(error)) from error
    except OSError as error:
        raise RecordingError(str(bag_file.path), "", f"cannot be read: {error.strerror}") from error
    from leg_wear_monitor.bags.sqlite.file import SqliteFile

    return SqliteFile(bag_file.path, path, budget, stack)


def _expanded_file(bag_file: BagFile, budget: Budget, stack: ExitStack) -> Path:
    """Decompress a file to a temporary file; its size counts as memory."""
    path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / f"content{bag_file.storage}"
    with open_regular(bag_file.path) as file, path.open("wb") as content:
        if file.read(len(ZSTD_MAGIC)) != ZSTD_MAGIC:
            raise DamageError("is not a zstd file, although its name says so")
        file.seek(0)
        for part in expanded(file):
            budget.take(len(part))
            content.write(part)
        if not content.tell():
            raise DamageError("contains nothing that can be decompressed")
    return path


def _expanded(piece: Piece, most: int) -> Piece:
    """Decompress each message of a piece, up to `most` bytes in total."""
    contents = []
    for begin, end in zip(piece.messages["begin"].tolist(), piece.messages["end"].tolist(), strict=True):
        contents.append(expand_message(piece.data[begin:end].tobytes(), most))
        most -= len(contents[-1])
    messages = piece.messages.copy()
    messages["end"] = np.cumsum([len(content) for content in contents])
    messages["begin"] = messages["end"] - [len(content) for content in contents]
    return attrs.evolve(piece, data=np.frombuffer(b"".join(contents), np.uint8), messages=messages)
