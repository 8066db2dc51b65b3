"""How past forecasts did: shares and bias of draws whose law is known, and the words for it."""

import numpy as np
import pytest
from ledger_contents import measured

from leg_wear_monitor.monitor.forecast.measurement import validity

pytestmark = pytest.mark.plain


def line_of(below):
    return validity([measured(expected_below=float(fraction)) for fraction in below])


def test_a_true_forecast_holds_four_fifths_and_has_no_bias():
    line = line_of(np.random.default_rng(1).random(400))
    assert int(line.split()[0]) / 400 == pytest.approx(0.8, abs=0.06)
    assert line.endswith("no bias found")


@pytest.mark.parametrize(("power", "word"), [(0.3, "faster"), (3.0, "slower")])
def test_bias_is_said(power, word):
    line = line_of(np.random.default_rng(1).random(40) ** power)
    assert line.endswith(f"joints wear {word} than forecast")


def test_a_few_measurements_say_nothing():
    assert "too few to evaluate" in line_of([0.99, 0.98])
    assert validity([]).startswith("0 of 0 ")
