"""The evidence of gait cycles: tests for a change, what explains it, and the clearances."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.diagnosis import Cause, Change
from leg_wear_monitor.monitor.diagnosis.leg_model import best_fit, change_of, first_changed, start_of
from leg_wear_monitor.monitor.diagnosis.leg_models import LegModels
from leg_wear_monitor.monitor.diagnosis.signature_model import with_noise_of
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle, TorqueState

SETTLING_CYCLES = 10  # since a change, before the counted clearances are corrected by it

_LEAST_CYCLES = 2  # since a change, before it is explained: the first contains the change itself
_FIT_EVERY = 10  # gait cycles, while nothing changes


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
        self._test(state, cycle, config)
        self._explain(state, config)

    def review(self, state: TorqueState, config: MonitorConfig) -> None:
        """Evaluate all kept cycles again, because the reference or the baseline has changed."""
        self._models.forget()
        is_measured = state.commissioned is not None or len(state.cycles) > 0
        if state.reference is not None and state.sensor is not None and is_measured:
            measured = state.commissioned.mean if state.commissioned else state.signatures.mean(axis=0)
            state.sensor = with_noise_of(state.reference, state.sensor, measured)
        state.detector, state.changes = None, ()
        for cycle in state.cycles:
            self._test(state, cycle, config)
        self._explain(state, config)

    def _test(self, state: TorqueState, cycle: SignedCycle, config: MonitorConfig) -> None:
        """Continue the tests for changes."""
        detector = self._models.detector(state, config)
        before = state.detector or detector.fresh()
        state.detector = detector.with_cycle(before, cycle.signature, cycle.begin_ns)

    def _explain(self, state: TorqueState, config: MonitorConfig) -> None:
        """Renew the clearances, and the change if there is one."""
        detector = self._models.detector(state, config)
        found = detector.detection(state.detector) if state.detector else None
        since_ns = state.changes[-1].since_ns if state.changes else found.since_ns if found else 0
        cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= since_ns]
        if len(cycles) < _LEAST_CYCLES or not (since_ns or state.fit is None or state.fit_due <= 0):
            state.fit_due -= 1
            return
        state.fit_due = _FIT_EVERY - 1
        if since_ns and not _is_due(len(cycles)):
            return
        mean, change = np.mean([cycle.signature for cycle in cycles], axis=0), None
        if since_ns:
            change = self._change(state, mean, len(cycles), since_ns)
            if change is not None:
                state.changes = (change,)
            elif len(cycles) >= SETTLING_CYCLES:  # what was detected does not last
                state.changes, state.detector = (), detector.fresh()
        self._fit(state, mean, len(cycles), change)

    def _change(self, state: TorqueState, mean: Floats, cycles: int, since_ns: int) -> Change | None:
        """What has changed, by the mean signature (F,) of some cycles since then.

        A change of a clearance gets its most probable begin; another one keeps that of its detection.
        """
        explainer = self._models.explainer(state)
        change = change_of(explainer.explanations(mean, cycles, state.counted_m), since_ns)
        if change is None or change.cause is not Cause.CLEARANCE:
            return change
        changed_m = start_of(change, explainer.joints, state.counted_m)
        first = first_changed(explainer, state.signatures, state.counted_m, changed_m)
        return attrs.evolve(change, since_ns=state.cycles[first].begin_ns)

    def _fit(self, state: TorqueState, mean: Floats, cycles: int, change: Change | None) -> None:
        """Estimate all clearances from the mean signature (F,) of some cycles."""
        explainer, counted_m = self._models.explainer(state), state.counted_m
        starts = [counted_m, start_of(change, explainer.joints, counted_m)]
        starts += [state.fit.clearance_m] if state.fit else []
        state.fit = best_fit(explainer, mean, cycles, counted_m, starts)
        state.fit_cycles = cycles


def _is_due(cycles: int) -> bool:
    """Whether a change is explained again after so many gait cycles: often at first."""
    return cycles <= SETTLING_CYCLES or cycles % _FIT_EVERY == 0
