"""The fleet at a glance: as classes, made from records, written and read."""

import json
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import part_document
from leg_wear_monitor.configuration.strict import structure, structure_of_version
from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.files import json_text, write_whole
from leg_wear_monitor.fleet.description import FleetDescription, FleetLeg
from leg_wear_monitor.fleet.directory import LegDirectory, Line, Outcome, used_of
from leg_wear_monitor.monitor.alarms import ADVICE
from leg_wear_monitor.shown import Shown
from leg_wear_monitor.state import JointClearance, LifeHours, State, Verdict

# The fleet at a glance, as classes; SI units, None for what is not known.


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
        Duration of the counted recordings; time that they have in common is in it once [h].
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
class FleetOverview(Shown):
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


# One leg at a glance, from the records of its recordings.


_MOST_BAD = 10


def leg_overview(
    leg: FleetLeg, directory: LegDirectory, before: LegOverview | None, fault: str
) -> LegOverview:
    """A leg at a glance.

    Parameters
    ----------
    leg : FleetLeg
    directory : LegDirectory
    before : LegOverview or None
        The leg after an earlier update.
    fault : str
        Why this update could not count all of its recordings.
    """
    lines = directory.last_lines()
    counted = [line for line in lines if line["outcome"] == Outcome.COUNTED.value]
    health = _health(lines, counted, len(leg.recordings))
    factor = leg.config.wear_acceleration
    now = LegOverview(id=leg.id, lot=leg.lot, recordings=health, fault=fault, wear_acceleration=factor)
    if counted:
        source = str(directory.records)
        joints = structure(counted[-1]["clearances"], dict[str, JointClearance], source, "clearances")
        now = attrs.evolve(
            now,
            verdict=structure(counted[-1]["verdict"], Verdict, source, "verdict"),
            clearances=joints,
            used_fraction={name: used_of(joint) for name, joint in counted[-1]["clearances"].items()},
            life=structure(counted[-1]["life"], dict[str, LifeHours | None], source, "life"),
        )
    return attrs.evolve(now, change=_change(now, before))


def _health(lines: list[Line], counted: list[Line], found: int) -> RecordingHealth:
    outcomes = [line["outcome"] for line in lines]
    bad = [
        BadRecording(file=line["file"], outcome=line["outcome"], why=next(iter(line["findings"]), ""))
        for line in lines
        if line["is_partial"] or line["outcome"] == Outcome.NO_GAIT.value
    ]
    return RecordingHealth(
        found=found,
        **{outcome.value: outcomes.count(outcome.value) for outcome in Outcome},
        partial=sum(line["is_partial"] for line in counted),
        begin_ns=min((line["begin_ns"] for line in counted), default=0),
        end_ns=max((line["end_ns"] for line in counted), default=0),
        counted_h=_covered_ns(counted) / 3600.0e9,
        cycles=sum(line["cycles"] for line in counted),
        unmonitored_s=sum(line["lost"]["unmonitored_s"] for line in counted),
        bad=tuple(reversed(bad[-_MOST_BAD:])),
    )


def _covered_ns(lines: Iterable[Line]) -> int:
    """Time that recordings cover together; a recording that has grown since is there twice."""
    total, until = 0, 0
    for line in sorted(lines, key=lambda line: line["begin_ns"]):
        total += max(0, line["end_ns"] - max(line["begin_ns"], until))
        until = max(until, line["end_ns"])
    return total


def _change(now: LegOverview, before: LegOverview | None) -> LegChange:
    """What is new; that of the update before if nothing was counted since."""
    if before is None:
        return LegChange(recordings=now.recordings.counted)
    if before.recordings.counted == now.recordings.counted:
        return before.change
    return LegChange(
        recordings=now.recordings.counted - before.recordings.counted,
        state=before.state if before.verdict else "",
        fault_code=before.verdict.fault_code if before.verdict else "",
        used_fraction={
            joint: used - before.used_fraction[joint]
            for joint, used in now.used_fraction.items()
            if joint in before.used_fraction
        },
    )


# Reads fleet.json.


FILE = "fleet.json"


def load_overview(path: str | Path) -> FleetOverview:
    """Read the overview of a fleet.

    Parameters
    ----------
    path : str or pathlib.Path
        ``fleet.json``, or the directory of the fleet.

    Raises
    ------
    ConfigError
        If there is none, or it has another version; it names the key at fault.
    """
    place = Path(path) / FILE if Path(path).is_dir() else Path(path)
    try:
        record = json.loads(place.read_bytes())
    except OSError as error:
        raise ConfigError(str(place), "", f"cannot be read: {error.strerror}; run fleet update") from error
    except ValueError as error:
        raise ConfigError(str(place), "", "is not JSON; run fleet update again") from error
    return structure_of_version(record, FleetOverview, SCHEMA_VERSION, str(place), "run fleet update again")


# Makes the overview of a fleet from the records of its legs.


_FIRST = 10


def write_overview(fleet: FleetDescription, out: Path, faults: Mapping[str, str]) -> FleetOverview:
    """Write the overview of a fleet, with what is new since the one that is there.

    Parameters
    ----------
    fleet : FleetDescription
    out : pathlib.Path
        Directory of the fleet.
    faults : mapping of str to str
        Why recordings of a leg could not be counted, by its id.
    """
    before: dict[str, LegOverview] = {}
    with suppress(ConfigError):  # none is there, or one of another version
        before = {leg.id: leg for leg in load_overview(out / FILE).legs}
    legs = [
        leg_overview(leg, LegDirectory(out, leg.id), before.get(leg.id), printable(faults.get(leg.id, "")))
        for leg in fleet.legs
    ]
    overview = FleetOverview(counts=counts_of(legs), first=first_of(legs), legs=tuple(legs), advice=ADVICE)
    write_whole(out / FILE, overview.to_json().encode())
    return overview


def counts_of(legs: Iterable[LegOverview]) -> dict[str, int]:
    """Number of legs in each state, zeros included."""
    states = [leg.state for leg in legs]
    return {state: states.count(state) for state in (*(each.value for each in State), UNKNOWN)}


def first_of(legs: Iterable[LegOverview]) -> tuple[str, ...]:
    """Legs that need a person first: by state, then by what is left of their life, then by clearance.

    Legs with accelerated wear are left out.
    """
    asking = [
        leg
        for leg in legs
        if leg.verdict and leg.verdict.state is not State.HEALTHY and not leg.is_accelerated
    ]
    return tuple(leg.id for leg in sorted(asking, key=urgency)[:_FIRST])


def urgency(leg: LegOverview) -> tuple[float, float, float, str]:
    """Key that sorts legs by who needs a person first."""
    severity = leg.verdict.state.severity if leg.verdict else 0
    life = leg.life.get("leg")
    used = max(leg.used_fraction.values(), default=0.0)
    return -severity, life.p10_h if life else math.inf, -used, leg.id


# The overview for the legs of a description, which may have changed since the last update.


def described(overview: FleetOverview, fleet: FleetDescription) -> FleetOverview:
    """The overview with exactly the legs of a description: new ones are unknown, others are left out."""
    known = {leg.id: leg for leg in overview.legs}
    legs = tuple(attrs.evolve(known.get(leg.id, LegOverview(id=leg.id)), lot=leg.lot) for leg in fleet.legs)
    return attrs.evolve(overview, legs=legs, counts=counts_of(legs), first=first_of(legs))
