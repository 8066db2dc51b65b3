"""Update of the forecast with clearance estimates from encoders: each minute of stamps, or on a finding."""

from collections.abc import Sequence

import attrs

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceEstimate, ClearanceObservation
from leg_wear_monitor.monitor.encoders.observer import EncoderObserver
from leg_wear_monitor.monitor.forecast.forecaster import RENEWED_NS, Forecaster
from leg_wear_monitor.monitor.forecast.wear_coefficients import MeasuredClearance
from leg_wear_monitor.twin.statistics import CycleStatistics


def update_forecast(
    observer: EncoderObserver,
    forecaster: Forecaster,
    statistics: CycleStatistics,
    worn_m: Floats,
    replaced_ns: Sequence[int],
) -> tuple[ClearanceEstimate, ...]:
    """Clearance estimates after a gait cycle, and whether the forecast uses them.

    Parameters
    ----------
    watch : EncoderObserver
    forecaster : Forecaster
        Updated if that is due.
    statistics : CycleStatistics
    worn_m : (k,) array
        Wear counted by the twin for each part.
    replaced_ns : sequence of int
        When each part was replaced, 0 if it never was.
    """
    state, estimates = observer.state, observer.estimates(statistics.clearance_mean_m)
    other = tuple(one.is_other for one in estimates)
    is_due = other != state.other or not 0 <= statistics.stamp_ns - state.updated_ns < RENEWED_NS
    if is_due and any(one.observation is ClearanceObservation.SEEN for one in estimates):
        state.updated_ns, state.other = statistics.stamp_ns, other
        state.believed = tuple(
            one.observation is ClearanceObservation.SEEN
            and forecaster.use_estimate(k, _measured(one, float(worn_m[k])), replaced_ns[k])
            for k, one in enumerate(estimates)
        )
    believed = state.believed or (False,) * len(estimates)
    return tuple(
        attrs.evolve(one, believed=yes and one.observation is ClearanceObservation.SEEN)
        for one, yes in zip(estimates, believed, strict=True)
    )


def _measured(estimate: ClearanceEstimate, wear_m: float) -> MeasuredClearance:
    return MeasuredClearance(estimate.clearance_m, estimate.sigma_m, wear_m)
