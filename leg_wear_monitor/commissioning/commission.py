"""Commissioning: recordings of a healthy leg in, proposed parameters out."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.commissioning import proposal
from leg_wear_monitor.commissioning.proposal import CommissioningItem, CommissioningResult
from leg_wear_monitor.commissioning.search import candidates, choose
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.joint_motion import JointMotion, Series, motion_of, why_not_a_crank
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import WARN_FRACTION
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.inputs import EFFORT
from leg_wear_monitor.monitor.config.parameters import config_from, load_config, values_of
from leg_wear_monitor.monitor.config.settings import LedgerFile, MonitorConfig
from leg_wear_monitor.monitor.diagnosis.reference_file import simulated_under
from leg_wear_monitor.monitor.input_health import INPUT_FAULTS
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.bag import Recordable, listed_recordings
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.recordings.series import JointName, Signals, TorqueSource, read_signals
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile, mean_profile
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples, newest, of_crank, within

_LEAST_S = 10.0  # ten turns at 60 rpm
_SPIKE = 30.0  # size of a spike over the size that nine of ten torques do not exceed; impacts have up to 17
_LEAST_SWING, _LEAST_TORQUE = 1.0e-6, 1.0e-9  # swing of a changing torque: over its size, and in its unit


def commission(
    paths: Recordable | Iterable[Recordable],
    config: MonitorConfig | str | Path | None = None,
    *,
    joint_states: str | None = None,
    drive_torque: str | None = None,
    crank_joint: str | None = None,
    reference: str | Path | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> CommissioningResult:
    """Propose the parameters of a robot from recordings of its healthy leg.

    Parameters
    ----------
    paths : path, table, or iterable of these
        MCAP, .db3, CSV and Parquet files, bag directories, tables in memory (see `replay`), with one zero of
        the encoder in all.
    config : MonitorConfig or path, optional
        Parameters, or a parameter file: names the mechanism, and supplies the values that are not measured;
        default: the file shipped with the package.
    joint_states, drive_torque : str, optional
        Topics; default: all are tried.
    crank_joint : str, optional
        Joint; default: all are tried.
    reference : str or pathlib.Path, optional
        File for a torque reference of the leg under the recorded motion of the crank, which takes a minute
        to simulate. It becomes ``diagnosis.reference``, and ``reference`` of the result; the caller writes
        the file.
    progress : callable
        Called with the fraction that is done, 0 to 1.

    Returns
    -------
    CommissioningResult
        ``config`` has the proposed parameters, ``to_yaml()`` is their file, ``to_json()`` the text that
        ``commission --json`` writes, ``to_pandas()`` a table.

    Raises
    ------
    RecordingError
        If a recording cannot be read.
    LegWearError
        If it has no torque, no joint that turns continuously, or is too short.
    """
    base = config if isinstance(config, MonitorConfig) else load_config(config)
    recordings = listed_recordings(paths)
    signals, faults = read_signals(
        recordings,
        base,
        joint_states=joint_states,
        drive_torque=drive_torque,
        progress=lambda f: progress(0.3 * f),
    )
    mechanism = fitted(load_mechanism(base.mechanism), base)
    model = torque_model(mechanism)
    found = _found(signals, base, crank_joint, model)
    result = attrs.evolve(_result(found, mechanism), faults=tuple(faults))
    if result.config is None:
        return result
    joint, torque = found.choice.best.joint.topic, found.choice.best.torque
    topics = joint_states or joint, drive_torque or (None if torque.source == EFFORT else torque.topic)
    try:
        walk = _walk(recordings[-1:], result.config, *topics)
    except RecordingError as error:
        return attrs.evolve(result, notes=(*result.notes, f"{_LIMIT} stays as it is: {error}"))
    if walk.faults:
        return attrs.evolve(result, not_told=(*result.not_told, *walk.faults), config=None)
    progress(0.8)
    result = _with_limit(result, walk)
    if reference is None:
        return result
    return _with_reference(result, walk, reference, lambda f: progress(0.8 + 0.2 * f))


def propose(
    signals: Signals,
    mechanism: Mechanism,
    base: MonitorConfig,
    crank_joint: str | None = None,
    model: TorqueModel | None = None,
) -> CommissioningResult:
    """Propose parameters from recorded signals; see `commission`.

    Parameters
    ----------
    signals : Signals
    mechanism : Mechanism
    base : MonitorConfig
        Supplies the values that are not measured.
    crank_joint : str, optional
        Joint; default: all are tried.
    model : TorqueModel, optional
        The mechanism's, if it is there already.
    """
    return _result(_found(signals, base, crank_joint, model or torque_model(mechanism)), mechanism)


def _found(
    signals: Signals, base: MonitorConfig, crank_joint: str | None, model: TorqueModel
) -> proposal.Found:
    """The best choice of joint, torque and gear, and the quality of its fit."""
    motions = _cranks(signals.joints, crank_joint)
    found = candidates(motions, _torques(signals.torques), model, base)
    if not found:
        raise LegWearError(
            "no torque was recorded while a joint turned steadily for five turns of a crank: record a minute "
            "of walking at a steady cadence"
        )
    choice = choose(found)
    return proposal.found_of(choice, motions[choice.best.joint], model, base)


def _result(found: proposal.Found, mechanism: Mechanism) -> CommissioningResult:
    items, config = proposal.items(found), None
    if not found.doubts:
        config = config_from({**values_of(found.base), **proposal.changes(items)}, "commission")
    return CommissioningResult(
        items=tuple(items),
        not_told=tuple(proposal.not_told(found)),
        findings=tuple(proposal.findings(found, mechanism)),
        notes=tuple(proposal.notes(found)),
        config=config,
        turns=found.fit.turns,
    )


def _cranks(joints: dict[JointName, Series], wanted: str | None) -> dict[JointName, JointMotion]:
    """Motions of the joints that turn on and on."""
    if wanted is not None and wanted not in {name.joint for name in joints}:
        known = ", ".join(sorted({name.joint for name in joints})) or "none"
        raise LegWearError(f"--crank-joint: {wanted!r} is not a joint of the recording, which has {known}")
    reasons, motions = [], {}
    for name, each in joints.items():
        if wanted not in (None, name.joint):
            continue
        why, duration_s = why_not_a_crank(each), float(np.ptp(each.time_s))
        if not why and duration_s < _LEAST_S:
            why = f"was recorded for {duration_s:.3g} s only. Expected at least {_LEAST_S:g} s"
        if why:
            reasons.append(f"{name.joint} {why}")
        else:
            motions[name] = motion_of(each)
    if not motions:
        raise LegWearError(
            f"no joint turns continuously like a crank: {'; '.join(reasons) or 'there is no joint'}"
        )
    return motions


def _torques(torques: dict[TorqueSource, Series]) -> dict[TorqueSource, Series]:
    """Torques that are not constant."""
    if not torques:
        raise LegWearError(
            "no torque was recorded, or only NaN: expected geometry_msgs/msg/WrenchStamped, "
            "std_msgs/msg/Float64, or the effort of the crank in its sensor_msgs/msg/JointState"
        )
    varying = {
        name: each
        for name, each in ((name, _without_spikes(each)) for name, each in torques.items())
        if np.ptp(each.value) > max(_LEAST_TORQUE, _LEAST_SWING * np.abs(each.value).max())
    }
    if not varying:
        constant = ", ".join(name.label for name in torques)
        raise LegWearError(f"no torque changes while the leg walks: {constant}")
    return varying


def _without_spikes(torque: Series) -> Series:
    """Torques that are not far beyond most of the others."""
    size = np.abs(torque.value)
    near = size <= _SPIKE * np.quantile(size, 0.9)
    return Series(torque.time_s[near], torque.value[near])


# The recording as the monitor sees it with the proposed parameters: its faults, and its torque residual.


_LIMIT = "limits.torque_mismatch"
_LEAST_CYCLES = 8  # gait cycles for a reference: their mean shows how the crank turns
_LEAST_ANGLES = 40  # crank samples least number of samples in a gait cycle for its profile
_LEAST_COMPARED = 10  # gait cycles for a limit
_MEDIAN_TO_SIGMA = 1.0 / 0.6745  # sigma over the median departure of a normal distribution
# scatters of a cycle's torque residual from its mean to a warning: by chance less than once in 1e6
_SIGMAS = 5.3
_LARGEST_RESIDUAL = 0.3  # torque residual of a healthy leg


@attrs.frozen(eq=False)
class _Walk:
    """Gait cycles of a healthy leg at the commanded cadence: torque residuals and crank motion.

    ``faults`` are the faults of the input that the monitor reports, with their remedies.
    """

    mechanism: Mechanism
    config: MonitorConfig
    mismatch: Floats
    profiles: tuple[CrankProfile, ...]
    faults: tuple[str, ...]


def _walk(
    recordings: Sequence[Recordable],
    config: MonitorConfig,
    joint_states: str | None,
    drive_torque: str | None,
) -> _Walk:
    """Results of the monitor for recordings of a healthy leg; RecordingError if topics are ambiguous."""
    quiet = attrs.evolve(config.diagnosis, enabled=False)
    config = attrs.evolve(config, diagnosis=quiet, ledger=LedgerFile())
    mechanism = load_mechanism(config.mechanism)
    monitor = WearMonitor(mechanism, config)
    crank: Samples = np.zeros(0, GAIT_SAMPLE)
    faults = dict[str, str]()
    mismatch: list[float] = []
    profiles: list[CrankProfile] = []
    with Recording(recordings, config, joint_states=joint_states, drive_torque=drive_torque) as recording:
        for block in recording.blocks():
            crank = newest(np.concatenate([crank, of_crank(block.samples)]), 0)
            reports = monitor.update(block.samples)
            reported = (each.verdict for each in reports.verdicts if each.verdict.fault_code in INPUT_FAULTS)
            faults |= {one.fault_code: f"{one.why}: {one.do}" for one in reported}
            for cycle in reports.cycles:
                if config.cadence.allows(cycle.cadence_rpm) and not cycle.bridged_s:
                    mismatch.append(cycle.torque_mismatch)
                    profiles += _profile(within(crank, cycle.begin_ns, cycle.stamp_ns), cycle)
                crank = newest(crank, cycle.stamp_ns)
    compared = np.array(mismatch)[np.isfinite(mismatch)]
    return _Walk(fitted(mechanism, config), config, compared, tuple(profiles), tuple(faults.values()))


def _profile(crank: Samples, cycle: CycleReport) -> list[CrankProfile]:
    """Motion of the crank in a gait cycle; none if it has too few samples."""
    if len(crank) < _LEAST_ANGLES:
        return []
    since_s = np.asarray(1.0e-9 * (crank["stamp_ns"] - cycle.begin_ns), np.float64)
    turned = np.asarray(np.unwrap(crank["crank_angle_rad"], period=TURN), np.float64)
    return [cycle_profile(since_s, turned, 1.0e-9 * (cycle.stamp_ns - cycle.begin_ns))]


def _with_limit(result: CommissioningResult, walk: _Walk) -> CommissioningResult:
    """The proposal with a torque residual limit for this leg; none is proposed if it would hide a fault."""
    found, given = walk.mismatch, walk.config.limits.torque_mismatch
    if len(found) < _LEAST_COMPARED or result.config is None:
        return result
    usual = float(np.median(found))  # gait cycles in which the cadence changes are far from it
    scatter = _MEDIAN_TO_SIGMA * float(np.median(np.abs(found - usual)))
    least = (usual + _SIGMAS * scatter) / WARN_FRACTION
    value = given if least <= given else math.ceil(100.0 * least) / 100.0
    seen = f"{usual:.2g} in {len(found)} gait cycles of this leg"
    if usual > max(_LARGEST_RESIDUAL, given):
        why = f"{_LIMIT}: the torque differs from the model by {seen}, so a limit would hide faults"
        return attrs.evolve(result, not_told=(*result.not_told, why), config=None)
    if value > max(_LARGEST_RESIDUAL, given):  # noise at a slow cadence, where the torque is small
        why = f"{_LIMIT}: the torque differs by {seen}, which hides smaller faults: walk faster"
        result = attrs.evolve(result, not_told=(*result.not_told, why))
    item = CommissioningItem(name=_LIMIT, value=value, sigma=scatter, remark=seen)
    config = config_from({**values_of(result.config), _LIMIT: value}, "commission")
    return attrs.evolve(result, items=(*result.items, item), config=config)


def _with_reference(
    result: CommissioningResult, walk: _Walk, file: str | Path, progress: Callable[[float], None]
) -> CommissioningResult:
    """The result with a torque reference that is simulated for the recorded motion of the crank."""
    if result.config is None:
        return result
    if len(walk.profiles) < _LEAST_CYCLES:
        rpm = walk.config.cadence.commanded_rpm
        why = (
            f"diagnosis.reference: the recording has {len(walk.profiles)} gait cycles at {rpm:g} rpm. "
            f"Expected at least {_LEAST_CYCLES}"
        )
        return attrs.evolve(result, not_told=(*result.not_told, why))
    made = simulated_under(walk.mechanism, mean_profile(walk.profiles), progress)
    values = {**values_of(result.config), "diagnosis.reference": str(file)}
    return attrs.evolve(result, reference=made, config=config_from(values, "commission"))
