"""Commissioning: recordings of a healthy leg in, proposed parameters out."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import attrs

from leg_wear_monitor.bags.bag import Recordable, listed_recordings
from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.series.reading import read_signals
from leg_wear_monitor.bags.series.signals import EFFORT, JointName, Signals, TorqueSource
from leg_wear_monitor.commissioning.detections import with_detections
from leg_wear_monitor.commissioning.evidence.low_pass import (
    LowPass,
    expected_leg,
    low_pass_of,
    low_pass_time,
)
from leg_wear_monitor.commissioning.evidence.misfit import Load, with_load
from leg_wear_monitor.commissioning.evidence.mismatch import LIMIT, mismatch_item
from leg_wear_monitor.commissioning.evidence.sampling import sampling_of
from leg_wear_monitor.commissioning.evidence.timing import cadences_rpm, separates_lag, timing_of
from leg_wear_monitor.commissioning.evidence.walk import LEAST_CYCLES, Walk, walk_of
from leg_wear_monitor.commissioning.proposal.findings import findings, not_told, notes
from leg_wear_monitor.commissioning.proposal.found import Found, settled
from leg_wear_monitor.commissioning.proposal.items import changes, items
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningResult
from leg_wear_monitor.commissioning.search.candidates import candidates
from leg_wear_monitor.commissioning.search.choice import Choice, choose
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.torque_fit.fit import fit
from leg_wear_monitor.estimate.torque_fit.motion import JointMotion, motion_of, why_not_a_crank
from leg_wear_monitor.estimate.torque_fit.regression import Terms
from leg_wear_monitor.estimate.torque_fit.series import Series
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel, torque_model, with_clearances
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.drive import drive_figures
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameter_file import load_config
from leg_wear_monitor.monitor.config.parameters import config_from, values_of
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_LEAST_S = 10.0  # ten turns at 60 rpm
_FASTER = 1.15  # another cadence


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
        MCAP, .db3, CSV and Parquet files, bag directories, tables in memory (see `replay`); an encoder may
        start anew in each.
    config : MonitorConfig or path, optional
        Parameters, or a parameter file: names the mechanism, and keeps what is not measured; default: the
        file shipped with the package.
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
    mechanism = fitted(load_mechanism(base.mechanism), base)
    recordings = listed_recordings(paths)
    signals, faults = read_signals(
        recordings,
        base,
        joint_states=joint_states,
        drive_torque=drive_torque,
        progress=lambda f: progress(0.3 * f),
    )
    model = torque_model(mechanism)
    found, load = _found(signals, base, crank_joint, lambda f: progress(0.3 + 0.3 * f), model)
    result = attrs.evolve(_result(found, load, mechanism), faults=tuple(faults))
    if result.config is None:
        return result
    best = found.best
    topics = (
        joint_states or best.joint.topic,
        drive_torque or (None if best.torque.source == EFFORT else best.torque.topic),
    )
    try:  # by the last recording, as is the offset
        walk = walk_of(recordings[-1:], result.config, *topics)
    except RecordingError as error:
        return attrs.evolve(result, notes=(*result.notes, f"{LIMIT} stays as it is: {error}"))
    progress(0.8)
    fast = _fastest(found, walk, recordings, topics)
    legs = [expected_leg(one) for one in ((walk,) if fast is walk else (walk, fast)) if len(one.cycles)]
    simulated = [leg for leg in legs if leg is not None]
    if simulated:
        low_pass = low_pass_of(fast, simulated[-1]) if len(fast.cycles) >= LEAST_CYCLES else None
        model = with_clearances(model, simulated)
        found, load = _final(found.choice, found.motion, model, base, low_pass)
        result = attrs.evolve(_result(found, load, mechanism), faults=tuple(faults))
    progress(0.9)
    return with_detections(_with_limit(result, walk), walk, reference, lambda f: progress(0.9 + 0.1 * f))


def _fastest(
    found: Found, walk: Walk, recordings: Sequence[Recordable], topics: tuple[str | None, str | None]
) -> Walk:
    """The walk at the highest cadence that was recorded: the faster, the stronger are the impacts."""
    usual = walk.config.cadence.commanded_rpm
    fastest = max((rpm for rpm in cadences_rpm(found.fit) if rpm * usual > 0.0), key=abs, default=usual)
    if abs(fastest) < _FASTER * abs(usual):
        return walk
    cadence = attrs.evolve(walk.config.cadence, commanded_rpm=fastest, tolerance_rpm=0.1 * abs(fastest))
    other = walk_of(recordings[-1:], attrs.evolve(walk.config, cadence=cadence), *topics)
    return other if len(other.cycles) >= LEAST_CYCLES else walk


def _with_limit(result: CommissioningResult, walk: Walk) -> CommissioningResult:
    """The proposal with a limit of the mismatch for this leg."""
    item = mismatch_item(walk)
    if item is None or result.config is None:
        return result
    config = config_from({**values_of(result.config), LIMIT: item.value}, "commission")
    return attrs.evolve(result, items=(*result.items, item), config=config)


def propose(
    signals: Signals,
    mechanism: Mechanism,
    base: MonitorConfig,
    crank_joint: str | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
    model: TorqueModel | None = None,
) -> CommissioningResult:
    """Propose parameters from what was recorded; see `commission`.

    Parameters
    ----------
    signals : Signals
    mechanism : Mechanism
    base : MonitorConfig
        Keeps what is not measured.
    crank_joint : str, optional
        Joint; default: all are tried.
    progress : callable
        Called with the fraction that is done, 0 to 1.
    model : TorqueModel, optional
        The mechanism's, if it is there already.
    """
    model = model or torque_model(mechanism)
    return _result(*_found(signals, base, crank_joint, progress, model), mechanism)


def _found(
    signals: Signals,
    base: MonitorConfig,
    crank_joint: str | None,
    progress: Callable[[float], None],
    model: TorqueModel,
) -> tuple[Found, Load | None]:
    """The best choice of joint, torque and gear, and the load that its fit has."""
    motions = _cranks(signals.joints, crank_joint)
    torques = _torques(signals.torques)
    found = candidates(motions, torques, model, progress)
    if not found:
        raise LegWearError(
            "no torque was recorded while a joint turned steadily for five turns of a crank: record a minute "
            "of walking at a steady cadence"
        )
    choice = choose(found)
    return _final(choice, motions[choice.best.joint], model, base)


def _result(facts: Found, load: Load | None, mechanism: Mechanism) -> CommissioningResult:
    told = items(facts)
    proposed = None
    if not facts.doubts:
        proposed = config_from({**values_of(facts.base), **changes(told)}, "commission")
    return CommissioningResult(
        items=tuple(told),
        not_told=not_told(facts),
        findings=findings(facts, load, mechanism),
        notes=notes(facts),
        config=proposed,
        turns=facts.fit.turns,
    )


def _final(
    choice: Choice,
    motion: JointMotion,
    model: TorqueModel,
    base: MonitorConfig,
    low_pass: LowPass | None = None,
) -> tuple[Found, Load | None]:
    """The chosen fit again, with the terms that the recording can tell, and the lag that it is late by."""
    one, declared = choice.best.fit, drive_figures(base.drive)
    low_pass_s, low_pass_sigma_s = low_pass_time(low_pass, declared)
    terms = Terms(bias=one.pair.walks_both_ways, load_friction=True, lag=separates_lag(one.pair))
    start = attrs.evolve(one.refined, lag_s=low_pass_s, low_pass_s=low_pass_s)
    again = fit(one.pair, model, start, terms, with_errors=True)
    again, load = with_load(again, model, terms)
    sampling = sampling_of(again, model)
    used = sampling.value or base.drive_torque.sampling
    timing = timing_of(again, used, bool(sampling.value), declared.lag_s)
    timing = attrs.evolve(timing, low_pass_s=low_pass_s, low_pass_sigma_s=low_pass_sigma_s)
    found = Found(choice, again, motion, sampling, timing, declared, base, low_pass)
    return settled(found, model), load


def _cranks(joints: dict[JointName, Series], wanted: str | None) -> dict[JointName, JointMotion]:
    """Motions of the joints that turn on and on."""
    if wanted is not None and wanted not in {name.joint for name in joints}:
        known = ", ".join(sorted({name.joint for name in joints})) or "none"
        raise LegWearError(f"--crank-joint: {wanted!r} is not a joint of the recording, it has {known}")
    reasons, motions = [], {}
    for name, each in joints.items():
        if wanted not in (None, name.joint):
            continue
        why = why_not_a_crank(each)
        if why:
            reasons.append(f"{name.joint} {why}")
        elif each.time_s[-1] - each.time_s[0] < _LEAST_S:
            duration = each.time_s[-1] - each.time_s[0]
            reasons.append(
                f"{name.joint} was recorded for {duration:.3g} s only, expected at least {_LEAST_S:g} s"
            )
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
            "no torque was recorded: expected geometry_msgs/msg/WrenchStamped, std_msgs/msg/Float64, or the "
            "effort of the crank in its sensor_msgs/msg/JointState"
        )
    varying = {name: each for name, each in torques.items() if float(each.value.std()) > 0.0}
    if not varying:
        constant = ", ".join(name.label for name in torques)
        raise LegWearError(f"no torque changes while the leg walks: {constant}")
    return varying
