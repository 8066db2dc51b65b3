"""Selection of the crank and torque topics of a recording, and check of their types."""

from collections.abc import Iterable, Mapping

import attrs

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap.layout import Channel
from leg_wear_monitor.errors import printable
from leg_wear_monitor.messages.streams import Stream, streams_read
from leg_wear_monitor.monitor.config.settings import MonitorConfig


@attrs.frozen
class Role:
    """Input required from a recording: its stream, and its topic if the user named one."""

    stream: Stream
    topic: str | None = None

    @property
    def name(self) -> str:
        """Relative topic name, as in the node."""
        return self.stream.topic


def roles(config: MonitorConfig, given: Mapping[str, str | None]) -> list[Role]:
    """Inputs that a monitor needs; `given` holds the user's topics."""
    read = streams_read(config.drive_torque.source, config.foot_load.source)
    return [Role(stream, given.get(stream.topic)) for stream in read]


def find_topic(role: Role, topics: Iterable[str], where: str) -> str | None:
    """Topic of a role: the given one, else the name in the root, else the name in its only namespace.

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
    if role.topic is not None:
        topic = "/" + role.topic.lstrip("/")
        if topic not in recorded:
            raise RecordingError(where, topic, f"is not a topic of the recording, it has {listed(recorded)}")
        return topic
    if f"/{role.name}" in recorded:
        return f"/{role.name}"
    near = [topic for topic in recorded if topic.endswith(f"/{role.name}")]
    if len(near) > 1:
        option = f"--{role.name}".replace("_", "-")
        raise RecordingError(where, role.name, f"could be {listed(near)}, select one with {option}")
    return near[0] if near else None


def check_channel(role: Role, channel: Channel, known_type: str, where: str) -> int:
    """Stream code of a channel, after a check that its messages can be decoded.

    Parameters
    ----------
    role : Role
    channel : Channel
    known_type : str
        Type of the topic from metadata.yaml; empty if unknown.
    where : str
        File name in errors.

    Raises
    ------
    RecordingError
        If they cannot; the message names the file, the topic and the expected type.
    """
    stream = role.stream
    kind = channel.type or known_type or stream.type
    if kind != stream.type:
        raise RecordingError(where, channel.topic, f"is of type {kind}, expected {stream.type}")
    if channel.encoding != "cdr":
        raise RecordingError(where, channel.topic, f"is encoded as {channel.encoding!r}, expected 'cdr'")
    if channel.definition_encoding == "ros2msg" and channel.definition:
        fields = _fields(channel.definition)
        if fields != stream.fields:
            text = f"defines {kind} by {'; '.join(fields)}, expected {'; '.join(stream.fields)}"
            raise RecordingError(where, channel.topic, text)
    return stream.code


def _fields(definition: str) -> tuple[str, ...]:
    """Type and name of each field in a definition's main part, without constants and comments."""
    fields = []
    for line in definition.splitlines():
        if line.startswith("====="):
            break
        words = line.split("#")[0].split()
        if len(words) == 2 and "=" not in words[1]:
            fields.append(f"{words[0].split('/')[-1]} {words[1]}")
    return tuple(fields)


def listed(names: Iterable[str]) -> str:
    """Sorted names as text, shortened if there are many."""
    names = sorted(set(names))
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return (", ".join(printable(name, 100) for name in names[:20]) or "none") + more
