"""The expected leg: its signatures and its baseline, the fit of its clearances, and how a change is named."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, Cause, Change
from leg_wear_monitor.estimate.clearance_fit import ClearanceFit, fit_clearances
from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.explanations import POOREST, Explainer, Explanation, opened
from leg_wear_monitor.estimate.nuisances import (
    commissioned_baseline,
    nuisances,
    other_channels,
    parts_left_out,
    unknown_baseline,
    with_scatter_of,
)
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.estimate.signature_model import signature_model
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference


def explainer_of(
    mechanism: Mechanism,
    reference: TorqueReference,
    sensor: TorqueSensor,
    commissioned: CommissionedTorque | None,
) -> Explainer:
    """What explains changes of a leg, measured by a sensor whose noise is known."""
    model = signature_model(reference, sensor)
    found, joints = nuisances(mechanism, reference, sensor), mechanism.clearance_joints
    if commissioned is None:
        baseline = unknown_baseline(found, sensor)
    else:
        expected = model.at(commissioned.clearance_m)[0]
        left_out = parts_left_out(model.covariance, commissioned.signatures)
        covariance = with_scatter_of(model.covariance, commissioned.signatures)
        model = attrs.evolve(model, covariance=covariance)
        baseline = commissioned_baseline(commissioned, expected, covariance, left_out)
    fresh_m = np.array([mechanism.clearances[joint].radial_clearance for joint in joints])
    return Explainer(model, joints, baseline, found, other_channels(reference, sensor), fresh_m)


def best_fit(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    counted_m: Floats,
    starts: Sequence[Floats],
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """All clearances from a mean signature, from the best of several starts: there are several minima."""
    fits = [fit_clearances(explainer, mean, cycles, start, counted_m, known_sigma_m) for start in starts]
    return min(fits, key=lambda fit: fit.misfit)


def start_of(change: Change | None, joints: Sequence[str], counted_m: Floats) -> Floats:
    """Clearances (k,) [m] after a change."""
    if change is None or change.cause is not Cause.CLEARANCE:
        return counted_m
    return opened(counted_m, joints.index(change.subject), change.value)


def change_of(explanations: Sequence[Explanation], since_ns: int) -> Change | None:
    """The change that explanations, the best first, amount to; None where the leg may be as counted.

    Of many causes one always explains a bit more than none.
    """
    best = explanations[0]
    nothing = next(one for one in explanations if one.cause is Cause.UNKNOWN)
    log_odds = 0.5 * (nothing.misfit - best.misfit)
    if log_odds < SURE_LOG_ODDS or not best.explains(nothing.square):
        if nothing.square <= POOREST:
            return None
        return Change(
            cause=Cause.UNKNOWN, since_ns=since_ns, value=0.0, sigma=0.0, counted=0.0, log_odds=log_odds
        )
    fact = (best.cause.fault_code, best.subject)
    second = next(one for one in explanations if (one.cause.fault_code, one.subject) != fact)
    runner_up = f"{second.cause.value} {second.subject}".strip()
    return Change(
        cause=best.cause,
        subject=best.subject,
        since_ns=since_ns,
        value=best.value,
        sigma=best.sigma,
        counted=best.counted,
        log_odds=log_odds,
        runner_up="as counted" if second is nothing else runner_up,
        runner_up_log_odds=0.5 * (second.misfit - best.misfit),
    )


def first_changed(explainer: Explainer, signatures: Floats, counted_m: Floats, changed_m: Floats) -> int:
    """Index of the first of some gait cycles, signatures (n, F), that belongs to a change of clearances.

    It is where the likelihood of the cycles before as counted, and of those after as changed, is largest.
    """
    before, after = (explainer.model.at(clearance)[0] for clearance in (counted_m, changed_m))
    weighted = np.linalg.solve(explainer.covariance(1), after - before)
    middle = 0.5 * (before + after) + explainer.baseline.offset
    gain = (signatures - middle) @ weighted
    return int(np.cumsum(gain[::-1])[::-1].argmax())
