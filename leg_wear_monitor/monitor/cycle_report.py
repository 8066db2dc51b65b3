"""A gait cycle: its report, and what it shows of the leg, taken over into forecast and twin."""

import logging
import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, TorqueExplanation
from leg_wear_monitor.estimate.least_squares import DATA_ERRORS
from leg_wear_monitor.estimate.mismatch import Allowed, explanation
from leg_wear_monitor.files import with_same_fields
from leg_wear_monitor.monitor.alarm_specs import MISMATCH
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate, ClearanceObservation
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, TorqueState
from leg_wear_monitor.monitor.forecast.forecast import Forecast
from leg_wear_monitor.monitor.forecast.forecaster import RENEWED_NS
from leg_wear_monitor.monitor.forecast.growth import growth_rate
from leg_wear_monitor.monitor.forecast.wear_coefficients import ClearanceAtWear
from leg_wear_monitor.monitor.ledger.entry import Audit, CorrectedClearance, IdentifiedLeg, SimulatedReference
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import CycleReport, JointReport, shown_by_torque
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.statistics import CycleStatistics, TorqueStatistics

_LOG = logging.getLogger(__name__)


def cycle_report(
    parts: Parts,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
) -> CycleReport:
    """Report of a gait cycle.

    Parameters
    ----------
    parts : Parts
    statistics : CycleStatistics
    forecast : Forecast
    seen : sequence of ClearanceEstimate or None
        None without encoders.
    """
    torque, diagnosis = statistics.torque, parts.diagnosis
    joints = range(len(parts.clearance_joints))
    return with_same_fields(
        CycleReport,
        torque,
        statistics,
        cycle=parts.accounting.state.cycles,
        joints=tuple(_joint_report(parts, k, statistics, forecast, seen, diagnosis) for k in joints),
        torque_samples=torque.samples,
        measured_torque_rms_nm=float(torque.measured_rms_nm),
        predicted_torque_rms_nm=float(torque.predicted_rms_nm),
        residual_torque_rms_nm=float(torque.residual_rms_nm),
        torque_mismatch=_mismatch(torque),
        forecast=forecast.leg,
    )


def _mismatch(torque: TorqueStatistics) -> float:
    """What load, frictions and lag do not explain, as a fraction of what was predicted; NaN if not known."""
    predicted_nm = torque.predicted_rms_nm
    return float(torque.unexplained_rms_nm / predicted_nm) if predicted_nm > 0.0 else math.nan


def _joint_report(
    parts: Parts,
    k: int,
    statistics: CycleStatistics,
    forecast: Forecast,
    seen: Sequence[ClearanceEstimate] | None,
    diagnosis: Diagnosis,
) -> JointReport:
    joint, rate = parts.clearance_joints[k], growth_rate(parts.state.growth[k])
    mean_n, p99_n = float(statistics.mean_force_n[k]), float(statistics.p99_force_n[k])
    rubbing_w = float(statistics.archard_j[k] / statistics.moving_s)
    error_m = rate.error_m(parts.model_error.relative(k, rate.per_cycle_m)) if rate else None
    return JointReport(
        joint=joint,
        clearance_m=float(statistics.clearance_mean_m[k]),
        clearance_max_m=float(statistics.clearance_max_m[k]),
        growth_m_per_cycle=rate.per_cycle_m if rate else None,
        growth_mps=rate.per_second_m if rate else None,
        growth_error_m_per_cycle=error_m,
        forecast=forecast.joints[k],
        seen=seen[k] if seen else None,
        measured=parts.measured[k],
        peak_force_n=float(statistics.peak_force_n[k]),
        p99_force_n=p99_n,
        mean_force_n=mean_n,
        impacts=int(statistics.impacts[k]),
        load=parts.bushings[joint].load(mean_n, p99_n, rubbing_w),
        shown=shown_by_torque(k, diagnosis),
    )


# What the gait shows of the leg, taken over: by encoders into the forecast, by the torque into the twin.


def clearance_estimates(parts: Parts, statistics: CycleStatistics) -> tuple[ClearanceEstimate, ...] | None:
    """Clearances estimated from encoders after a gait cycle, and whether the forecast uses them.

    They update the forecast each minute of stamps, or on a finding; None without encoders.
    """
    if parts.encoders is None:
        return None
    state, estimates = parts.encoders.state, parts.encoders.estimates(statistics.clearance_mean_m)
    is_seen = [one.observation is ClearanceObservation.SEEN for one in estimates]
    other = tuple(one.is_other for one in estimates)
    is_due = other != state.other or not 0 <= statistics.stamp_ns - state.updated_ns < RENEWED_NS
    if is_due and any(is_seen):
        state.updated_ns, state.other = statistics.stamp_ns, other
        worn_m, replaced_ns = parts.worn_m(statistics.clearance_mean_m), parts.accounting.replaced_ns
        state.believed = tuple(
            is_seen[k]
            and parts.forecaster.use_estimate(
                k, ClearanceAtWear(one.clearance_m, one.sigma_m, float(worn_m[k])), replaced_ns[k]
            )
            for k, one in enumerate(estimates)
        )
    believed = state.believed or (False,) * len(estimates)
    each = zip(estimates, believed, is_seen, strict=True)
    return tuple(attrs.evolve(one, believed=yes and seen) for one, yes, seen in each)


def explain_mismatch(parts: Parts, statistics: CycleStatistics) -> None:
    """Look for causes of a torque mismatch after a gait cycle; a wrong torque says nothing of the leg."""
    allowed, was_wrong = parts.evaluation.allowed_torque, parts.is_torque_wrong
    parts.state.mismatch = parts.state.mismatch.with_cycle(
        statistics,
        parts.evaluation.board.alarms[MISMATCH.name()],
        lambda cycles: _explained(parts, cycles, allowed),
    )
    if not parts.state.mismatch.cycles:
        parts.state.unexplained = ""
    if parts.torque and parts.is_torque_wrong and not was_wrong:
        # the alarm rose some gait cycles after the torque became wrong
        before = parts.config.alarms.on_delay_cycles + 1
        first = parts.state.mismatch.cycles[0]
        parts.torque.withdraw(first.begin_ns - before * (first.stamp_ns - first.begin_ns))


def _explained(parts: Parts, cycles: Sequence[CycleStatistics], allowed: Allowed) -> TorqueExplanation | None:
    """What explains a torque mismatch. None if the data lead to no explanation; the state says why."""
    before, parts.state.unexplained = parts.state.unexplained, ""
    try:
        return explanation(parts.mechanism, cycles, allowed)
    except DATA_ERRORS as error:
        parts.state.unexplained = f"the torque mismatch has no explanation ({error or type(error).__name__})"
        if parts.state.unexplained != before:
            _LOG.warning("%s", parts.state.unexplained, exc_info=error)
        return None


def observe_torque(parts: Parts) -> None:
    """Compare the drive torque with that of the counted leg, and correct what is surely counted wrong."""
    torque, twin = parts.torque, parts.twin
    if torque is None:
        return
    before = attrs.evolve(torque.state)
    hidden = before.corrected
    if hidden is not None and hidden.is_unknown.any():  # a measurement since then need not be asked for
        stamps_ns = [one.stamp_ns if one is not None else 0 for one in parts.measured]
        torque.state.measured = tuple(stamp_ns >= hidden.stamp_ns for stamp_ns in stamps_ns)
    correction = torque.end_period(twin.clearance_mean_m, twin.depth)
    measured = parts.measured[parts.clearance_joints.index(correction.subject)] if correction else None
    if correction is not None and measured is not None and parts.contradiction(correction):
        torque.contradicted(correction, measured.clearance_m, measured.sigma_m)
        correction = None
    is_wrong = parts.is_torque_wrong
    if not is_wrong:
        _take_parameters(parts, torque.parameters)
    if correction is not None and not is_wrong:
        correct(parts, correction)
        torque.corrected(correction, twin.clearance_mean_m)
    _note_torque(parts, torque, before)
    if correction is not None and not is_wrong:
        parts.keep()


def correct(parts: Parts, change: Change) -> None:
    """Open a joint to the clearance that the drive torque shows, and count its wear from there."""
    stamp_ns, joint = parts.twin.intake.followed_stamp_ns, change.subject
    was = parts.accounting.correct(joint, change.value)
    now = parts.accounting.wear_of(joint)
    corrected = CorrectedClearance(
        stamp_ns=stamp_ns,
        joint=joint,
        clearance_m=float(parts.twin.clearance_mean_m[parts.clearance_joints.index(joint)]),
        sigma_m=change.sigma,
        before_m=was.mean_m,
        wear_m=now.mean_m,
        replaced_ns=now.replaced_ns,
    )
    parts.accounting.note(Audit(stamp_ns, "diagnosis", "correct_clearance", was))
    parts.accounting.note(corrected)
    parts.forecaster.corrected(corrected)
    if parts.encoders:
        parts.encoders.state.updated_ns = 0  # the next estimate updates the forecast again
    parts.grows_anew([joint])


def _take_parameters(parts: Parts, found: LegParameters | None) -> None:
    """Let the twin walk on with the masses, lengths and friction that the drive torque shows."""
    if found is None or found == parts.twin.parameters or not parts.config.diagnosis.apply_corrections:
        return
    parts.twin.set_parameters(found)
    stamp_ns = parts.twin.intake.followed_stamp_ns
    parts.accounting.note(IdentifiedLeg(stamp_ns, tuple(parts.mechanism.bodies), found))
    parts.grows_anew(parts.clearance_joints)
    parts.keep()


def _note_torque(parts: Parts, torque: TorqueObserver, before: TorqueState) -> None:
    """Store the baselines and the references of the leg that are new since a state.

    To simulate a reference again takes a minute of walking.
    """
    state, stamp_ns = torque.state, parts.twin.intake.followed_stamp_ns
    known = (*before.all_commissioned, *(one.baseline for one in before.all_interims))
    found = state.all_commissioned if not state.is_load_new else ()
    # a baseline that follows ends the interim
    is_over = len(state.all_interims) < len(before.all_interims)
    # a load is known from the twin's motion alone
    interims = (
        each for each in state.all_interims if all(one.cause is not Cause.LOAD for one in each.changes)
    )
    for baseline in (*found, *(each.baseline for each in interims)):
        if is_over or all(baseline is not other for other in known):
            parts.accounting.note(baseline)
    names, made = tuple(parts.mechanism.bodies), [one.reference for one in before.known]
    for reference in torque.simulated_references:
        if all(reference is not other for other in made):
            parts.accounting.note(SimulatedReference(stamp_ns, names, reference))
            parts.keep()
