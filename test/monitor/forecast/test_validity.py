"""How past forecasts did: shares and bias of draws whose law is known, and the words for it."""

import numpy as np
import pytest

from leg_wear_monitor.monitor.forecast.measurement import validity
from leg_wear_monitor.monitor.ledger.entry import Measurement

pytestmark = pytest.mark.plain


def measured(below):
    return [
        Measurement(
            stamp_ns=i, joint="A", who="ann", clearance_m=3e-4, sigma_m=1e-6, wear_m=0.0, cycles=i,
            replaced_ns=0, expected_below=float(fraction), counts=True,
        )
        for i, fraction in enumerate(below)
    ]  # fmt: skip


def test_a_true_forecast_holds_four_fifths_and_has_no_bias():
    told = validity(measured(np.random.default_rng(1).random(400)))
    assert int(told.split()[0]) / 400 == pytest.approx(0.8, abs=0.06)
    assert told.endswith("no bias found")


@pytest.mark.parametrize(("power", "word"), [(0.3, "faster"), (3.0, "slower")])
def test_bias_is_said(power, word):
    told = validity(measured(np.random.default_rng(1).random(40) ** power))
    assert told.endswith(f"joints wear {word} than forecast")


def test_a_few_measurements_say_nothing():
    assert "too few to evaluate" in validity(measured([0.99, 0.98]))
    assert validity([]).startswith("0 of 0 ")
