"""The file with the sentences of rules, causes and reasons."""

from functools import cache
from typing import Any

from leg_wear_monitor.configuration.strict import read_document
from leg_wear_monitor.files import share_directory

TABLE_FILE = "config/verdict.yaml"


@cache
def verdict_document() -> dict[str, Any]:
    """Content of the file, read once.

    Raises
    ------
    ConfigError
        If the file is damaged.
    """
    return dict(read_document(share_directory() / TABLE_FILE, TABLE_FILE))
