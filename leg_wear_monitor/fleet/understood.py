"""What is understood of the description of a fleet: its legs, their parameters, and their recordings."""

from collections.abc import Callable, Iterator

from leg_wear_monitor.fleet.chain.scan import begin_of, state_of
from leg_wear_monitor.fleet.description.fleet_description import FleetDescription, FleetLeg

_DAY_NS = 86_400 * 10**9


def understood(
    fleet: FleetDescription, progress: Callable[[float], None] | None = None
) -> Iterator[tuple[str, str]]:
    """What is understood, and what is wrong: pairs of a line and a fault, one of which is empty.

    Of each leg the first and the last recording by name are opened, so that a column or a topic that is
    missing shows before an update; damage within a recording does not.

    Parameters
    ----------
    fleet : FleetDescription
    progress : callable, optional
        Called with the completed fraction, 0 to 1.
    """
    number = sum(len(leg.recordings) for leg in fleet.legs)
    yield f"fleet of {_many(len(fleet.legs), 'leg')}, {_many(number, 'recording')}, kept in {fleet.out}", ""
    for done, leg in enumerate(fleet.legs, 1):
        ends = [
            (each, *begin_of(each, leg)) for each in dict.fromkeys(leg.recordings[:1] + leg.recordings[-1:])
        ]
        yield _line(leg, [begin_ns for _, begin_ns, _ in ends if begin_ns]), ""
        for path, _, fault in ends:
            if fault:
                yield "", f"{leg.id}: {leg.shown(path)}: {fault}"
        if progress:
            progress(done / len(fleet.legs))


def _line(leg: FleetLeg, begins_ns: list[int]) -> str:
    megabytes = sum(state_of(path)[0] for path in leg.recordings) / 1.0e6
    parts = [f"{_many(len(leg.recordings), 'recording')}, {megabytes:.3g} MB"]
    parts.append(f"parameters {leg.config_file.name if leg.config_file else 'of the package'}")
    if leg.config.hardware != leg.id:
        parts.append(f"hardware {leg.config.hardware}")
    if leg.lot:
        parts.append(f"lot {leg.lot}")
    if begins_ns and max(begins_ns) < _DAY_NS:
        parts.append("stamps without a date")
    return f"{leg.id}: {'; '.join(parts)}"


def _many(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
