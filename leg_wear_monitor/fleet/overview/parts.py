"""The fleet at a glance, as classes; SI units, None for what is not known."""

from typing import Any

import attrs

from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.monitor.verdict.verdict import Verdict
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours
from leg_wear_monitor.playback.result.document import part_document

SCHEMA_VERSION = 1
"""Of the JSON; counts up when a field is renamed, removed or means something else."""


@attrs.frozen(kw_only=True)
class BadRecording:
    """A recording that is not sound.

    Attributes
    ----------
    file : str
        Its name when it was counted.
    outcome : str
        What became of it: ``counted`` in part, ``already_counted``, ``no_gait`` or ``unreadable``.
    why : str
        What was found in it first.
    """

    file: str
    outcome: str
    why: str = ""


@attrs.frozen(kw_only=True)
class RecordingHealth:
    """The recordings of a leg.

    Attributes
    ----------
    found : int
        Recordings that the description names now, copies included.
    counted : int
        Recordings whose wear is in the ledger.
    already_counted : int
        Recordings whose time was in the ledger from others.
    no_gait : int
        Recordings without a gait cycle that fits the leg.
    unreadable : int
        Recordings of which nothing can be read.
    partial : int
        Counted recordings of which parts are lost.
    begin_ns, end_ns : int
        First and last stamp of what is counted [ns]; 0 if nothing is.
    counted_h : float
        Duration of the counted recordings [h].
    cycles : int
        Gait cycles in them.
    unmonitored_s : float
        Time in them during which the leg was not followed [s].
    bad : tuple of BadRecording
        The last ten that are not sound, the newest first.
    """

    found: int = 0
    counted: int = 0
    already_counted: int = 0
    no_gait: int = 0
    unreadable: int = 0
    partial: int = 0
    begin_ns: int = 0
    end_ns: int = 0
    counted_h: float = 0.0
    cycles: int = 0
    unmonitored_s: float = 0.0
    bad: tuple[BadRecording, ...] = ()


@attrs.frozen(kw_only=True)
class LegChange:
    """What is new since the update before the last that counted something for the leg.

    Attributes
    ----------
    recordings : int
        Recordings that were counted since.
    state : str
        State of the verdict before; empty if there was none.
    fault_code : str
        Reason of the verdict before.
    used_fraction : dict of str to float
        Growth of the fraction of each joint's clearance that is used up.
    """

    recordings: int = 0
    state: str = ""
    fault_code: str = ""
    used_fraction: dict[str, float] = attrs.Factory(dict)


@attrs.frozen(kw_only=True)
class LegOverview:
    """One leg.

    Attributes
    ----------
    id : str
        Name of the leg.
    lot : str
        Production lot; empty if it is not known.
    verdict : Verdict or None
        At the end of the recording that was counted last; None before the first.
    clearances : dict of str to JointClearance
        Clearance of each joint then.
    used_fraction : dict of str to float
        Fraction of the clearance from new to limit that is used up, by joint.
    life : dict of str to LifeHours or None
        Remaining life of each joint, and of the ``leg``; None where it is not known or not valid.
    change : LegChange
        What is new.
    recordings : RecordingHealth
        The recordings of the leg.
    fault : str
        Why the last update could not count all of its recordings; empty if it could.
    wear_acceleration : float
        Factor on all of its wear; other than 1 in demonstrations, which are not ranked.
    """

    id: str
    lot: str = ""
    verdict: Verdict | None = None
    clearances: dict[str, JointClearance] = attrs.Factory(dict)
    used_fraction: dict[str, float] = attrs.Factory(dict)
    life: dict[str, LifeHours | None] = attrs.Factory(dict)
    change: LegChange = attrs.Factory(LegChange)
    recordings: RecordingHealth = attrs.Factory(RecordingHealth)
    fault: str = ""
    wear_acceleration: float = 1.0

    @property
    def is_accelerated(self) -> bool:
        """Whether its wear is that of a demonstration, which is compared with no leg."""
        return self.wear_acceleration != 1.0

    @property
    def state(self) -> str:
        """State of the verdict; ``unknown`` before the first."""
        return self.verdict.state.value if self.verdict else UNKNOWN


UNKNOWN = "unknown"
"""State of a leg without a counted recording."""


@attrs.frozen(kw_only=True)
class FleetOverview:
    """The fleet; its page contains nothing else.

    Attributes
    ----------
    counts : dict of str to int
        Number of legs in each state, from the mildest to the most severe, and of those that are ``unknown``.
    first : tuple of str
        Ids of the up to ten legs that need a person first, the most urgent one first.
    legs : tuple of LegOverview
        In the order of the description.
    advice : str
        Limits of the results.
    """

    counts: dict[str, int]
    first: tuple[str, ...]
    legs: tuple[LegOverview, ...]
    advice: str

    def leg(self, name: str) -> LegOverview:
        """A leg by its id."""
        return {leg.id: leg for leg in self.legs}[name]

    def to_dict(self) -> dict[str, Any]:
        """Plain object: what ``fleet.json`` contains; null for what is not known."""
        return {"schema_version": SCHEMA_VERSION, **part_document(self)}

    def to_json(self) -> str:
        """Text of ``fleet.json``."""
        return json_text(self.to_dict())
