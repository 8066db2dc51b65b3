"""The evidence of gait cycles: tests for a change, what explains it, and the clearances."""

import itertools
import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, SURE_SIGMAS, Cause, Change
from leg_wear_monitor.estimate.change_detector import first_changed
from leg_wear_monitor.estimate.clearance_fit import best_fit, start_of, starts_of, with_rivals
from leg_wear_monitor.estimate.drive import DIRECT
from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explanation, change_of
from leg_wear_monitor.estimate.signature import CommissionedTorque, TorqueSensor, with_noise_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.references import (
    COMMISSIONING_CYCLES,
    UNLIKE_CYCLES,
    LegModels,
    References,
)
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    UNUSABLE_CYCLES,
    AtCadence,
    NotUsed,
    SignedCycle,
    TorqueState,
)

SETTLING_CYCLES = 10  # since a change, before the counted clearances are corrected by it

# of the counted clearance: smaller openings are named wrongly where masses are 5 % off (diagnosis.md)
CORRECTED_FROM = 1.3

# mean square up to which another joint explains what a corrected leg shows beside the baseline before: G, I
# and B left 0.9 to 1.1 where they had opened with A and G, and J 1.9, at 1.7 mm for 0.6 (2026-11-27)
_WHOLLY = 1.5

_LEAST_CYCLES = 2  # since a change, before it is explained: the first contains the change itself
_LEAST_CYCLES_UNLIKE = 6  # where the leg is not that of its reference: two strange steps are no change
_FIT_EVERY = 10  # gait cycles, but for the first ones of a change

# times the detector's threshold (both are natural logarithms of odds), from which on it hardly matters that
# the first cycles of a change were selected by their detection. Four cycles of J at 0.55 mm under 300 N gave
# 1.03 ± 0.17 mm at 2.1 times the threshold; G at 2 mm has 94, and G and I at 0.6 mm, whose sizes are right
# from the fourth cycle on, 3 to 7 (2026-11-26)
_FAR_BEYOND = 4.0

# mean square up to which a leg that was never commissioned fits: 0.4 to 0.9 for legs with masses 4 % off and
# a joint at 0.36 to 1 mm, from 1.1 on behind a low-pass of 50 Hz or a lag (docs/explanation/diagnosis.md)
_GOOD = 1.5
_LEAST_BEFORE = 3  # gait cycles before a change that show the leg without it


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
        if not state.is_compared:  # what was found at another cadence stays
            return
        told = state.changes
        state.detector, state.changes, state.fit_due = None, told[:0], 0
        for cycle in state.cycles:
            self._test(state, cycle, config)
        self._explain(state, config)
        if told and state.changes and state.changes[-1].subject == told[-1].subject:
            state.changes = (_since(state.changes[-1], told[-1].since_ns, state),)

    def compare_with_before(self, state: TorqueState, is_last: bool = False) -> Change | None:
        """Compare a corrected leg with the baseline before, once there is a reference about it.

        What another joint changed at the same time is in the baseline after the correction, and would never
        be seen. Returns a clearance that surely opened, too; without one, or the last time, the others are
        known as well as they explain the leg.
        """
        known, is_fitted = state.commissioned, state.fit_due == _FIT_EVERY - 1
        if known is None or known.before is None or state.reference is None:
            return None
        if state.changes or not is_fitted or len(state.cycles) < SETTLING_CYCLES:
            return None
        explainer = self._models.explainer_since(known.before, state.reference, state)
        if explainer is None:
            return None
        counted_m, mean, cycles = state.counted_m, state.signatures.mean(axis=0), len(state.cycles)
        explanations = explainer.explanations(mean, cycles, counted_m)
        change = change_of(explanations, state.settled[-1].since_ns if state.settled else known.stamp_ns)
        is_wide = change is not None and change.value >= CORRECTED_FROM * change.counted
        if change and change.is_sure and is_wide and explanations[0].square <= _WHOLLY and not is_last:
            return change
        found = best_fit(explainer, mean, cycles, counted_m, starts_of(explainer, None, counted_m))
        state.commissioned = attrs.evolve(known, before=None)
        if found.square <= _WHOLLY:
            corrected_m = np.abs(counted_m - known.before.clearance_m).max()
            apart_m = np.abs(found.clearance_m - counted_m)
            own_m = np.sqrt(found.sigma_m**2 + apart_m**2 + (MODEL_ERROR * corrected_m) ** 2)
            own_m = np.hypot(own_m, known.before.sigma_m)
            state.know_corrected(np.where(known.is_unknown, own_m, known.sigma_m))
        state.fit_due = 0
        return None

    def _know_sensor(self, state: TorqueState) -> None:
        """Find the noise of the torque sensor, and the channel behind which a commissioned leg is expected.

        Before it is commissioned, a wide joint and a filter could be taken for each other, so there is no
        channel. A baseline after a correction has an uncertain clearance: its channel is that of the one
        before.
        """
        known = state.commissioned
        if state.reference is None or state.sensor is None or not (known or state.cycles):
            return
        mean = known.mean if known else state.signatures.mean(axis=0)
        if known is None:
            state.sensor = attrs.evolve(state.sensor, channel=DIRECT)
        elif known.is_as_counted:
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
        # single causes: of a change, and of a leg that was never commissioned
        mean = np.mean([cycle.signature for cycle in cycles], axis=0)
        explanations: Sequence[Explanation] = ()
        if since_ns or state.commissioned is None:
            explanations = self._models.explainer(state).explanations(mean, len(cycles), state.counted_m)
        # a leg that is not that of the reference has no names and no clearances
        if not (state.commissioned or state.changes or self._fits(state, explanations, since_ns)):
            self._tell(state, None, since_ns, len(cycles), config)
            state.fit, state.least_m = None, ()
            return
        change = self._change(state, explanations, since_ns) if since_ns else None
        self._tell(state, change, since_ns, len(cycles), config)
        # all clearances at once
        self._fit(state, mean, len(cycles), change, explanations if since_ns else ())
        self._keep_least(state, change, config)

    def _since_ns(self, state: TorqueState, config: MonitorConfig) -> int:
        """Stamp since when the leg has changed, as told before or as detected now; 0 where it has not."""
        if state.changes:
            return state.changes[-1].since_ns
        detector = self._models.detector(state, config)
        found = detector.detection(state.detector) if state.detector else None
        return found.since_ns if found else 0

    def _tell(
        self, state: TorqueState, change: Change | None, since_ns: int, cycles: int, config: MonitorConfig
    ) -> None:
        """Tell a change; where none explains what was detected once it had time to settle, test anew."""
        if change is not None:
            state.changes = (change,)
        elif since_ns and cycles >= SETTLING_CYCLES:
            state.changes, state.detector = (), self._models.detector(state, config).fresh()

    def _least_cycles(self, state: TorqueState) -> int:
        """Gait cycles since a change before it is explained."""
        return _LEAST_CYCLES if self._models.fits(state) else _LEAST_CYCLES_UNLIKE

    def _fits(self, state: TorqueState, explanations: Sequence[Explanation], since_ns: int) -> bool:
        """Whether a leg that was never commissioned is that of the reference, but for one clearance at most.

        It is, too, if it was before a change: a large opening is explained less well.
        """
        if _is_of_reference(explanations):
            return True
        before = [cycle.signature for cycle in state.cycles if cycle.begin_ns < since_ns]
        if len(before) < _LEAST_BEFORE:
            return False
        explainer, mean = self._models.explainer(state), np.mean(before, axis=0)
        return _is_of_reference(explainer.explanations(mean, len(before), state.counted_m))

    def _change(
        self, state: TorqueState, explanations: Sequence[Explanation], since_ns: int
    ) -> Change | None:
        """What has changed since a gait cycle, by the explanations of those from then on, the best first.

        Before a leg is commissioned, only a clearance that is sure counts: all else is constant, and becomes
        part of the baseline. A change of a clearance gets its most probable begin; another one keeps that of
        its detection.
        """
        change = change_of(explanations, since_ns)
        if state.commissioned is None and not (change and change.is_sure):
            return None
        if change is None or change.cause is not Cause.CLEARANCE:
            return change
        explainer = self._models.explainer(state)
        changed_m = start_of(change, explainer.joints, state.counted_m)
        first = first_changed(explainer, state.signatures, state.counted_m, changed_m)
        return _since(attrs.evolve(change, since_ns=state.cycles[first].begin_ns), since_ns, state)

    def _fit(
        self,
        state: TorqueState,
        mean: Floats,
        cycles: int,
        change: Change | None,
        explanations: Sequence[Explanation],
    ) -> None:
        """Estimate all clearances from the mean signature (F,) of some cycles."""
        explainer, counted_m = self._models.explainer(state), state.counted_m
        starts = starts_of(explainer, change, counted_m)
        known_sigma_m = state.commissioned.sigma_m if state.commissioned else 0.0
        found = best_fit(explainer, mean, cycles, counted_m, starts, known_sigma_m)
        found = with_rivals(found, explanations, explainer.joints)
        if change is not None and change.cause is Cause.CLEARANCE:  # it hides another one that opened with it
            others = np.array([joint != change.subject for joint in explainer.joints])
            hidden = np.diag(np.where(others, found.clearance_m, 0.0) ** 2)
            found = attrs.evolve(found, covariance=found.covariance + hidden)
        state.fit, state.fit_cycles = found, cycles

    def _keep_least(self, state: TorqueState, change: Change | None, config: MonitorConfig) -> None:
        """Keep the lower bounds of the clearances by the last fits, as many as an alarm waits for.

        The first gait cycles after a detection overstate the change, since they were selected by it. Where
        the change is far above the threshold, or as many cycles have passed as settle it, one fit is enough:
        its bound counts as all of them.
        """
        if state.fit is None:
            return
        number = config.alarms.on_delay_cycles
        least_m = state.fit.clearance_m - SURE_SIGMAS * state.fit.sigma_m
        is_enough = state.fit_cycles >= SETTLING_CYCLES
        if change is not None and change.is_sure:
            k = self._models.explainer(state).joints.index(change.subject)
            least_m[k] = max(least_m[k], change.value - SURE_SIGMAS * change.sigma)
            is_enough |= change.log_odds >= _FAR_BEYOND * self._models.detector(state, config).threshold
        state.least_m = (least_m,) * number if is_enough else (*state.least_m, least_m)[-number:]


def _since(change: Change, told_ns: int, state: TorqueState) -> Change:
    """A change since an earlier stamp, if all kept gait cycles belong to it: older ones are forgotten."""
    is_whole = change.since_ns <= state.cycles[0].begin_ns
    return attrs.evolve(change, since_ns=min(change.since_ns, told_ns)) if is_whole else change


def _is_of_reference(explanations: Sequence[Explanation]) -> bool:
    """Whether a leg as counted, but for one clearance at most, explains a torque better than anything else.

    The explanations are sorted, the best first; UNKNOWN, the leg as counted, is always among them.
    """
    best = explanations[0]
    own = next(one for one in explanations if one.cause in (Cause.CLEARANCE, Cause.UNKNOWN))
    return own.square <= _GOOD and 0.5 * (own.misfit - best.misfit) < SURE_LOG_ODDS


# Why there is no estimate of the clearances yet, or why it is not sure, and what comes next.


_IRREGULAR = (
    "the stamps of the drive torque are too irregular, or have another rate than before: a step between two "
    "samples has no known time"
)
_CHANGING_CYCLES, _ALIKE_CYCLES = 5, 3  # in a ramp of 30 rpm a minute, two or three in a row are alike


def missing(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Why there is no estimate."""
    if not math.isnan(state.off_cadence_rpm):
        own = config.cadence
        return (
            f"the cadence is {state.off_cadence_rpm:.3g} rpm, not the commanded "
            f"{own.commanded_rpm:.3g} ± {own.tolerance_rpm:.3g} rpm"
        )
    if state.unused and state.unused[-1] is NotUsed.JITTER:
        return _IRREGULAR
    if state.sensor is None or state.unused[-UNUSABLE_CYCLES:] == (NotUsed.GAP,) * UNUSABLE_CYCLES:
        return "no drive torque with enough samples in a gait cycle"
    if not state.sensor.phases:
        return "the drive torque has too few samples in a gait cycle"
    if state.reference is None and references.is_busy:
        return f"the reference for this leg is being simulated: {references.percent} %"
    if state.has_failed:
        return "the leg could not be simulated for a reference"
    if state.reference is None:
        return f"gait cycles: {len(state.waiting)} of {FIRST_CYCLES}"
    if state.unused and state.unused[-1] is NotUsed.UNLIKE:
        return _other_cadence(state, references)
    if len(state.cycles) < FIRST_CYCLES:
        return f"gait cycles: {len(state.cycles)} of {FIRST_CYCLES}"
    return "the drive torque is not that of the mechanism file (late, filtered, loaded, or of another leg)"


def doubt(state: TorqueState, references: References, models: LegModels) -> str:
    """Why an estimate is not sure; empty if it is."""
    if _is_unlike(state):
        return _other_cadence(state, references)
    if state.unused[-UNUSABLE_CYCLES:] == (NotUsed.JITTER,) * UNUSABLE_CYCLES:
        return _IRREGULAR
    if not state.is_compared:
        return f"changes at this cadence are not observed yet; at {_cadences(state.set_aside)} they are"
    if models.is_sure(state):
        if state.fit is None or state.commissioned is None or state.changes:
            return ""
        if state.commissioned.is_unknown.any():
            return _hidden(state, state.commissioned, models.explainer(state).joints)
        if state.fit.explains:
            return ""
        return (
            "the drive torque is not that of the commissioned leg, and no clearances explain it; they are "
            "estimated again when its noise, scale and lost samples are as they were. If the sensor was "
            "changed, reset a joint and undo it: the leg is commissioned again"
        )
    if state.sensor and state.is_narrow:
        hz = state.sensor.channel.bandwidth_hz
        return f"the drive passes {hz:.0f} Hz of the torque: names of joints are not sure, none is corrected"
    known = "the model does not fit this leg, and the names of joints are not sure: "
    if not state.changes:
        known = "the model does not fit this leg, but nothing has changed since it was commissioned: "
    if state.load and references.is_load_left_out(state):
        carried = f"about {state.load.peak_n:.0f} ± {state.load.peak_sigma_n:.0f} N in stance"
        return f"{known}the foot carries {carried}; set load.model to ground"
    if references.is_busy:
        what = (
            "its masses, lengths and friction are" if state.rounds else "the leg under the ground's force is"
        )
        what = what if state.is_identifying else "a reference for it is"
        return f"{known}{what} being simulated, {references.percent} %"
    if state.load and not state.load.is_sure and not math.isnan(state.load.other_n):
        sizes = f"{state.load.peak_n:.0f} N and {state.load.other_n:.0f} N explain its drive torque as well"
        return f"{known}the force on the foot is not observable: {sizes}"
    return f"{known}masses, lengths and friction near those of the file do not explain its drive torque"


def _hidden(state: TorqueState, known: CommissionedTorque, joints: Sequence[str]) -> str:
    """That joints may have opened with one that was corrected."""
    names = ", ".join(itertools.compress(joints, known.is_unknown))
    compared = next((one for one in state.all_commissioned if one.before is not None), None)
    if compared is None:
        then = "the torque cannot tell, measure them"
    elif compared is known:
        then = "a reference about it will show"
    else:
        then = f"a reference about it will show at {60.0 * abs(compared.speed) / TURN:.3g} rpm"
    return f"{names} may have opened with the joint that was corrected: {then}"


def other_sensor(state: TorqueState) -> str:
    """That a baseline is of another sensor, until there is one of the present sensor; empty otherwise."""
    sensor = state.sensor
    if sensor is None or state.commissioned is not None:
        return ""
    other = next((one for one in state.baselines if not one.is_of(sensor)), None)
    if other is None:
        return ""
    now = _sampled(sensor, sensor.phases)
    then = "unknown" if math.isnan(other.period_s) else _sampled(other, other.signatures.shape[1] // 2)
    return f"the baseline is of another torque sensor ({then}; now {now}): the leg is commissioned again"


def _sampled(one: TorqueSensor | CommissionedTorque, phases: int) -> str:
    """How a torque is sampled, such as ``1000 Hz, means, 5 averaged, 80 phases``."""
    together = f", {one.together} averaged" if one.together > 1 else ""
    kind = "instants" if one.is_instant else "means"
    return f"{1.0 / one.period_s:.0f} Hz, {kind}{together}, {phases} phases"


def _is_unlike(state: TorqueState) -> bool:
    """Whether the crank turns otherwise than in all references, and not only as it starts or stops."""
    return state.unused[-UNUSABLE_CYCLES:] == (NotUsed.UNLIKE,) * UNUSABLE_CYCLES


def _is_changing(state: TorqueState) -> bool:
    """Whether the cadence changes: of the last gait cycles only a few are alike."""
    last = (NotUsed.UNLIKE,) * _CHANGING_CYCLES
    return state.unused[-_CHANGING_CYCLES:] == last and len(state.waiting) <= _ALIKE_CYCLES


def _other_cadence(state: TorqueState, references: References) -> str:
    """What becomes of gait cycles whose crank turns otherwise than in all references."""
    if _is_changing(state):
        now = f"now {abs(state.waiting[-1].profile.cadence_rpm):.3g} rpm" if state.waiting else "now"
        return f"the cadence changes, {now}; gait cycles are compared at {_cadences(state.known)}"
    known = f"the crank turns otherwise than in the references ({_cadences(state.known)})"
    if state.waiting and references.is_for(state.waiting[-1].profile):
        return f"{known}; another one is being simulated: {references.percent} %"
    return known


def next_step(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """What is known next if the leg walks on as it does, and when; empty where walking adds nothing."""
    is_hopeless = state.has_failed or not (state.sensor and state.sensor.phases)
    if is_hopeless or not math.isnan(state.off_cadence_rpm):
        return ""
    commanded_s = 60.0 / abs(config.cadence.commanded_rpm)
    is_unlike = state.reference is not None and _is_unlike(state)
    last = state.waiting[-1:] if is_unlike or state.reference is None else state.cycles[-1:]
    cycle_s = TURN / abs(last[0].profile.speed) if last else commanded_s
    if references.is_late:
        return f"{_simulated(state, references, is_unlike)} later than in a replay: this machine is too busy"
    if references.is_busy:
        left_s = references.cycles_left * commanded_s
        then = "; a reference with them follows" if state.is_identifying else ""
        return f"{_simulated(state, references, is_unlike)} in {_cycles(left_s / cycle_s, cycle_s)}{then}"
    if state.reference is None:
        return f"a reference is chosen in {_cycles(FIRST_CYCLES - len(state.waiting), cycle_s)}"
    if is_unlike:
        left = UNLIKE_CYCLES - len(state.waiting)
        return "" if _is_changing(state) else f"a reference for it is begun in {_cycles(left, cycle_s)}"
    if state.commissioned is None and not state.changes:
        left = COMMISSIONING_CYCLES - len(state.cycles)
        return f"the baseline, with which smaller changes are found, is complete in {_cycles(left, cycle_s)}"
    return ""


def _simulated(state: TorqueState, references: References, is_unlike: bool) -> str:
    """What is known when that which is being simulated is there."""
    if state.is_identifying:
        return "masses, lengths and friction of this leg are identified"
    if state.reference is None:
        return "clearances are compared"
    if is_unlike and state.waiting and references.is_for(state.waiting[-1].profile):
        return "gait cycles at this cadence are compared"
    return "a reference that is nearer to this leg is in force"


def _cycles(number: float, cycle_s: float) -> str:
    """A number of gait cycles, and the time that they take."""
    whole = max(1, math.ceil(number))
    return f"{whole} gait cycle{'s' if whole > 1 else ''} ({whole * cycle_s:.0f} s)"


def _cadences(known: Sequence[AtCadence]) -> str:
    """Cadences in the order of their speeds."""
    speeds = sorted(abs(one.reference.profile.speed) for one in known)
    return f"{', '.join(f'{60.0 * speed / TURN:.3g}' for speed in speeds)} rpm"
