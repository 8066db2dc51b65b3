"""The evidence of gait cycles: tests for a change, what explains it, and the clearances."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, Cause, Change
from leg_wear_monitor.estimate.explanations import Explanation
from leg_wear_monitor.estimate.leg_model import best_fit, change_of, first_changed, start_of
from leg_wear_monitor.estimate.signature import DIRECT
from leg_wear_monitor.estimate.signature_model import with_noise_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.leg_models import LegModels
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle, TorqueState

SETTLING_CYCLES = 10  # since a change, before the counted clearances are corrected by it

_LEAST_CYCLES = 2  # since a change, before it is explained: the first contains the change itself
_LEAST_CYCLES_UNLIKE = 6  # where the leg is not that of its reference: two strange steps are no change
_FIT_EVERY = 10  # gait cycles, while nothing changes

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
        state.detector, state.changes, state.fit_due = None, (), 0
        for cycle in state.cycles:
            self._test(state, cycle, config)
        self._explain(state, config, is_due=True)

    def _know_sensor(self, state: TorqueState) -> None:
        """Find the noise of the torque sensor, and the channel behind which a commissioned leg is expected.

        Before, a wide joint and a filter could be taken for each other. A baseline after a correction has
        clearances that are not sure: its channel is that of the one before.
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

    def _explain(self, state: TorqueState, config: MonitorConfig, is_due: bool = False) -> None:
        """Renew the clearances, and the change if there is one."""
        detector = self._models.detector(state, config)
        found = detector.detection(state.detector) if state.detector else None
        since_ns = state.changes[-1].since_ns if state.changes else found.since_ns if found else 0
        cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= since_ns]
        if len(cycles) < self._least_cycles(state) or not (since_ns or state.fit_due <= 0):
            state.fit_due -= 1
            return
        state.fit_due = _FIT_EVERY - 1
        if since_ns and not (is_due or _is_due(len(cycles))):
            return
        mean, change = np.mean([cycle.signature for cycle in cycles], axis=0), None
        explanations: Sequence[Explanation] = ()
        if since_ns or state.commissioned is None:
            explanations = self._models.explainer(state).explanations(mean, len(cycles), state.counted_m)
        is_known = bool(state.commissioned or state.changes or self._fits(state, explanations, since_ns))
        if since_ns and is_known:
            change = self._change(state, explanations, since_ns)
        if since_ns:
            if change is not None:
                state.changes = (change,)
            elif len(cycles) >= SETTLING_CYCLES:  # what was detected does not last
                state.changes, state.detector = (), detector.fresh()
        if not is_known:
            state.fit = None
        else:
            self._fit(state, mean, len(cycles), change)

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
        return attrs.evolve(change, since_ns=state.cycles[first].begin_ns)

    def _fit(self, state: TorqueState, mean: Floats, cycles: int, change: Change | None) -> None:
        """Estimate all clearances from the mean signature (F,) of some cycles."""
        explainer, counted_m = self._models.explainer(state), state.counted_m
        starts = [counted_m, start_of(change, explainer.joints, counted_m)]
        starts += [state.fit.clearance_m] if state.fit else []
        known_sigma_m = state.commissioned.sigma_m if state.commissioned else 0.0
        state.fit = best_fit(explainer, mean, cycles, counted_m, starts, known_sigma_m)
        state.fit_cycles = cycles


def _is_of_reference(explanations: Sequence[Explanation]) -> bool:
    """Whether one clearance at most explains a torque, by its causes, the best first.

    They include a torque that is late or filtered.
    """
    best = explanations[0]
    own = next(one for one in explanations if one.cause in (Cause.CLEARANCE, Cause.UNKNOWN))
    return own.square <= _GOOD and 0.5 * (own.misfit - best.misfit) < SURE_LOG_ODDS


def _is_due(cycles: int) -> bool:
    """Whether a change is explained again after so many gait cycles: often at first."""
    return cycles <= SETTLING_CYCLES or cycles % _FIT_EVERY == 0
