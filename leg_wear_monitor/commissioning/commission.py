"""Commissioning: recordings of a healthy leg in, proposed parameters out."""

import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.commissioning import proposal
from leg_wear_monitor.commissioning.evidence import (
    Load,
    cadences_rpm,
    does_not_fit,
    sampling_of,
    separates_lag,
    timing_of,
    with_load,
)
from leg_wear_monitor.commissioning.result import CommissioningResult
from leg_wear_monitor.commissioning.search import Choice, candidates, choose
from leg_wear_monitor.commissioning.walk import LEAST_CYCLES, LIMIT, Walk, mismatch_item, walk_of
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.cause import Cause, NamedCause
from leg_wear_monitor.estimate.joint_motion import (
    JointMotion,
    Series,
    motion_of,
    why_not_a_crank,
    with_repeating_acceleration,
)
from leg_wear_monitor.estimate.torque_fit import Terms, fit, repeating
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted, largest_lag_s
from leg_wear_monitor.monitor.config.inputs import EFFORT, FLOAT64, MAX_LAG_S
from leg_wear_monitor.monitor.config.parameters import config_from, load_config, values_of
from leg_wear_monitor.monitor.config.sections import drive_figures
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.reference_file import simulated_under
from leg_wear_monitor.monitor.verdict.causes import sentence
from leg_wear_monitor.recordings.bag import Recordable, listed_recordings
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.series import JointName, Signals, TorqueSource, read_signals

# Sentences on undetermined parameters, on quantities that do not fit, and on further information.


_SURE = 3.0
_KNOWN_SIGMAS = 2.0  # standard deviations that must be below the requested accuracy
_ANEW_RAD = 0.1  # offsets of two recordings of one absolute encoder differ by less
_IN_DEGREES = math.degrees(1.0)
_ROUGH_SCALE = 0.05
_ROUGH_REST = 0.15  # a repeating residual that may shift the scale more than twice as much as clearances
_DECLARED_ERROR = 0.3  # relative difference between drives of one kind, and between a cold and a warm drive
_AT_ZERO_RAD = 0.02
_AS_WELL = 1.02  # a fit is as good as the best fit up to this ratio of torque residuals
_LARGEST_LIMIT = 0.3  # torque residual of a healthy leg
_LEAST_SWING, _LEAST_TORQUE = 1.0e-6, 1.0e-9  # swing of a changing torque: over its size, and in its unit


def not_told(found: proposal.Found) -> tuple[str, ...]:
    """Parameters that the recording does not determine, and why."""
    reasons = list(found.doubts)
    if not found.sampling.value:
        reasons.append(f"drive_torque.sampling: {found.sampling.why}")
    reasons += _lag(found)
    ratio, is_exact = proposal.gear(found)
    if not is_exact:
        error = found.fit.sigma["ratio"] / abs(found.fit.ratio)
        away = error * abs(float(found.fit.crank()[1].mean())) * 3600.0
        reasons.append(
            f"crank.gear_ratio: {ratio:.7g} is known to ± {error * ratio:.2g}, so the crank angle drifts "
            f"by up to {away:.2g} rad in an hour; enter the ratio of the teeth"
        )
    scale, rest = found.fit.sigma["gain"] / abs(found.fit.gain), repeating(found.fit)
    if scale > _ROUGH_SCALE:
        reasons.append(f"drive_torque.scale: known to ± {100.0 * scale:.0f} % only; record longer")
    elif rest > _ROUGH_REST:
        reasons.append(
            f"drive_torque.scale: {100.0 * rest:.0f} % of the torque repeats and does not fit; the scale "
            "may be wrong by as much"
        )
    return tuple(reasons)


def findings(found: proposal.Found, load: Load | None, mechanism: Mechanism) -> tuple[str, ...]:
    """Quantities that do not fit, or that cannot be used as they are."""
    sentences = [_load(load)]
    if not found.doubts:  # friction and phases say nothing about an unknown leg
        sentences += [does_not_fit(found.fit, mechanism), _drives(found), _late(found), _anew(found)]
    return tuple(filter(None, [*sentences, _position(found)]))


def _lag(found: proposal.Found) -> Iterator[str]:
    timing, most = found.timing, MAX_LAG_S
    if math.isfinite(timing.declared_s):
        return
    if not timing.is_lag_separated:
        turned = 1.0e-3 * abs(float(np.median(found.fit.crank()[1])))
        yield (
            f"lag: at one cadence, a torque that is late by 1 ms looks like {turned:.2g} rad of offset; "
            "record two cadences in one recording, or declare drive.lag_s"
        )
    elif _KNOWN_SIGMAS * timing.error_s > most:
        error = 1.0e3 * _KNOWN_SIGMAS * timing.error_s
        yield (
            f"lag: known to ± {error:.2g} ms only, more than the {1.0e3 * most:g} ms that are accepted, "
            "because clearances shift the torque's phase with the cadence; record cadences further apart"
        )


def _otherwise(found: proposal.Found) -> Iterator[str]:
    """Declared figures of the drive that the recording contradicts."""
    declared = found.declared
    pairs = (
        ("load friction", declared.load_friction, found.load_friction, ""),
        ("constant friction", declared.coulomb_nm, found.friction_nm, " N m"),
    )
    for name, figure, (value, sigma), unit in pairs:
        if abs(figure - value) > _SURE * sigma + _DECLARED_ERROR * figure:
            yield (
                f"the {name} of the drive is {value:.2g} ± {sigma:.1g}{unit}, {figure:.3g}{unit} is "
                "declared: is drive.type right?"
            )


def _load(load: Load | None) -> str:
    if load is None:
        return ""
    return (
        f"a foot load of {load.force_n:.3g} N ± {load.sigma_n:.2g} N explains {100.0 * load.explained:.0f} % "
        f"of the unexplained torque; the proposal allows for it, but record with the foot in the air"
    )


def _drives(found: proposal.Found) -> str:
    one = found.fit
    friction, sigma = found.friction_nm
    size = float(one.predicted.std()) / abs(one.gain)
    if friction < -_SURE * sigma and abs(friction) > 0.02 * size:
        return f"{sentence(NamedCause(Cause.BIAS, friction, sigma))}: zero the torque sensor"
    return ""


def _late(found: proposal.Found) -> str:
    late, most = found.timing.late_s, largest_lag_s(found.base)
    if not abs(late) - _SURE * found.timing.error_s > most:
        return ""
    return (
        f"the torque is late by {1.0e3 * late:.3g} ms, more than the accepted {1.0e3 * MAX_LAG_S:g} ms and "
        f"the declared lag of the drive ({1.0e3 * most:.3g} ms)"
    )


def _anew(found: proposal.Found) -> str:
    offsets = [proposal.offset_rad(found, number) for number in sorted(found.fit.offset_rad)]
    apart = max(abs((each - offsets[0] + math.pi) % TURN - math.pi) for each in offsets)
    if apart < _ANEW_RAD:
        return ""
    each = ", ".join(f"{offset:.3f}" for offset in offsets)
    return (
        f"the encoder starts at a different zero in each recording: the torque's phase gives the offsets "
        f"{each} "
        "rad; the proposed offset is from the last recording and is valid until the next boot"
    )


def _position(found: proposal.Found) -> str:
    measured = found.fit.gear_ratio
    if abs(measured / _IN_DEGREES - 1.0) < 2.0 * proposal.gear_error(found.fit):
        return "the joint's position looks like degrees; ROS expects radians: gear ratio 57.2958"
    if abs(measured * TURN - 1.0) < 2.0 * proposal.gear_error(found.fit):
        return "the joint's position looks like turns; ROS expects radians: gear ratio 0.159155"
    if found.motion.is_wrapped and proposal.gear(found)[0] != 1.0:
        return (
            f"the joint's position is wrapped to a turn, but its gear ratio is {measured:.6g}: the monitor "
            "needs a continuous position"
        )
    return ""


def notes(found: proposal.Found) -> Iterator[str]:
    """Further information for the operator."""
    yield from found.choice.also
    yield from _otherwise(found)
    ratio = proposal.gear(found)[0]
    if ratio != 1.0 and len(found.fit.offset_rad) == 1:
        is_zero = bool(abs(found.motion.first_rad[-1]) < _AT_ZERO_RAD)
        seems = "its first reading is 0" if is_zero else "motor encoders often do"
        yield (
            f"the encoder turns {ratio:.6g} times in a turn of the crank; if it starts at zero at each boot "
            f"({seems}), the offset from the torque's phase is valid until the next boot; then run "
            "commission again"
        )
    for topic, name in (
        (found.best.joint.topic, "joint_states"),
        (found.best.torque.topic, "drive_torque"),
    ):
        if topic != f"/{name}" and not (name == "drive_torque" and topic == found.best.joint.topic):
            yield f"start the monitor with -r {name}:={topic}, replay with --{name.replace('_', '-')} {topic}"
    if found.best.torque.source == FLOAT64:
        yield "a Float64 has no stamp: the torque has its time of arrival, so delayed messages are a lag"
    speeds = cadences_rpm(found.fit)
    if len(speeds) > 1:
        each = " and ".join(f"{speed:g}" for speed in speeds)
        yield (
            f"the leg walks at about {each} rpm; cadence.commanded_rpm is the most frequent one: "
            "set it to the cadence of its work"
        )


_LEAST_S = 10.0  # ten turns at 60 rpm


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
    try:  # the last recording gives the phase, as it gives the offset
        walk = walk_of(recordings[-1:], result.config, *topics)
    except RecordingError as error:
        return attrs.evolve(result, notes=(*result.notes, f"{LIMIT} stays as it is: {error}"))
    if walk.faults:
        return attrs.evolve(result, not_told=(*result.not_told, *walk.faults), config=None)
    progress(0.8)
    result = _with_limit(result, walk)
    return (
        _with_reference(result, walk, reference, lambda f: progress(0.8 + 0.2 * f)) if reference else result
    )


def _with_limit(result: CommissioningResult, walk: Walk) -> CommissioningResult:
    """The proposal with a torque residual limit for this leg; no limit if it would hide a fault."""
    item = mismatch_item(walk)
    if item is None or result.config is None:
        return result
    if float(item.value) > max(_LARGEST_LIMIT, walk.config.limits.torque_mismatch):
        why = f"{LIMIT}: the torque differs from the model by {item.remark}, so a limit would hide a fault"
        return attrs.evolve(result, not_told=(*result.not_told, why), config=None)
    config = config_from({**values_of(result.config), LIMIT: item.value}, "commission")
    return attrs.evolve(result, items=(*result.items, item), config=config)


def _with_reference(
    result: CommissioningResult, walk: Walk, file: str | Path, progress: Callable[[float], None]
) -> CommissioningResult:
    """The result with a torque reference that is simulated for the recorded motion of the crank."""
    if result.config is None:
        return result
    if walk.profile is None:
        cycles, rpm = len(walk.profiles), walk.config.cadence.commanded_rpm
        why = (
            f"diagnosis.reference: the recording has {cycles} gait cycles at {rpm:g} rpm. Expected at least "
            f"{LEAST_CYCLES}"
        )
        return attrs.evolve(result, not_told=(*result.not_told, why))
    (made,) = simulated_under(walk.mechanism, [walk.profile], progress)
    values = {**values_of(result.config), "diagnosis.reference": str(file)}
    return attrs.evolve(result, reference=made, config=config_from(values, "commission"))


def propose(
    signals: Signals,
    mechanism: Mechanism,
    base: MonitorConfig,
    crank_joint: str | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
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
) -> tuple[proposal.Found, Load | None]:
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


def _result(facts: proposal.Found, load: Load | None, mechanism: Mechanism) -> CommissioningResult:
    items = proposal.items(facts)
    proposed = None
    if not facts.doubts:
        proposed = config_from({**values_of(facts.base), **proposal.changes(items)}, "commission")
    return CommissioningResult(
        items=tuple(items),
        not_told=not_told(facts),
        findings=findings(facts, load, mechanism),
        notes=tuple(notes(facts)),
        config=proposed,
        turns=facts.fit.turns,
    )


def _final(
    choice: Choice,
    motion: JointMotion,
    model: TorqueModel,
    base: MonitorConfig,
) -> tuple[proposal.Found, Load | None]:
    """The chosen fit again, with the terms that the recording determines, and the lag that it is late by."""
    one, declared = choice.best.fit, drive_figures(base.drive)
    terms = Terms(bias=one.pair.walks_both_ways, load_friction=True, lag=separates_lag(one.pair))
    # a repeating acceleration has less noise, but lacks the acceleration of a ramp
    pairs = one.pair, with_repeating_acceleration(one.pair, one.ratio)
    own, repeating = (fit(pair, model, one.refined, terms, with_errors=True) for pair in pairs)
    again = repeating if repeating.mismatch <= _AS_WELL * own.mismatch else own
    again, load = with_load(again, model, terms)
    sampling = sampling_of(again, model)
    used = sampling.value or base.drive_torque.sampling
    timing = timing_of(again, used, bool(sampling.value), declared)
    found = proposal.Found(choice, again, motion, sampling, timing, declared, base)
    return proposal.settled(found, model), load


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
                f"{name.joint} was recorded for {duration:.3g} s only. Expected at least {_LEAST_S:g} s"
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
            "no torque was recorded, or only NaN: expected geometry_msgs/msg/WrenchStamped, "
            "std_msgs/msg/Float64, or the effort of the crank in its sensor_msgs/msg/JointState"
        )
    varying = {
        name: each
        for name, each in torques.items()
        if np.ptp(each.value) > max(_LEAST_TORQUE, _LEAST_SWING * np.abs(each.value).max())
    }
    if not varying:
        constant = ", ".join(name.label for name in torques)
        raise LegWearError(f"no torque changes while the leg walks: {constant}")
    return varying
