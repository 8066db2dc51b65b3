"""Checksums that bind a stored result to what it is the result of."""

import hashlib
import json
from typing import Any

import numpy as np

from leg_wear_monitor.studies.point import Arrays


def canonical(value: Any) -> str:
    """JSON of plain values, the same for equal ones."""
    return json.dumps(value, sort_keys=True, allow_nan=False)


def text_checksum(*texts: str) -> str:
    """SHA-256 over texts, each for itself."""
    digest = hashlib.sha256()
    for text in texts:
        raw = text.encode()
        digest.update(b"%d:" % len(raw) + raw)
    return digest.hexdigest()


def result_checksum(about: dict[str, Any], arrays: Arrays) -> str:
    """SHA-256 over a result and all that it is said to be the result of.

    Parameters
    ----------
    about : dict
        Plain: the point's key, task and settings, and versions.
    arrays : dict of arrays
    """
    digest = hashlib.sha256(text_checksum(canonical(about)).encode())
    for name, array in sorted(arrays.items()):
        head = canonical([name, array.dtype.str, list(array.shape)])
        digest.update(text_checksum(head).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
