"""Checksums that bind a stored result to its origin."""

import hashlib
import json
from typing import Any

import numpy as np

from leg_wear_monitor.studies.point import Arrays


def canonical(value: Any) -> str:
    """Canonical JSON of plain values: equal values give equal text."""
    return json.dumps(value, sort_keys=True, allow_nan=False)


def text_checksum(*texts: str) -> str:
    """SHA-256 over a sequence of texts, with their boundaries."""
    digest = hashlib.sha256()
    for text in texts:
        raw = text.encode()
        digest.update(b"%d:" % len(raw) + raw)
    return digest.hexdigest()


def result_checksum(about: dict[str, Any], arrays: Arrays) -> str:
    """SHA-256 over a result and its declared origin.

    Parameters
    ----------
    about : dict
        Plain values: the point's key, task and settings, and versions.
    arrays : dict of arrays
    """
    digest = hashlib.sha256(text_checksum(canonical(about)).encode())
    for name, array in sorted(arrays.items()):
        head = canonical([name, array.dtype.str, list(array.shape)])
        digest.update(text_checksum(head).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
