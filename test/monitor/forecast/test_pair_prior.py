"""What is believed of a wear coefficient before measurements: configured, of the pair, or the usual one."""

import copy
import math
from pathlib import Path
from typing import Any

import attrs
import pytest
from ruamel.yaml import YAML

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.loader import shipped_mechanisms
from leg_wear_monitor.mechanism.materials import USUAL_SPREAD, spread_of
from leg_wear_monitor.mechanism.plausible import doubts
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.wear_coefficients import usual_prior
from leg_wear_monitor.monitor.parts import Parts

pytestmark = pytest.mark.plain

LEG = lw.load_mechanism("bionic_leg")
GREASED = LEG.clearances["A"]
NO_SETTING = Forecasting()


def own_pair(path: Path, **spreads: float | None) -> lw.Mechanism:
    """The default leg with a pair of its own: 3e-15 and 1e-15 1/Pa, with spreads."""
    document: dict[str, Any] = {"name": "own", "title": "own", "lubricant": "none", "regime": "dry"}
    for side, k in (("bushing", 3e-15), ("journal", 1e-15)):
        source = {"source": "a test", "conditions": "none"}
        wear: dict[str, Any] = {"value": k, "unit": "1/Pa", **source}
        if spreads.get(side) is not None:
            wear["spread"] = {"value": spreads[side], "unit": "ln", **source}
        document[side] = {"material": "steel", "wear_coefficient": wear}
    yaml = YAML()
    yaml.dump(document, path / "own.yaml")
    leg = copy.deepcopy(YAML(typ="safe").load(shipped_mechanisms()["bionic_leg"]))
    leg["clearances"]["defaults"]["material"] = str(path / "own.yaml")
    yaml.dump(leg, path / "leg.yaml")
    return lw.load_mechanism(path / "leg.yaml")


def test_the_default_leg_has_the_spread_of_its_regime():
    prior = usual_prior(NO_SETTING, GREASED)
    assert prior.sigma == pytest.approx(1.15)
    # four standard deviations from end to end of the regime's range, 1e-16 to 1e-14 1/Pa
    assert prior.sigma == pytest.approx(math.log(100.0) / 4.0, rel=2e-3)
    assert prior.basis == "spread of steel-on-steel-greased-mild"
    assert prior.holds_for == "steel-on-steel-greased-mild (greased, mild)"
    assert [
        each.prior.sigma for each in Parts(LEG, config_from({}), None).forecaster.state.coefficient_estimates
    ] == [1.15] * 5


def test_a_configured_spread_comes_first():
    prior = usual_prior(Forecasting(wear_coefficient_sigma=0.4), GREASED)
    assert prior.sigma == 0.4
    assert prior.basis == "forecast.wear_coefficient_sigma"
    assert prior.holds_for == "steel-on-steel-greased-mild (greased, mild)"


@pytest.mark.parametrize("name", ["four_bar", "bionic_leg"])
def test_a_coefficient_without_a_pair_s_spread_has_the_usual_one(name):
    """A bare coefficient, and one beside a pair: the spread of the pair's is not that of another."""
    settings = next(iter(lw.load_mechanism(name).clearances.values()))
    beside = attrs.evolve(settings, wear_coefficient=(2e-15, 2e-15))
    assert usual_prior(NO_SETTING, beside).sigma == USUAL_SPREAD
    assert usual_prior(NO_SETTING, beside).basis == "usual scatter of wear coefficients"


@pytest.mark.parametrize(
    ("bushing", "journal", "both"),
    [(0.4, 0.8, 0.5), (1.0, 1.0, 1.0), (0.3, None, 0.75 * 0.3 + 0.25 * 0.7), (None, None, None)],
)
def test_spreads_of_both_bodies_count_by_their_part_of_the_wear(tmp_path, bushing, journal, both):
    found = spread_of(own_pair(tmp_path, bushing=bushing, journal=journal).clearances["A"], USUAL_SPREAD)
    assert found == (None if both is None else pytest.approx(both))


def test_a_spread_that_is_one_of_repeats_is_doubted(tmp_path):
    (doubt,) = doubts(own_pair(tmp_path, bushing=0.2, journal=0.2))
    assert "spread 0.2 of" in str(doubt)
    assert "of repeats instead of parts?" in str(doubt)
    assert doubts(own_pair(tmp_path, bushing=0.3, journal=0.4)) == ()
