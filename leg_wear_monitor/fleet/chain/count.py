"""Counts one recording of a leg: its wear into the ledger, its gait cycles into a table, what was found."""

from pathlib import Path

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.fleet.chain.record import Outcome, record_of, unreadable
from leg_wear_monitor.fleet.chain.scan import Found
from leg_wear_monitor.fleet.chain.words import words_of
from leg_wear_monitor.fleet.description.fleet_description import FleetLeg
from leg_wear_monitor.fleet.directory.leg_directory import LegDirectory, Line
from leg_wear_monitor.fleet.directory.lock import locked
from leg_wear_monitor.fleet.tables.cycles import cycle_columns
from leg_wear_monitor.fleet.tables.parquet import write_parquet
from leg_wear_monitor.playback.replay import replay
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.whole_file import write_whole
from leg_wear_monitor.workers.code import package_digest


def count_or_fault(leg: FleetLeg, out: Path, found: Found, last_ns: int, code: str) -> Line | str:
    """Record of a recording, or why the leg cannot go on; see `count_recording`.

    ``code`` is the `package_digest` of who asks.
    """
    if package_digest() != code:
        return "a worker has another version of leg_wear_monitor; install the same one everywhere"
    try:
        return count_recording(leg, out, found, last_ns)
    except LegWearError as error:
        return str(error)


def count_recording(leg: FleetLeg, out: Path, found: Found, last_ns: int) -> Line:
    """Count a recording, so that a kill at any instant costs nothing but time.

    Its table and its record are written before its wear is in the ledger, the record as pending. If the
    process is killed after that, the next replay finds all of it in the ledger, and the pending record holds;
    if before, it is counted again, and replaces both. A worker of a killed update may go on for some seconds:
    it is waited for, and what it has counted is not counted again.

    Parameters
    ----------
    leg : FleetLeg
    out : pathlib.Path
        Directory of the fleet.
    found : Found
    last_ns : int
        Last stamp that was counted before [ns].

    Returns
    -------
    dict
        Its record, a plain object.

    Raises
    ------
    ConfigError, LedgerError
        If the leg's parameters or its ledger are unusable.
    """
    directory = LegDirectory(out, leg.id)
    with locked(directory.path, waits=True):
        done = next((line for line in directory.lines() if _is_done(line, found)), None)
        return done or _counted(leg, directory, found, last_ns)


def _is_done(line: Line, found: Found) -> bool:
    return line["key"] == found.key and Outcome(line["outcome"]).is_final


def _counted(leg: FleetLeg, directory: LegDirectory, found: Found, last_ns: int) -> Line:
    """Count a recording into a leg that is locked."""
    try:
        if found.fault:
            raise RecordingError("", "", found.fault)
        line = _replayed(leg, directory, found, last_ns)
    except RecordingError as error:
        fault = ": ".join(filter(None, (error.key, error.fault)))
        line = unreadable(found.key, leg.shown(found.path), leg.settings, fault).to_dict()
    directory.add(line, words_of(line))
    return line


def _replayed(leg: FleetLeg, directory: LegDirectory, found: Found, last_ns: int) -> Line:
    """Replay a recording into the ledger; its record."""
    pending, lines = directory.pending(), []
    knows = directory.knowledge()
    about = {"key": found.key, "file": leg.shown(found.path), "settings": leg.settings}

    def finish(result: ReplayResult) -> None:
        record = record_of(result, **about, is_late=found.begin_ns < last_ns, knows=knows)
        lines.append(record.to_dict())
        if record.outcome is Outcome.COUNTED:
            write_parquet(directory.table(found.key), cycle_columns(result, leg.row))
            write_whole(directory.summary, result.summary().to_json().encode())
            directory.expect(lines[0])

    replay(
        found.path,
        leg.used_config,
        ledger=directory.ledger,
        node=leg.node,
        joint_states=leg.joint_states,
        drive_torque=leg.drive_torque,
        sample=leg.sample,
        finish=finish,
    )
    (line,) = lines
    is_done = line["outcome"] == Outcome.ALREADY_COUNTED.value
    return pending if is_done and pending and pending["key"] == found.key else line
