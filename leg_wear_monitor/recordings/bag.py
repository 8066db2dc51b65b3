"""Recordings on disk: files, metadata, topics, and the source that reads each."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeAlias, cast

import attrs
from numpy.typing import ArrayLike

from leg_wear_monitor.errors import system_asked
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.findings import (
    CSV,
    PARQUET,
    REMEDIES,
    Channel,
    DamageError,
    Due,
    Finding,
    Piece,
    RecordingError,
    Severity,
    listed,
    open_recording,
)
from leg_wear_monitor.recordings.mcap_file import McapFile
from leg_wear_monitor.recordings.streams import Stream, streams_of
from leg_wear_monitor.twin import TORQUE

# Resolve the user's paths to an ordered list of recordings: bags (plain, split, compressed) and tables.


MCAP, IN_MEMORY = ".mcap", ""
TABLES = (CSV, PARQUET, IN_MEMORY)
_NAME = re.compile(r".*(\.mcap|\.db3)", re.DOTALL)
_TABLE = re.compile(r".*(\.csv|\.parquet)", re.DOTALL | re.IGNORECASE)
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_EXPECTED = "a bag directory, .mcap, .db3, .csv or .parquet"


class DataFrame(Protocol):
    """The used interface of a data frame, of pandas or of a different library."""

    @property
    def columns(self) -> Iterable[Any]:
        """Names of the columns."""

    def __getitem__(self, name: Any, /) -> Any:
        """A column."""


Recordable: TypeAlias = str | Path | Mapping[str, ArrayLike] | DataFrame
"""A path, or a table in memory: columns by name."""


@attrs.frozen
class BagFile:
    """One file of a recording.

    Attributes
    ----------
    path : pathlib.Path
    storage : str
        `MCAP`, `SQLITE`, `CSV`, `PARQUET`, or `IN_MEMORY`.
    recording : int
        Index of the given path that the file belongs to.
    table : optional
        Columns in memory.
    """

    path: Path
    storage: str
    recording: int = 0
    table: Any = None


def listed_recordings(given: Recordable | Iterable[Recordable]) -> list[Recordable]:
    """The given recordings: one, or several."""
    if isinstance(given, str | os.PathLike | Mapping) or hasattr(given, "columns"):
        return [cast("Recordable", given)]
    return list(given)


def find_files(paths: Iterable[Recordable]) -> list[BagFile]:
    """Find the recording files of paths.

    Parameters
    ----------
    paths : iterable
        Files, bag directories, tables in memory.

    Raises
    ------
    RecordingError
        If a path does not exist, or its name is not the name of a recording.
    """
    files: list[BagFile] = []
    for number, given in enumerate(paths):
        if not isinstance(given, str | os.PathLike):
            files.append(BagFile(Path(f"table {number + 1}"), IN_MEMORY, number, given))
            continue
        path = Path(given)
        with system_asked(path, "cannot be read", error_of=RecordingError):
            if not path.exists():
                raise RecordingError(str(path), "", f"does not exist. Expected {_EXPECTED}")
            found = _directory(path) if path.is_dir() else [path]
            files += [BagFile(each, _storage(each), number) for each in found]
    if not files:
        raise RecordingError("", "", f"no recording is given. Expected {_EXPECTED}")
    return files


def is_recording_name(path: Path) -> bool:
    """True if a file is a recording by its name."""
    return bool(_NAME.fullmatch(path.name) or _TABLE.fullmatch(path.name))


def is_bag_directory(path: Path) -> bool:
    """True if a directory is one recording, not a collection of them.

    It has metadata, or files with the names that rosbag2 gives them: it writes the metadata last.
    """
    names = [file.name for file in path.iterdir() if _NAME.fullmatch(file.name)]
    return bool(names) and (
        (path / "metadata.yaml").is_file() or all(name.startswith(f"{path.name}_") for name in names)
    )


def _storage(path: Path) -> str:
    """Kind of a file by its name, the lower-case end of it."""
    match = _NAME.fullmatch(path.name) or _TABLE.fullmatch(path.name)
    if match is None:
        remedy = REMEDIES.get(path.suffix.lower())
        text = remedy.format(path=path) if remedy else f"not a recognised recording. Expected {_EXPECTED}"
        raise RecordingError(str(path), "", text)
    if not path.is_file():
        raise RecordingError(str(path), "", f"not a file. Expected {_EXPECTED}")
    return match[1].lower()


def _directory(path: Path) -> list[Path]:
    """Files of a bag directory, by their numbers; a compressed file is refused later."""
    files = [file for file in path.iterdir() if _NAME.fullmatch(file.name) and file.is_file()]
    files = files or list(path.glob("*.zstd"))
    if not files:
        raise RecordingError(str(path), "", "contains no .mcap or .db3 file")
    return sorted(files, key=_by_number)


def _by_number(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Sort key that orders run_2.mcap before run_10.mcap."""
    parts = re.findall(r"\d+|\D+", path.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], path.name


# Selection of the crank and torque topics of a recording, and check of their types.


def find_topic(
    stream: Stream, given: str | None, topics: Iterable[str], where: str, beside: str | None
) -> str | None:
    """Topic of a stream: the given one, else its name next to the crank's, in the root, or in one namespace.

    Parameters
    ----------
    stream : Stream
    given : str, optional
    topics : iterable of str
        Topics of the recording.
    where : str
        File name in errors.
    beside : str, optional
        The crank's topic. If it has a namespace, topics in other namespaces belong to other legs.

    Returns
    -------
    str or None
        None if no topic was given and none was found.

    Raises
    ------
    RecordingError
        If the given topic does not exist, or several namespaces contain the name.
    """
    recorded = sorted(set(topics))
    if given is not None:
        topic = "/" + given.lstrip("/")
        if topic not in recorded:
            raise RecordingError(where, topic, f"is not a topic of the recording; it has {listed(recorded)}")
        return topic
    name, namespace = stream.topic, (beside or "").rpartition("/")[0]
    for topic in (f"{namespace}/{name}", f"/{name}"):
        if topic in recorded:
            return topic
    if namespace:
        return None
    near = [topic for topic in recorded if topic.endswith(f"/{name}")]
    if len(near) > 1:
        raise RecordingError(where, name, f"could be {listed(near)}; select one with {_option(stream)}")
    return near[0] if near else None


def _option(stream: Stream) -> str:
    """Option of the command line that names a stream's topic."""
    of_torque = stream.kind == TORQUE  # whichever topic has it
    return "--drive-torque" if of_torque else f"--{stream.topic}".replace("_", "-")


def check_channel(stream: Stream, channel: Channel, where: str) -> None:
    """Check that the messages of a channel can be decoded as messages of a stream.

    Parameters
    ----------
    stream : Stream
    channel : Channel
    where : str
        File name in errors.

    Raises
    ------
    RecordingError
        If they cannot; the message names the file, the topic and the expected type.
    """
    kind = channel.type or stream.type
    if kind != stream.type:
        raise RecordingError(where, channel.topic, f"is of type {kind}. Expected {stream.type}")
    if channel.encoding != "cdr":
        raise RecordingError(where, channel.topic, f"is encoded as {channel.encoding!r}. Expected 'cdr'")


# Uniform access to the files of a recording, and selection of the channels to read.


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
    types: dict[int, int] = attrs.Factory(dict)

    def select(self, stream: Stream, topic: str) -> None:
        """Select the channels of a topic, to be read as a stream."""
        for number, channel in self.file.channels.items():
            if channel.topic == topic:
                check_channel(stream, channel, str(self.bag_file.path))
                self.types[number] = stream.code

    def pieces(self) -> Iterator[Due]:
        """Pieces of the selected channels, in order of log time."""
        for start_ns, load in self.file.pieces(self.types):
            yield start_ns, partial(self._loaded, load)

    def _loaded(self, load: Callable[[], Piece | None]) -> Piece | None:
        piece = load()
        if piece is not None and len(piece.messages):
            begin = piece.messages["begin"][0]
            if piece.data[begin : begin + len(_ZSTD_MAGIC)].tobytes() == _ZSTD_MAGIC:
                text = "has messages that are compressed one by one. Convert it with ros2 bag convert"
                raise RecordingError(str(self.bag_file.path), "", text)
        return piece


def open_sources(
    bag_files: Iterable[BagFile], config: MonitorConfig, stack: ExitStack
) -> tuple[list[Source], list[Finding]]:
    """Open the files of a recording; an unreadable file becomes a finding if other files can be opened.

    Parameters
    ----------
    bag_files : iterable of BagFile
    config : MonitorConfig
        Columns and units of tables.
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
            sources.append(Source(bag_file, _open(bag_file, config, stack)))
        except RecordingError as error:
            failed.append(error)
    if not sources:
        raise failed[0]
    return sources, [Finding(Path(error.source), f"{error.fault}: it is lost") for error in failed]


def assign(
    sources: list[Source], config: MonitorConfig, given: Mapping[str, str | None]
) -> tuple[dict[str, str], list[Finding]]:
    """Find the topics of the streams that a monitor reads, and select their channels in each source.

    Parameters
    ----------
    sources : list of Source
    config : MonitorConfig
    given : mapping
        Topics that the user named, by their relative name in the node.

    Returns
    -------
    topics : dict
        Topic by its relative name in the node, for each stream that was found.
    findings : list of Finding

    Raises
    ------
    RecordingError
        If the crank's topic is missing, or the type of a topic cannot be read.
    """
    recorded = sorted({channel.topic for source in sources for channel in source.file.channels.values()})
    first = sources[0].bag_file.path
    topics: dict[str, str] = {}
    findings: list[Finding] = []
    for stream in streams_of(config):
        topic = find_topic(stream, given.get(stream.topic), recorded, str(first), topics.get("joint_states"))
        if topic is not None:
            topics[stream.topic] = topic
            for source in sources:
                source.select(stream, topic)
            continue
        text = f"is not a topic of the recording; it has {listed(recorded)}"
        if set(recorded) - set(topics.values()):  # an unused topic may be the renamed input
            text += f"; select one with {_option(stream)}"
        if stream.is_needed:
            raise RecordingError(str(first), stream.topic, text)
        findings.append(Finding(first, f"{stream.topic}: {text}", Severity.NOTE))
    return topics, findings


def _open(bag_file: BagFile, config: MonitorConfig, stack: ExitStack) -> OpenFile:
    path = bag_file.path
    try:
        with system_asked(path, "cannot be read", error_of=RecordingError):
            if bag_file.storage in TABLES:
                from leg_wear_monitor.recordings.table_file import (
                    TableFile,  # importing pyarrow takes a quarter of a second
                )

                is_file = bag_file.storage != IN_MEMORY
                content = stack.enter_context(open_recording(path)) if is_file else bag_file.table
                return TableFile(path, content, bag_file.storage, config)
            if bag_file.storage == MCAP:
                return McapFile(path, stack.enter_context(open_recording(path)))
            from leg_wear_monitor.recordings.database import DatabaseFile

            open_recording(path).close()  # SQLite does not say why it cannot open a file
            return DatabaseFile(path, stack)
    except DamageError as error:
        raise RecordingError(str(path), "", str(error)) from error
