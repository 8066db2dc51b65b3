"""The evidence of gait cycles: their signatures, tests for a change, its explanations, and the clearances."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import (
    SURE_LOG_ODDS,
    SURE_SIGMAS,
    Cause,
    Change,
)
from leg_wear_monitor.estimate.clearance_fit import (
    ClearanceFit,
    best_fit,
    first_changed,
    start_of,
    starts_of,
    with_rivals,
)
from leg_wear_monitor.estimate.drive import DIRECT
from leg_wear_monitor.estimate.explanations import Explanation, change_of, with_doubt
from leg_wear_monitor.estimate.signature import TorqueSensor, averaged, signatures, with_noise_of
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.references import LegModels
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    UNUSABLE_CYCLES,
    UNUSED_CYCLES,
    NotUsed,
    SignedCycle,
    TorqueState,
    mean_of,
)
from leg_wear_monitor.twin.reference import cycle_profile
from leg_wear_monitor.twin.sample import INSTANT, within

_LOST = 1.5  # periods of the sensor: in a longer time between two samples, some were lost
_LEAST_CRANK_SAMPLES = 40  # least number of samples in a gait cycle for its profile

# largest jitter as a fraction of the sensor's period; beyond it, steps between samples do not show the
# roughness
_JITTER = 0.15

# A period near a rounding boundary may round either way between runs, so both are tried.
_ROUNDED = (1.0, 0.995, 1.005)


def _jitter(between_ns: Ints, period_ns: float) -> float:
    """Median departure of times between samples (n,) from a period, as a fraction of it."""
    return float(np.median(np.abs(between_ns - period_ns))) / period_ns


def find_sensor(
    state: TorqueState, begin_ns: int, end_ns: int, config: MonitorConfig, size_nm: float
) -> None:
    """Find the sensor's period in the first gait cycle with torques, and again where its rate has changed.

    A short disturbance does not discard the knowledge of the leg, or a change that was found.
    """
    own = state.sensor
    is_known = state.reference is not None or len(state.waiting) >= FIRST_CYCLES
    last = (NotUsed.JITTER,) * (UNUSED_CYCLES if is_known else UNUSABLE_CYCLES)
    if own is not None and (state.changes or state.unused[-len(last) :] != last):
        return
    between_ns = np.diff(within(state.samples.torque, begin_ns, end_ns)["stamp_ns"])
    period_ns = float(np.median(between_ns)) if len(between_ns) > 1 else math.nan
    if math.isnan(period_ns) or (own is not None and _jitter(between_ns, period_ns) > _JITTER):
        return
    near = [float(f"{part * (1.0e-9 * period_ns):.2g}") for part in _ROUNDED]
    known = {one.period_s for one in state.baselines}
    period_s = next((one for one in near if one in known), near[0])
    # cycles at the commanded cadence only, because a reference is for one cadence
    cycle_s = 60.0 / abs(config.cadence.commanded_rpm)
    if own is None or own.period_s != period_s:
        is_instant = config.drive_torque.sampling == INSTANT
        state.measure_with(TorqueSensor(period_s, cycle_s, size_nm, is_instant))


def signed_cycle(state: TorqueState, begin_ns: int, end_ns: int) -> SignedCycle | NotUsed:
    """A gait cycle between two passages of the crank's zero, or why it has no signature.

    Samples at a higher rate than signatures need are averaged.
    """
    sensor = state.sensor
    if sensor is None or not sensor.phases:
        return NotUsed.GAP
    cranks = within(state.samples.crank, begin_ns, end_ns)
    torques = within(state.samples.torque, begin_ns, end_ns)
    crank_ns, torque_ns, torque = cranks["stamp_ns"], torques["stamp_ns"], torques["torque_nm"]
    if len(crank_ns) < _LEAST_CRANK_SAMPLES or len(torque_ns) < 2 * sensor.together:
        return NotUsed.GAP
    if _jitter(np.diff(torque_ns), 1.0e9 * sensor.period_s) > _JITTER:
        return NotUsed.JITTER
    turned: Floats = np.asarray(np.unwrap(cranks["crank_angle_rad"], period=TURN), dtype=np.float64)
    since_s = np.asarray(1.0e-9 * (crank_ns - begin_ns), dtype=np.float64)
    profile = cycle_profile(since_s, turned, 1.0e-9 * (end_ns - begin_ns))
    gap = np.diff(torque_ns, prepend=torque_ns[0]) > _LOST * 1.0e9 * sensor.period_s
    # the ends are passages of zero, which torques may be nearer to than the first and the last crank angle
    ends = TURN * np.round(turned[[0, -1]] / TURN)
    place = np.concatenate([[begin_ns], crank_ns, [end_ns]])
    angle = np.interp(torque_ns, place, np.concatenate([ends[:1], turned, ends[1:]]))
    if sensor.together > 1:
        angle = angle[sensor.together - 1 :: sensor.together]
        torque = averaged(torque, sensor.together)
        gap = averaged(gap.astype(float), sensor.together) > 0.0
        angle = angle[: len(torque)]
    step = np.diff(torque, prepend=np.nan)
    step[gap] = np.nan  # the sample before was lost
    signature = signatures(np.zeros(len(angle), np.int64), angle, torque, step, sensor)[0]
    if not np.isfinite(signature).all():
        return NotUsed.GAP
    return SignedCycle(begin_ns, end_ns, signature, profile, mean_of(torques["temperature_c"]))


# Tests for a change, its explanations, and the clearances.


SETTLING_CYCLES = 10  # since a change, before the modelled clearances are corrected by it

# mean square up to which all clearances at once explain a leg with one or two open joints: 0.9 to 1.4; five,
# which they do not tell apart, leave 1.5 to 1.7, and a mass on the thigh 1.8 to 3.6 (2026-11-27)
_WHOLE = 1.4

_LEAST_CYCLES = 2  # since a change, before it is explained: the first contains the change itself
# for a leg that differs from its reference, because two unusual steps are not a change, and for a leg on the
# ground, because five gait cycles tell whether its load has changed
_LEAST_CYCLES_UNLIKE = 6
_FIT_EVERY = 10  # gait cycles, except for the first cycles of a change

# times the detector's threshold (both are natural logarithms of odds), from which on it hardly matters that
# the first cycles of a change were selected by their detection. Four cycles of J at 0.55 mm under 300 N gave
# 1.03 ± 0.17 mm at 2.1 times the threshold; G at 2 mm has 94, and G and I at 0.6 mm, whose sizes are right
# from the fourth cycle on, 3 to 7 (2026-11-26)
_FAR_BEYOND = 4.0

# mean square up to which a leg that was never commissioned fits: 0.4 to 0.9 for legs with masses 4 % off and
# a joint at 0.36 to 1 mm, from 1.1 on behind a low-pass of 50 Hz or a lag (docs/explanation/diagnosis.md)
_GOOD = 1.5
# natural logarithm of the odds over the next cause, of such a leg: joints that had opened alone have 26 and
# more; of pairs, I and J at 0.50 mm were J at 1.19 with 19, and B and G were G at 0.70 with 16 (2026-11-27)
_SURE_BEFORE = 20.0
_LEAST_BEFORE = 3  # gait cycles before a change that show the leg without it

# change of the load that the twin finds, in newtons and standard errors, from which on it has changed: 18 to
# 590 N for 20 to 600 N, and none with openings to 2 mm, masses, and dry joints (2026-11-27)
_LOAD_CHANGE_N, _LOAD_SIGMAS = 12.0, 4.0
_AMIDST = 2  # gait cycles before and after its begin in which the twin may be about to find it


def correction_of(state: TorqueState, joints: Sequence[str]) -> Change | None:
    """A settled change of one clearance at the present cadence: its modelled value is surely wrong."""
    if not state.changes or state.fit_cycles < SETTLING_CYCLES or not state.is_compared:
        return None
    change = state.changes[-1]
    if sum(cycle.begin_ns >= change.since_ns for cycle in state.cycles) < SETTLING_CYCLES:
        return None
    if change.subject not in joints or not (change.is_sure and change.is_wide):
        return None
    return change if _is_alone(state, change, joints.index(change.subject)) else None


def _is_alone(state: TorqueState, change: Change, joint: int) -> bool:
    """True if only this joint changed, and not two joints that look like one wider joint.

    B and G at 0.50 mm looked like G at 0.83 ± 0.11 mm, G and I like G at 0.84 ± 0.11, where all clearances at
    once had G at 0.47 and 0.54 mm (2026-11-27).
    """
    is_enough = state.commissioned is not None or change.runner_up_log_odds >= _SURE_BEFORE
    return is_enough and state.fit is not None and state.fit.agrees(joint, change)


class Evidence:
    """Evaluates the gait cycles that an observer keeps.

    Parameters
    ----------
    models : LegModels
    """

    def __init__(self, models: LegModels) -> None:
        self._models = models

    def add(self, state: TorqueState, cycle: SignedCycle, config: MonitorConfig) -> None:
        """Evaluate one more gait cycle."""
        if not state.is_compared:
            return
        self._test(state, cycle, config)
        self._explain(state, config)

    def review(self, state: TorqueState, config: MonitorConfig) -> None:
        """Evaluate all kept cycles again, because the reference or the baseline has changed."""
        self._know_sensor(state)
        if not state.is_compared:  # results from a different cadence stay
            return
        reported = state.changes
        is_before = bool(reported and state.cycles and reported[-1].since_ns < state.cycles[0].begin_ns)
        state.detector, state.changes, state.fit_due = None, reported if is_before else (), 0
        for cycle in state.cycles:
            self._test(state, cycle, config)
        self._explain(state, config)
        if reported and state.changes and state.changes[-1].subject == reported[-1].subject:
            state.changes = (_since(state.changes[-1], reported[-1].since_ns, state),)

    def settle(self, state: TorqueState, change: Change, modelled_m: Floats) -> None:
        """Take the gait cycles since a change as the commissioned leg's, with clearances (k,) [m].

        The error of the correction then does not look like a further change; it stays in the standard
        deviation. A second joint that opened as well would have explained the change better; the error of
        the fit of all clearances limits its change.
        """
        known, own, before_m = state.commissioned, self._models.explainer(state), state.modelled_m
        state.cycles = tuple(cycle for cycle in state.cycles if cycle.begin_ns >= change.since_ns)
        sigma_m = modelled_m.copy()  # not known
        if known is not None:
            mean, starts = state.signatures.mean(axis=0), starts_of(own, change, before_m)
            fit = best_fit(own, mean, len(state.cycles), before_m, starts, known.sigma_m)
            sigma_m = np.hypot(fit.sigma_m, fit.clearance_m - before_m)
        k = own.joints.index(change.subject)
        sigma_m[k] = change.sigma
        state.forget_baselines()
        channel = known.channel if known else DIRECT
        state.commissioned = state.baseline(state.cycles, modelled_m, sigma_m=sigma_m, channel=channel)
        state.settled = (*state.settled, attrs.evolve(change, is_corrected=True))

    def _know_sensor(self, state: TorqueState) -> None:
        """Find the noise of the torque sensor, and the channel behind which a commissioned leg is expected.

        Before it is commissioned, a worn joint and a filter could be confused, so there is no
        channel. A baseline after a correction has an uncertain clearance: it keeps its channel.
        """
        known = state.commissioned
        if state.reference is None or state.sensor is None or not (known or state.cycles):
            return
        mean = known.mean if known else state.signatures.mean(axis=0)
        if known is None:
            state.sensor = attrs.evolve(state.sensor, channel=DIRECT)
        elif known.is_as_modelled:
            state.sensor = self._models.channel(state.reference, state.sensor, known)
            if known.channel != state.sensor.channel:
                state.commissioned = attrs.evolve(known, channel=state.sensor.channel)
            return
        else:
            state.sensor = attrs.evolve(state.sensor, channel=known.channel)
        state.sensor = with_noise_of(state.reference, state.sensor, mean)

    def _test(self, state: TorqueState, cycle: SignedCycle, config: MonitorConfig) -> None:
        """Continue the tests for changes."""
        detector = self._models.detector(state, config)
        before = state.detector or detector.fresh()
        state.detector = detector.with_cycle(before, cycle.signature, cycle.begin_ns)

    def _explain(self, state: TorqueState, config: MonitorConfig) -> None:
        """Renew the clearances, and the change if there is one."""
        # the gait cycles since the change, if there is one: often at first, then now and then
        since_ns = self._since_ns(state, config)
        cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= since_ns]
        is_due = state.fit_due <= 0 or (since_ns and len(cycles) <= SETTLING_CYCLES)
        if len(cycles) < self._least_cycles(state) or not is_due:
            state.fit_due -= 1
            return
        state.fit_due = _FIT_EVERY - 1
        if state.changes and state.changes[-1].cause not in (Cause.CLEARANCE, Cause.SEVERAL):
            cycles = cycles[-SETTLING_CYCLES:]  # it may come and go
        # single causes: of a change, and of a leg that was never commissioned
        mean = np.mean([cycle.signature for cycle in cycles], axis=0)
        explanations: Sequence[Explanation] = ()
        if since_ns or state.commissioned is None:
            explanations = self._models.explainer(state).explanations(mean, len(cycles), state.modelled_m)
        # for a leg that differs from the reference, no names and no clearances are known
        is_known = state.commissioned or state.changes
        if not (is_known or self._fits(state, explanations, since_ns)):
            self._report(state, None, since_ns, len(cycles), config)
            state.fit, state.least_m = None, ()
            return
        change = self._change(state, explanations, since_ns) if since_ns else None
        # all clearances at once
        fit = self._fit(state, mean, len(cycles), change, explanations if since_ns else ())
        if change is not None and fit.square > _WHOLE:
            change = with_doubt(change, explanations)
        state.fit, state.fit_cycles = fit, len(cycles)
        self._report(state, change, since_ns, len(cycles), config)
        self._keep_least(state, change, config)

    def _since_ns(self, state: TorqueState, config: MonitorConfig) -> int:
        """Stamp since when the leg has changed, as reported before or as detected now; 0 where it has not."""
        if state.changes:
            return state.changes[-1].since_ns
        detector = self._models.detector(state, config)
        return detector.detected_ns(state.detector) if state.detector else 0

    def _report(
        self, state: TorqueState, change: Change | None, since_ns: int, cycles: int, config: MonitorConfig
    ) -> None:
        """Report a change; if no cause explains the detection once it had time to settle, test anew."""
        if change is not None:
            state.changes = (change,)
        elif since_ns and cycles >= SETTLING_CYCLES:
            state.changes, state.detector = (), self._models.detector(state, config).fresh()

    def _least_cycles(self, state: TorqueState) -> int:
        """Gait cycles since a change before it is explained."""
        is_like = self._models.fits(state) and not state.is_loaded
        return _LEAST_CYCLES if is_like else _LEAST_CYCLES_UNLIKE

    def _fits(self, state: TorqueState, explanations: Sequence[Explanation], since_ns: int) -> bool:
        """True if a leg that was never commissioned matches the reference, except for one clearance at most.

        It also matches if it did before a change: a large opening is explained less well.
        """
        if _is_of_reference(explanations):
            return True
        before = [cycle.signature for cycle in state.cycles if cycle.begin_ns < since_ns]
        if len(before) < _LEAST_BEFORE:
            return False
        explainer, mean = self._models.explainer(state), np.mean(before, axis=0)
        return _is_of_reference(explainer.explanations(mean, len(before), state.modelled_m))

    def _change(
        self, state: TorqueState, explanations: Sequence[Explanation], since_ns: int
    ) -> Change | None:
        """The change since a gait cycle, from the explanations of the later cycles, the best first.

        Before a leg is commissioned, only a sure clearance that is wide enough for a correction counts: all
        else is constant, and becomes part of the baseline. A change of a clearance gets its most probable
        start; any other change starts at its detection.
        """
        change = change_of(explanations, since_ns)
        of_load = _changed_load(state, change) if change else None
        if of_load is not None:
            return of_load
        if state.commissioned is None and not (change and change.is_sure and change.is_wide):
            return None
        if change is None or change.cause not in (Cause.CLEARANCE, Cause.SEVERAL):
            return change
        explainer = self._models.explainer(state)
        changed_m = start_of(change, explainer.joints, state.modelled_m)
        first = first_changed(explainer, state.signatures, state.modelled_m, changed_m)
        return _since(attrs.evolve(change, since_ns=state.cycles[first].begin_ns), since_ns, state)

    def _fit(
        self,
        state: TorqueState,
        mean: Floats,
        cycles: int,
        change: Change | None,
        explanations: Sequence[Explanation],
    ) -> ClearanceFit:
        """Estimate of all clearances from the mean signature (F,) of some cycles."""
        explainer, modelled_m = self._models.explainer(state), state.modelled_m
        starts = starts_of(explainer, change, modelled_m)
        known_sigma_m = state.commissioned.sigma_m if state.commissioned else 0.0
        found = best_fit(explainer, mean, cycles, modelled_m, starts, known_sigma_m)
        found = with_rivals(found, explanations, explainer.joints)
        if change is not None and change.cause is Cause.CLEARANCE:  # it may hide a second joint
            others = np.array([joint != change.subject for joint in explainer.joints])
            hidden = np.diag(np.where(others, found.clearance_m, 0.0) ** 2)
            found = attrs.evolve(found, covariance=found.covariance + hidden)
        return found

    def _keep_least(self, state: TorqueState, change: Change | None, config: MonitorConfig) -> None:
        """Keep the lower bounds of the clearances by the last fits, as many as an alarm waits for.

        The first gait cycles after a detection overstate the change, since they were selected by it. Where
        the change is far above the threshold, or as many cycles have passed as settle it, one fit is enough:
        its bound counts as all of them.
        """
        if state.fit is None or not self._models.fits(state):  # the change may belong to a different joint
            state.least_m = ()
            return
        number = config.alarms.on_delay_cycles
        least_m = state.fit.clearance_m - SURE_SIGMAS * state.fit.sigma_m
        is_enough = state.fit_cycles >= SETTLING_CYCLES
        if change is not None and change.is_sure:
            k = self._models.explainer(state).joints.index(change.subject)
            if _is_alone(state, change, k):
                least_m[k] = max(least_m[k], change.value - SURE_SIGMAS * change.sigma)
                is_enough |= change.log_odds >= _FAR_BEYOND * self._models.detector(state, config).threshold
            elif state.commissioned is None:  # the fit of all clearances does not show the joint either
                least_m[k] = -math.inf
        state.least_m = (least_m,) * number if is_enough else (*state.least_m, least_m)[-number:]


def _changed_load(state: TorqueState, change: Change) -> Change | None:
    """Attributes a change to the load at the foot if the twin finds a changed load since; else None.

    The load's shape differs from the shape of its column, and impacts change where it presses the joints: put
    on the ground, a healthy leg was A or J, *or something else*. A joint surely named before stays, and a leg
    that has a reference under a load follows the reference.
    """
    reported = state.changes[-1] if state.changes else None
    if state.is_loaded or state.commissioned is None or (reported and reported.is_sure):
        return None
    cycles = sum(one.begin_ns >= change.since_ns for one in state.cycles)
    earlier = state.carried_n[: -(cycles + _AMIDST)]
    now = state.carried_n[-max(_LEAST_CYCLES, min(cycles - _AMIDST, SETTLING_CYCLES)) :]
    known_n = float(np.mean(earlier)) if earlier else math.nan
    before_n = reported.counted if reported and reported.cause is Cause.LOAD else known_n
    value_n, sigma_n = float(np.mean(now)) - before_n, max(1.0, float(np.std(now)) / math.sqrt(len(now)))
    if not abs(value_n) >= max(_LOAD_CHANGE_N, _LOAD_SIGMAS * sigma_n):  # or the load is unknown
        return None
    return Change(
        cause=Cause.LOAD,
        since_ns=change.since_ns,
        value=value_n,
        sigma=sigma_n,
        counted=before_n,
        log_odds=change.log_odds,
    )


def _since(change: Change, earlier_ns: int, state: TorqueState) -> Change:
    """A change since an earlier stamp, if all kept gait cycles belong to it: older ones are forgotten."""
    is_whole = change.since_ns <= state.cycles[0].begin_ns
    return attrs.evolve(change, since_ns=min(change.since_ns, earlier_ns)) if is_whole else change


def _is_of_reference(explanations: Sequence[Explanation]) -> bool:
    """True if a leg as modelled, except for one clearance at most, explains a torque better than all others.

    The explanations are sorted, the best first; UNKNOWN, the leg as modelled, is always among them.
    """
    best = explanations[0]
    own = next(one for one in explanations if one.cause in (Cause.CLEARANCE, Cause.UNKNOWN))
    return own.square <= _GOOD and 0.5 * (own.misfit - best.misfit) < SURE_LOG_ODDS
