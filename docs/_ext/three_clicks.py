"""A Sphinx extension: each page is at most three clicks of the navigation away from the index."""

from collections.abc import Mapping, Sequence
from typing import Any

MOST = 3


def clicks(start: str, entries: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Least number of clicks from a page to each page that its tables of contents reach."""
    found, now = {start: 0}, [start]
    while now:
        beyond = [(page, entry) for page in now for entry in entries.get(page, ()) if entry not in found]
        found |= {entry: found[page] + 1 for page, entry in beyond}
        now = list(dict.fromkeys(entry for _, entry in beyond))
    return found


def _check(app: Any, env: Any) -> None:
    from sphinx.util import logging  # here, so that a test needs no Sphinx

    away = clicks(app.config.root_doc, env.toctree_includes)
    for page in sorted(env.found_docs):
        if away.get(page, MOST + 1) > MOST:
            logging.getLogger(__name__).warning("more than %d clicks from the index", MOST, location=page)


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("env-check-consistency", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
