"""The forecast in the monitor: when it is renewed, what a part and a measurement change, over new starts."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import LegWearError, WearMonitor
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.model_error import ModelError
from leg_wear_monitor.monitor.forecast.wear_coefficients import ClearanceAtWear
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance
from leg_wear_monitor.twin.statistics import CycleStatistics

SECOND = 10**9
LIMITS = [6e-4] * 5
SURE = ModelError(*np.zeros((3, 5)))  # of a leg that is known


def cycle(second, growth=2e-11):
    """A gait cycle's figures that end at a second, as far as the forecast looks at them."""
    zeros = {field.name: 0 for field in attrs.fields(CycleStatistics)}
    wobble = growth * (1.0 + 0.1 * np.sin(1.7 * second + np.arange(5.0)))
    own = {"stamp_ns": second * SECOND, "moving_s": 1.0, "growth_mean_m": wobble}
    return CycleStatistics(**(zeros | own))


def walked(forecaster, seconds, worn=0.0, valid=True):
    """Forecasts after each second."""
    wear = np.full(5, worn)
    return [forecaster.after(cycle(s), wear, LIMITS, lambda: valid, SURE) for s in seconds]


@pytest.fixture
def forecaster(leg):
    return Forecaster(leg, Forecasting(wear_coefficient_sigma=0.7), (), [0] * 5)


@pytest.mark.plain
def test_a_forecast_is_renewed_once_growth_is_known_and_then_once_a_minute(forecaster):
    forecasts = walked(forecaster, range(1, 125))
    renewed = [i for i in range(1, len(forecasts)) if forecasts[i] is not forecasts[i - 1]]
    assert renewed == [9, 69]
    assert [one.answer for one in forecasts[0].joints] == [Answer.NOT_ENOUGH_DATA] * 5
    assert [one.answer for one in forecasts[-1].joints] == [Answer.KNOWN] * 5
    # sooner than if growth stayed as it is: it rises as clearances open
    assert 1.2e7 < forecasts[-1].joints[0].cycles.p50 < 1.45e7
    assert forecasts[-1].leg.cycles.p50 < forecasts[-1].joints[0].cycles.p50


@pytest.mark.plain
def test_a_load_that_is_not_sure_widens_the_life(leg):
    settings = Forecasting(wear_coefficient_sigma=0.01, load_sigma=0.0, clearance_sigma_m=1e-9)

    def known_with(sigma):
        """Logarithms of p90 over p10 of lives, with a load of this sigma."""
        forecaster = Forecaster(leg, settings, (), [0] * 5)
        model = ModelError(*np.zeros((2, 5)), np.full(5, sigma))
        for second in range(1, 60):
            forecaster.after(cycle(second), np.zeros(5), LIMITS, lambda: True, SURE)
        found = forecaster.renewed(np.zeros(5), LIMITS, True, model)
        return np.log([one.cycles.p90 / one.cycles.p10 for one in found.joints])

    life, wider = map(known_with, (0.0, 0.2))
    # all growth is of impacts, so a load of 20 % adds 0.3 * 0.2; A is the first, and hardly depends on others
    assert wider[0] ** 2 - life[0] ** 2 == pytest.approx((2.0 * 1.2816 * 0.06) ** 2, rel=0.1)
    assert (wider > life).all()


@pytest.mark.plain
def test_a_stamp_that_goes_back_renews_it_too(forecaster):
    forecasts = walked(forecaster, [*range(1000, 1030), *range(5, 10)])
    assert forecasts[29] is not forecasts[30]


@pytest.mark.plain
def test_outside_validity_is_an_answer(forecaster):
    walked(forecaster, range(1, 60))
    assert walked(forecaster, [200], valid=False)[0].joints[0].answer is Answer.OUTSIDE_VALIDITY


@pytest.mark.plain
def test_a_replaced_part_is_not_known(forecaster):
    walked(forecaster, range(1, 80))
    forecaster.replaced("G", 80 * 10**9)
    (forecast,) = walked(forecaster, [80])
    assert [one.answer is Answer.NOT_ENOUGH_DATA for one in forecast.joints] == [
        False,
        False,
        True,
        False,
        False,
    ]


@pytest.mark.plain
def test_what_encoders_show_tightens_the_forecast_and_the_newest_replaces_the_last(forecaster):
    def spread(forecast):
        return forecast.cycles.p90 / forecast.cycles.p10

    before = walked(forecaster, range(1, 80), worn=1e-4)[-1].joints[0]
    assert forecaster.use_estimate(0, ClearanceAtWear(4.2e-4, 2e-5, 1e-4), 0)
    after = walked(forecaster, [80], worn=1e-4)[0].joints[0]
    assert after.measurements == 1
    assert spread(after) < 0.5 * spread(before)
    for _ in range(50):  # its error does not average out
        forecaster.use_estimate(0, ClearanceAtWear(4.2e-4, 2e-5, 1e-4), 0)
    again = walked(forecaster, [81], worn=1e-4)[0].joints[0]
    assert again.measurements == 1
    assert spread(again) == pytest.approx(spread(after), rel=1e-3)
    assert not forecaster.use_estimate(0, ClearanceAtWear(9e-4, 2e-5, 1e-6), 0)
    assert walked(forecaster, [82], worn=1e-4)[0].joints[0].measurements == 0


def test_the_monitor_forecasts_and_learns(leg, gait):
    """Over a snapshot, too; wear so fast that it shows."""
    monitor = WearMonitor(leg)  # its own: what a person measured is not undone by a snapshot
    reports = monitor.update(gait(14.0))
    assert reports.cycles[3].joints[0].forecast.answer is Answer.NOT_ENOUGH_DATA
    first = reports.cycles[-1].joints[0].forecast
    assert first.answer is Answer.KNOWN  # not only a minute after the first gait cycle
    snapshot = monitor.snapshot()
    found = monitor.measure("A", 3.05e-4, 2e-6, 10**18, "ann")
    assert found.measurement.counts
    forecast = monitor.update(gait(3.0, begin_s=14.0)).cycles[-1].joints[0].forecast
    assert forecast.measurements == 1
    assert forecast.clearance_m.p50 == pytest.approx(3.05e-4, abs=2e-6)
    monitor.restore(snapshot)
    again = monitor.update(gait(3.0, begin_s=14.0)).cycles[-1].joints[0].forecast
    assert again == first
    with pytest.raises(LegWearError, match="'Z' is not a clearance joint"):
        monitor.measure("Z", 3e-4, 1e-6, 0, "ann")


@pytest.mark.plain
def test_a_restored_forecaster_knows_nothing_of_a_later_correction(forecaster):
    def estimated():
        forecaster.use_estimate(0, ClearanceAtWear(3.4e-4, 2e-5, 3e-5), 0)
        return forecaster.state.coefficient_estimates[0].known.clearance_m

    snapshot = attrs.evolve(forecaster.state)
    before = estimated()
    correction = CorrectedClearance(
        stamp_ns=1, joint="A", clearance_m=1e-3, sigma_m=1e-4, before_m=1e-5, wear_m=7e-4, replaced_ns=0
    )
    forecaster.corrected(correction)
    assert estimated() == pytest.approx(1e-3)
    forecaster.state = attrs.evolve(snapshot)
    assert estimated() == before
