"""One point of a study: what is computed, from what, and the key under which its result is kept."""

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.mechanism.spec import Mechanism

Arrays = dict[str, np.ndarray[Any, Any]]
Settings = dict[str, Any]

# what a result depends on; of studies only what computes
_ROOMS = ("configuration", "mechanism", "contact", "wear", "dynamics", "life", "studies/tasks")


@attrs.frozen(kw_only=True)
class Point:
    """One point of a study.

    Attributes
    ----------
    label : str
        Its name in figures and tables; the result does not depend on it.
    task : str
        What is computed, a key of `leg_wear_monitor.studies.tasks.compute.TASKS`.
    settings : dict
        Plain values, seed included.
    cost : float
        Roughly how long it takes, as cycles of one clearance joint.
    """

    label: str
    task: str
    settings: dict[str, Any]
    cost: float = 1.0

    def key(self, mechanism: Mechanism) -> str:
        """Digest of all that the result depends on: task, settings, mechanism and code."""
        plain = json.dumps([self.task, self.settings], sort_keys=True, allow_nan=False)
        leg = repr(attrs.evolve(mechanism, source=""))
        return hashlib.sha256("\n".join((plain, leg, code_digest())).encode()).hexdigest()[:20]


@cache
def code_digest() -> str:
    """Digest of the sources that results come from: the physics, and the tasks of studies."""
    home = Path(__file__).parents[1]
    sources = [source for room in _ROOMS for source in (home / room).rglob("*.py")]
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(f"{source.relative_to(home).as_posix()}\n".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]
