"""Messages of a recording, read by mcap's own library."""

from collections import defaultdict
from pathlib import Path

from mcap.reader import make_reader


def messages_of(path: Path) -> dict[str, list[bytes]]:
    """Messages by topic in the order of the file, all checksums looked at."""
    found: dict[str, list[bytes]] = defaultdict(list)
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            found[channel.topic].append(message.data)
    return found
