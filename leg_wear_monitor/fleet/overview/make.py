"""Makes the overview of a fleet from the records of its legs."""

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.fleet.description.fleet_description import FleetDescription
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory
from leg_wear_monitor.fleet.overview.leg import leg_overview
from leg_wear_monitor.fleet.overview.parts import UNKNOWN, FleetOverview, LegOverview
from leg_wear_monitor.fleet.overview.read import FILE, load_overview
from leg_wear_monitor.monitor.alarms.words import ADVICE
from leg_wear_monitor.monitor.verdict.verdict import State
from leg_wear_monitor.whole_file import write_whole

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
