"""One point of a study: its task, its settings, and the key under which its result is stored."""

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

# sources that a result depends on; from `studies`, only the tasks
_ROOMS = ("configuration", "mechanism", "contact", "wear", "dynamics", "life", "studies/tasks")
_FILES = ("twin/reference/leg_parameters.py",)


@attrs.frozen(kw_only=True)
class Point:
    """One point of a study.

    Attributes
    ----------
    label : str
        Name of the point in figures and tables; the result does not depend on it.
    task : str
        Computation, a key of `leg_wear_monitor.studies.tasks.compute.TASKS`.
    settings : dict
        Plain values, including the seed.
    cost : float
        Approximate cost, in cycles of one clearance joint.
    """

    label: str
    task: str
    settings: dict[str, Any]
    cost: float = 1.0

    @property
    def clearance_joints(self) -> list[str]:
        """Clearance joints of its runs."""
        return list(self.settings["clearance_joints"])

    @property
    def clearance_m(self) -> float:
        """Radial clearance of these joints [m]."""
        return float(self.settings["clearance_m"])

    @property
    def speed_rpm(self) -> float:
        """Speed of the crank [rpm]."""
        return float(self.settings["speed_rpm"])

    def key(self, mechanism: Mechanism) -> str:
        """Digest of everything the result depends on: task, settings, mechanism and code."""
        plain = json.dumps([self.task, self.settings], sort_keys=True, allow_nan=False)
        leg = repr(attrs.evolve(mechanism, source=""))
        return hashlib.sha256("\n".join((plain, leg, code_digest())).encode()).hexdigest()[:20]


@cache
def code_digest() -> str:
    """Digest of the sources that produce results: the physics, and the tasks of studies."""
    home = Path(__file__).parents[1]
    sources = [source for room in _ROOMS for source in (home / room).rglob("*.py")]
    sources += [home / name for name in _FILES]
    digest = hashlib.sha256()
    for source in sorted(sources):
        digest.update(f"{source.relative_to(home).as_posix()}\n".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]
