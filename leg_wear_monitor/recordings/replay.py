"""Replay of a recording through the monitor; the reports equal the reports of a live run."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from itertools import chain
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.errors import printable, system_asked
from leg_wear_monitor.files import unfinished
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.parameters import NODE, load_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.gait_evidence import GaitEvidence
from leg_wear_monitor.monitor.ledger.file import copy_of
from leg_wear_monitor.monitor.reports import DIAGNOSTICS_PERIOD_S, AlarmList, Reports, VerdictReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor, open_monitor
from leg_wear_monitor.recordings.bag import Recordable, listed_recordings
from leg_wear_monitor.recordings.findings import Finding, RecordingError, Severity
from leg_wear_monitor.recordings.leg_markers import LegDrawing, LegMarkers
from leg_wear_monitor.recordings.outputs import OUTPUTS, Messages
from leg_wear_monitor.recordings.reader import Block, Recording
from leg_wear_monitor.recordings.streams import Outgoing, topic_of
from leg_wear_monitor.recordings.summary import History, ReplayResult
from leg_wear_monitor.state import LegState
from leg_wear_monitor.twin.sample import Samples

REPORTS_FILE = "reports.mcap"


def replay(
    paths: Recordable | Iterable[Recordable],
    config: MonitorConfig | str | Path | None = None,
    *,
    out: str | Path | None = None,
    ledger: str | Path | None = None,
    time: str = "header",
    joint_states: str | None = None,
    drive_torque: str | None = None,
    foot_load: str | None = None,
    node: str | None = None,
    ready: Callable[[WearMonitor], None] | None = None,
    progress: Callable[[float], None] | None = None,
    finish: Callable[[ReplayResult], None] | None = None,
) -> ReplayResult:
    """Run the monitor on a recording.

    Wear that the ledger contains already is not added again. If it covers the whole recording, the ledger and
    earlier reports stay unchanged.

    The ledger is written last and atomically. An interrupted replay leaves the ledger unchanged, so repeating
    the replay gives the same result.

    Parameters
    ----------
    paths : path, table, or iterable of these
        MCAP, .db3, CSV and Parquet files, bag directories; tables in memory, which are data frames or
        mappings of column names to arrays. Several are read as one recording. ``table`` of the parameters
        names the columns of tables and their units.
    config : MonitorConfig or path, optional
        Parameters, or the parameter file of the node; default: the file shipped with the package.
    out : path, optional
        Directory for ``reports.mcap``, the messages that the node would have published.
    ledger : path, optional
        Ledger to continue; the ledger named in the parameters is not modified.
    time : str
        Source of the samples' stamps: ``header`` or ``log``.
    joint_states, drive_torque, foot_load : str, optional
        Topics; by default found by their relative names.
    node : str, optional
        Full name of the node whose parameters, names and messages are used; by default the node in the
        namespace of the crank topic, such as ``/left/leg_wear_monitor`` for ``/left/joint_states``.
    ready : callable, optional
        Called with the monitor before the first sample.
    progress : callable, optional
        Called with the fraction of the recording that has been processed, 0 to 1.
    finish : callable, optional
        Called with the result before the ledger is written, to write files that must precede the ledger.

    Returns
    -------
    ReplayResult

    Raises
    ------
    RecordingError
        If the recording contains nothing usable, or the reports cannot be written.
    ConfigError, LedgerError
        If the parameters or the ledger are unusable.

    Examples
    --------
    A recording that comes with the package, of a leg whose bushing G breaks:

    >>> import leg_wear_monitor as lw
    >>> summary = lw.replay("bags/knocking.mcap", "bags/knocking.yaml").summary()
    >>> summary.cycles, summary.verdict.state.value, summary.verdict.joints
    (10, 'stop', ('G',))

    Arrays, and in the same way a data frame of pandas; here twelve turns of a leg with ideal joints:

    >>> import numpy as np
    >>> ideal = lw.simulate("bionic_leg", clearances=[], cycles=1, trace=200).trace
    >>> walk = {
    ...     "time": 1.0 + 0.005 * np.arange(2400),
    ...     "crank_angle": np.tile(ideal.crank_angle_rad, 12),
    ...     "drive_torque": np.tile(ideal.drive_torque_nm, 12),
    ... }
    >>> summary = lw.replay(walk).summary()
    >>> summary.cycles, summary.recording.torque_samples
    (10, 2400)
    """
    config = config if isinstance(config, MonitorConfig) else load_config(config, node)
    kept = attrs.evolve(config.ledger, path="" if ledger is None else str(ledger))
    config = attrs.evolve(config, ledger=kept)
    named = listed_recordings(paths)
    asked = {"joint_states": joint_states, "drive_torque": drive_torque, "foot_load": foot_load}
    with (
        Recording(named, config, time=time, **asked) as recording,
        ExitStack() as stack,
    ):
        node = node or node_beside(printable(recording.topics["joint_states"]))
        config = config.on_node(node)
        mechanism = load_mechanism(config.mechanism)
        monitor = open_monitor(mechanism, config, at_end=True)
        stack.callback(monitor.abandon)
        monitor.reports_states = out is not None  # otherwise the last value is enough
        history, evidence = History(monitor.clearance_joints), GaitEvidence(config)
        result = ReplayResult(monitor, history, recording.files, recording.topics, time, evidence)
        part = None if out is None else stack.enter_context(_part(Path(out), recording.files))
        with Sink(part, monitor, node) if part else nullcontext() as sink:
            if ready:
                ready(monitor)
            _run(result, recording, sink, progress)
        if out is not None and part:
            place = Path(out) / REPORTS_FILE
            if not (monitor.is_all_counted and place.exists()):  # keep earlier values if these are empty
                part.replace(place)
        result.findings = recording.findings + _about_the_ledger(result)
        result.is_partial = recording.is_partial
        if finish:
            finish(result)
        # Without this, the wear of a different machine, or of a run that evaluated nothing, would remain in
        # the ledger.
        if not result.is_unusable and not monitor.is_all_counted:
            monitor.close()
    return result


def _run(
    result: ReplayResult,
    recording: Recording,
    sink: "Sink | None",
    progress: Callable[[float], None] | None,
) -> None:
    """Process all blocks of a recording."""
    monitor = result.monitor
    first_ns: int | None = None
    for block in recording.blocks():
        first_ns = int(block.log_time_ns[0]) if first_ns is None else first_ns
        result.paused_s = recording.paused_s
        logged_s = (int(block.log_time_ns[-1]) - first_ns) / 1e9 - result.paused_s
        result.logged_s = max(result.logged_s, logged_s)
        if block.pause_ns:
            monitor.pause(_stamps_apart_s(result, block))
        for samples in _evaluation_periods(block, monitor.config):
            result.count(samples)
            _take(result, samples, sink)
        if progress:
            progress(block.fraction)
    result.history.last = monitor.renew_forecast()


def _stamps_apart_s(result: ReplayResult, block: Block) -> float:
    """Time from the last stamp so far to the first stamp of a block [s]; 0 if stamps do not increase."""
    stamps = block.samples["stamp_ns"][block.samples["fault"] == 0]
    return max(0.0, (int(stamps[0]) - result.end_ns) * 1.0e-9) if len(stamps) and result.end_ns else 0.0


def state_in_ledger(mechanism: Mechanism, config: MonitorConfig) -> LegState:
    """State of a leg by its ledger alone: wear, alarms, measurements and last verdict.

    A ledger has no drive, load, diagnosis or forecast. It is read from a copy, because a running monitor has
    it locked.

    Raises
    ------
    ConfigError, LedgerError
        If parameters or a ledger cannot be used.
    """
    with copy_of(config.ledger.path) as copy:
        ledger = attrs.evolve(config.ledger, path=str(copy))
        monitor = open_monitor(mechanism, attrs.evolve(config, ledger=ledger), at_end=True)
        monitor.abandon()
    return monitor.stored_state


def _about_the_ledger(result: ReplayResult) -> list[Finding]:
    """Findings about the ledger after the replay."""
    found = []
    if result.monitor.is_all_counted:
        text = "everything in this recording is in the ledger already, so no wear was added"
        found.append(Finding(result.files[0], text, Severity.NOTE))
    elif result.monitor.already_counted_s > 0.0:
        text = f"{result.monitor.already_counted_s:.4g} s are in the ledger already and were skipped"
        found.append(Finding(result.files[0], text, Severity.NOTE))
    if result.monitor.config.ledger.path and result.is_unusable:
        path = Path(result.monitor.config.ledger.path)
        found.append(Finding(path, "nothing of this recording is written into the ledger", Severity.NOTE))
    return found


def _take(result: ReplayResult, samples: Samples, sink: "Sink | None") -> None:
    """Process samples with the monitor, and store the reports."""
    reports = result.monitor.update(samples)
    for cycle in reports.cycles:
        result.history.add_cycle(cycle)
        result.evidence.add(cycle)
    for alarms in reports.alarms:
        result.history.add_alarms(alarms)
    if sink:
        sink.take(reports, result.end_ns)


def node_beside(topic: str) -> str:
    """Full name of the monitor's node in the namespace of a topic."""
    return topic.rpartition("/")[0] + NODE


@contextmanager
def _part(directory: Path, files: list[Path]) -> Iterator[Path]:
    """File for the reports, next to an earlier replay's reports, which may have to stay."""
    path = directory / REPORTS_FILE
    if any(path.resolve() == file.resolve() for file in files):
        raise RecordingError(str(path), "", "is input and output at once. Expected a different directory")
    with system_asked(directory, "cannot be made", error_of=RecordingError):
        directory.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        with system_asked(path, "cannot be written", error_of=RecordingError):
            part = stack.enter_context(unfinished(path))
        yield part


def _evaluation_periods(block: Block, config: MonitorConfig) -> Iterator[Samples]:
    """Split the samples of a block at the times when diagnostics are due."""
    period_ns = round(DIAGNOSTICS_PERIOD_S * 1e9)
    yield from np.split(block.samples, np.flatnonzero(np.diff(block.log_time_ns // period_ns)) + 1)


# Writes reports to an MCAP file, as the messages that a live node would have published.


_CHUNK_BYTES = 2**20


class Sink:
    """An MCAP file with all topics of the monitor, including those without messages.

    Parameters
    ----------
    path : pathlib.Path
    monitor : WearMonitor
    node : str
        Full name of the publishing node.

    Raises
    ------
    RecordingError
        If writing to the disk fails.
    """

    def __init__(self, path: Path, monitor: WearMonitor, node: str = NODE) -> None:
        from leg_wear_monitor.recordings.mcap_file import McapWriter  # a dashboard is without this library

        self._monitor = monitor
        self._messages = Messages(monitor.config, monitor.clearance_joints, node)
        self._writer = McapWriter(path, chunk_bytes=_CHUNK_BYTES)
        self._channels = {
            output: self._writer.channel(topic_of(output, node), output.type, output.qos)
            for output in OUTPUTS
        }
        self._start: tuple[AlarmList, VerdictReport] | None = (monitor.alarms, monitor.state_report)
        self._markers = (
            LegMarkers(monitor, LegDrawing(monitor.mechanism)) if monitor.config.publish_markers else None
        )

    def __enter__(self) -> "Sink":
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        # report the original error, not an error from closing the file
        with suppress(RecordingError) if kind else nullcontext():
            self._writer.close()

    def take(self, reports: Reports, stamp_ns: int) -> None:
        """Write reports and the status of the monitor after them.

        Parameters
        ----------
        reports : Reports
        stamp_ns : int
            Stamp of the status [ns]; 0 if no time is known yet.
        """
        messages = self._messages
        if stamp_ns > 0 and self._start:  # begin like the node, with all alarms, the verdict and the state
            alarms, report = self._start
            for one in (messages.alarms(alarms), messages.verdict(report), messages.state(report)):
                self._write(attrs.evolve(one, stamp_ns=np.array([stamp_ns])))
            self._start = None
        markers = self._markers.of(reports) if self._markers else ()
        for outgoing in chain(messages.of(reports), markers, messages.forecasts(reports)):
            self._write(outgoing)
        if stamp_ns > 0:
            self._write(messages.diagnostics(stamp_ns, self._monitor.status()))

    def _write(self, outgoing: Outgoing) -> None:
        self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
