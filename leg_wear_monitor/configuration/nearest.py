"""What a name that is not known was likely meant to be."""

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is most like another, upper and lower case being alike; None if none is."""
    by_lower = {entry.lower(): entry for entry in known}
    near = difflib.get_close_matches(name.lower(), by_lower, n=1)
    return by_lower[near[0]] if near else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of a message about a name that is not known: ``; did you mean …?``, or nothing."""
    near = nearest(name, known)
    return f"; did you mean {near}?" if near else ""
