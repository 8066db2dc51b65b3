"""The update of a fleet: the recordings that are new for a leg are replayed into the ledger of this leg.

Each leg is one job, so no leg waits for the others. A process may be killed at any moment: the ledger
contains the wear of a recording completely or not at all, and it tells which time it already contains.
"""

import fcntl
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, LegWearError, printable, system_asked
from leg_wear_monitor.files import remove_parts, with_same_fields, write_whole
from leg_wear_monitor.fleet.description import FleetDescription, FleetLeg
from leg_wear_monitor.fleet.overview import (
    FleetOverview,
    LegOverview,
    leg_directory,
    overview_of,
    write_overview,
)
from leg_wear_monitor.fleet.recordings import (
    Outcome,
    ReadRecording,
    add_line,
    in_order,
    is_known,
    read_lines,
    state_of,
)
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.ledger.entry import binding_of
from leg_wear_monitor.monitor.ledger.ledger import LedgerContent, read_ledger
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.replay import replay, state_in_ledger
from leg_wear_monitor.recordings.result import ReplaySummary, summary_of
from leg_wear_monitor.recordings.summary import ReplayResult
from leg_wear_monitor.state import LegState
from leg_wear_monitor.workers import results

LEDGER, SUMMARY = "ledger", "summary.json"

_MOST_FINDINGS = 20
_MOST_FAULTS = 10


@attrs.frozen(kw_only=True)
class LegUpdate:
    """Result of an update of one leg.

    Attributes
    ----------
    leg : LegOverview
    new : tuple of ReadRecording
        Recordings that this update has read.
    findings : tuple of str
        Lines for the operator: a recording that was not modelled completely, or why the leg stopped.
    """

    leg: LegOverview
    new: tuple[ReadRecording, ...] = ()
    findings: tuple[str, ...] = ()


@attrs.frozen(kw_only=True)
class FleetUpdate:
    """Result of an update.

    Attributes
    ----------
    legs : tuple of LegUpdate
        In the order of the description.
    overview : FleetOverview
    """

    legs: tuple[LegUpdate, ...]
    overview: FleetOverview

    @property
    def counted(self) -> int:
        """Number of recordings whose wear was modelled."""
        return sum(one.is_counted for leg in self.legs for one in leg.new)

    @property
    def findings(self) -> list[tuple[str, str]]:
        """The leg, and a line for the operator."""
        return [(leg.leg.id, text) for leg in self.legs for text in leg.findings]


def update_fleet(
    fleet: FleetDescription,
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> FleetUpdate:
    """Model the wear of a fleet's new recordings; those of one leg in the order of time.

    Parameters
    ----------
    fleet : FleetDescription
    out : pathlib.Path
        Directory of the fleet.
    workers : int
        Number of local processes; 1 uses this process only. Results do not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the jobs; they need the same files at the same paths.
    progress : callable, optional
        Called with the completed fraction of the legs, 0 to 1.
    """
    found: dict[str, LegUpdate] = {}
    calls = {leg.id: partial(update_leg, leg, out.absolute()) for leg in fleet.legs}
    for name, result in results(calls, workers, scheduler):
        found[name] = result
        if progress:
            progress(len(found) / len(calls))
    legs = tuple(found[leg.id] for leg in fleet.legs)
    overview = overview_of(each.leg for each in legs)
    write_overview(out, overview)
    return FleetUpdate(legs=legs, overview=overview)


def update_leg(leg: FleetLeg, out: Path) -> LegUpdate:
    """Model the wear of one leg's new recordings; a fault of the leg is a finding."""
    directory = leg_directory(out, leg.id)
    new: list[ReadRecording] = []
    fault, state = "", None
    try:
        with _locked(directory):
            remove_parts(directory, "*")
            for path in in_order(_new_recordings(leg, directory), leg):
                new.append(_count(leg, directory, path))
            state = _with_files(leg_state(leg, directory), leg, directory)
    except LegWearError as error:
        fault = printable(str(error))
    lines = read_lines(directory)
    named = [lines[leg.shown(path)] for path in leg.recordings if leg.shown(path) in lines]
    counted = sorted((one for one in named if one.is_counted), key=lambda one: one.end_ns)
    # a recording that the system could not read has no line, and is tried again by the next update
    faults = [fault, leg.acceleration_doubt, *(one.fault for one in (*named, *new) if one.fault)]
    overview = LegOverview(
        id=leg.id,
        state=state,
        recordings=len(leg.recordings),
        counted=len(counted),
        last_recording=counted[-1].file if counted else "",
        last_ns=counted[-1].end_ns if counted else 0,
        faults=tuple(dict.fromkeys(filter(None, faults)))[:_MOST_FAULTS],
    )
    findings = filter(None, [*(one.fault for one in new), fault])
    return LegUpdate(leg=overview, new=tuple(new), findings=tuple(findings))


@contextmanager
def _locked(directory: Path) -> Iterator[None]:
    """Lock the directory of a leg; wait for other updates, or for a worker of a killed update."""
    with system_asked(directory, "cannot be written"):
        directory.mkdir(parents=True, exist_ok=True)
        file = (directory / ".lock").open("ab")
    with file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _content(leg: FleetLeg, directory: Path) -> LedgerContent | None:
    """Content of the ledger of a leg; None before the first recording."""
    path = directory / LEDGER
    if not path.exists():
        return None
    mechanism = fitted(load_mechanism(leg.config.mechanism), leg.config)
    return read_ledger(path, binding_of(mechanism, leg.config))


def _new_recordings(leg: FleetLeg, directory: Path) -> list[Path]:
    """Recordings of the leg that have to be read."""
    lines, content = read_lines(directory), _content(leg, directory)
    counted_ns = content.counted_ns if content else np.zeros((0, 2), np.int64)
    return [
        path for path in leg.recordings if not is_known(path, lines.get(leg.shown(path)), leg, counted_ns)
    ]


def _count(leg: FleetLeg, directory: Path, path: Path) -> ReadRecording:
    """Replay a recording into the ledger of its leg."""
    size, changed_ns = state_of(path)
    about = ReadRecording(
        file=leg.shown(path),
        size=size,
        changed_ns=changed_ns,
        settings=leg.settings,
        outcome=Outcome.UNREADABLE.value,
    )
    lines: list[ReadRecording] = []

    def finish(result: ReplayResult) -> None:
        # before the wear is in the ledger: a killed update then replays the recording again
        line = _line(about, result)
        if line.outcome == Outcome.ALREADY_COUNTED.value:
            line = _known_again(line, leg, directory)
        elif line.is_counted:
            write_whole(directory / SUMMARY, result.summary().to_json().encode())
        add_line(directory, line)
        lines.append(line)

    try:
        replay(
            path,
            leg.config,
            ledger=directory / LEDGER,
            node=leg.node,
            joint_states=leg.joint_states,
            drive_torque=leg.drive_torque,
            finish=finish,
        )
    except RecordingError as error:
        fault = ": ".join(filter(None, (error.key, error.fault)))
        line = attrs.evolve(about, findings=(printable(fault),))
        if not error.is_passing:  # otherwise the system is at fault, and the next update tries again
            add_line(directory, line)
        return line
    return lines[-1]


def _line(about: ReadRecording, result: ReplayResult) -> ReadRecording:
    monitor, texts = result.monitor, [printable(one.text) for one in result.findings]
    outcome, cycles = Outcome.COUNTED, len(result.history)
    if result.is_unusable:
        outcome = Outcome.NO_GAIT
        texts.insert(0, f"no gait cycle fits this leg: {printable(result.evidence.missing())}")
    elif monitor.is_all_counted:
        outcome = Outcome.ALREADY_COUNTED
        texts.insert(
            0, "the ledger contains this time already: the recording is a copy, or its clock is wrong"
        )
    is_counted = outcome is Outcome.COUNTED
    return attrs.evolve(
        about,
        outcome=outcome.value,
        begin_ns=result.begin_ns,
        end_ns=result.end_ns,
        cycles=cycles if is_counted else 0,
        last_cycle_ns=int(result.history.stamp_ns[-1]) if is_counted and cycles else 0,
        is_partial=result.is_partial,
        findings=tuple(texts[:_MOST_FINDINGS]),
    )


def _known_again(line: ReadRecording, leg: FleetLeg, directory: Path) -> ReadRecording:
    """The line of a recording whose time is in the ledger: its own, unless a different recording covers it.

    Its file may only have a new time of change, or its line may have been lost.
    """
    lines, content = read_lines(directory), _content(leg, directory)
    before = lines.pop(line.file, None)
    if before and before.is_counted:
        return attrs.evolve(before, size=line.size, changed_ns=line.changed_ns, settings=line.settings)
    counted = (one for one in lines.values() if one.is_counted)
    if content is None or any(one.begin_ns < line.end_ns and line.begin_ns < one.end_ns for one in counted):
        return line
    begin, end = content.counted_ns.T
    last_ns = np.minimum(end, line.end_ns)[(begin <= line.end_ns) & (line.begin_ns <= end)].max()
    return attrs.evolve(line, outcome=Outcome.COUNTED.value, last_cycle_ns=int(last_ns), findings=())


def leg_state(leg: FleetLeg, directory: Path) -> LegState | None:
    """State of a leg; None before the first recording whose wear was modelled.

    It is the state at the end of the last recording. If an operator has changed the ledger since, by
    ``measure``, ``reset`` or ``acknowledge``, it is the state that the ledger has.
    """
    content = _content(leg, directory)
    if content is None or content.entry is None:
        return None
    summary = _summary(directory / SUMMARY)
    if summary is not None and content.runs[-1].spans:  # an operator's action is a run that adds no time
        return with_same_fields(LegState, summary, alarms=attrs.evolve(summary.alarms, changes=()))
    ledger = attrs.evolve(leg.config.ledger, path=str(directory / LEDGER))
    now = state_in_ledger(load_mechanism(leg.config.mechanism), attrs.evolve(leg.config, ledger=ledger))
    if summary is None or content.measurements != summary.measurements or not _is_same_wear(now, summary):
        return now
    return with_same_fields(
        LegState, summary, verdict=now.verdict, clearances=now.clearances, alarms=now.alarms
    )


def _with_files(state: LegState | None, leg: FleetLeg, directory: Path) -> LegState | None:
    """The state, whose commands name the files of the leg as seen from the directory of the description."""
    if state is None:
        return None
    config = leg.shown(leg.config_file) if leg.config_file else None
    files = {"--config": config, "--ledger": leg.shown(directory / LEDGER)}
    return attrs.evolve(state, verdict=state.verdict.with_files(files))


def _summary(path: Path) -> ReplaySummary | None:
    """The summary of the last recording; None if it is missing, damaged or of an older version."""
    try:
        return summary_of(json.loads(path.read_bytes()), str(path))
    except (OSError, ValueError, ConfigError):
        return None


_SAME_M = 1e-12  # well below any wear, and above the rounding of JSON


def _is_same_wear(now: LegState, summary: ReplaySummary) -> bool:
    """True if the parts belong to a summary, so that its forecast is valid."""
    then = summary.clearances
    return now.clearances.keys() == then.keys() and all(
        abs(one.modelled_m - then[joint].modelled_m) < _SAME_M for joint, one in now.clearances.items()
    )
