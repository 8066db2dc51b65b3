"""Priors that a fleet has learned: their file, the part they belong to, and the forecast with them."""

import json
import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import ConfigError, load_mechanism
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.model_error import ModelError
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientPrior,
    estimate_coefficient,
    nominal_per_pa,
    prior_source,
    usual_prior,
)

pytestmark = pytest.mark.plain

LEG, FRESH = load_mechanism("bionic_leg"), 3.0e-4
CONFIGURED = Forecasting(wear_coefficient_sigma=0.7)
BASIS_CONFIGURED = "forecast.wear_coefficient_sigma"
NOMINAL = nominal_per_pa(LEG.clearances["A"])
BASIS = "19 parts of lot 2026-03"


def document(factor=2.0, sigma=0.3, **more):
    """A file with joint A only; its part was mounted at 5 ns."""
    present = {"wear_coefficient_per_pa": factor * NOMINAL, "sigma": sigma, "basis": BASIS}
    following = {"wear_coefficient_per_pa": NOMINAL, "sigma": 0.5, "basis": "19 parts of 1 other lot"}
    joints = {"A": {"replaced_ns": 5, "present": present, "next": following}}
    return {"schema_version": 1, "leg": "left-07", "joints": joints, **more}


@pytest.fixture
def learned(tmp_path):
    """Settings with a file of priors of this content."""

    def written(content):
        path = tmp_path / "left-07.json"
        path.write_text(json.dumps(content))
        return attrs.evolve(CONFIGURED, priors=str(path))

    return written


def test_without_a_file_every_joint_has_the_configured_prior():
    found = prior_source(LEG, CONFIGURED).prior("A", 0)
    assert found == usual_prior(CONFIGURED, LEG.clearances["A"])
    one, other = estimate_coefficient(CONFIGURED, FRESH), estimate_coefficient(CONFIGURED, FRESH, (), found)
    assert one.weight.tobytes() == other.weight.tobytes()
    assert one.log_factor.tobytes() == other.log_factor.tobytes()


def test_each_part_of_a_joint_has_its_own_prior(learned):
    source = prior_source(LEG, learned(document()))
    present, following, other = source.prior("A", 5), source.prior("A", 6), source.prior("B", 0)
    assert (present.mean, present.sigma, present.basis) == (pytest.approx(math.log(2.0)), 0.3, BASIS)
    assert (following.mean, following.sigma) == (pytest.approx(0.0), 0.5)
    assert other == usual_prior(CONFIGURED, LEG.clearances["B"])


def test_a_prior_follows_the_nominal_coefficient(learned):
    """The learned coefficient is absolute: with twice the nominal one, the factor is half as large."""
    doubled = attrs.evolve(LEG.clearances["A"], wear_coefficient=(NOMINAL, NOMINAL))
    leg = attrs.evolve(LEG, clearances=LEG.clearances | {"A": doubled})
    assert nominal_per_pa(doubled) == 2.0 * NOMINAL
    assert prior_source(leg, learned(document())).prior("A", 5).mean == pytest.approx(0.0)


@given(st.floats(-2.0, 2.0), st.floats(0.02, 3.0), st.floats(-1.0, 60.0), st.floats(0.1, 10.0))
def test_the_estimate_is_this_prior_times_the_likelihood(mean, sigma, factor, own):
    """Against a sum over a wide and fine grid."""
    exact = attrs.evolve(CONFIGURED, clearance_sigma_m=1e-9)
    observation = ClearanceAtWear(FRESH + factor * 1e-5, own * 1e-5, 1e-5)
    found = estimate_coefficient(exact, FRESH, [observation], CoefficientPrior(mean=mean, sigma=sigma))
    u = np.linspace(mean - 12.0 * sigma - 5.0, mean + 12.0 * sigma + 5.0, 200_001)
    density = -0.5 * ((u - mean) / sigma) ** 2 - 0.5 * ((np.exp(u) - factor) / own) ** 2
    weight = np.exp(density - density.max())
    weight /= weight.sum()
    assert found.mean == pytest.approx(weight @ u, abs=0.01 * found.sigma + 2e-4)
    assert found.sigma == pytest.approx(np.sqrt(weight @ (u - weight @ u) ** 2), rel=0.02)
    assert found.weight[[0, -1]].max() < 1e-6


def test_the_forecast_says_what_its_prior_rests_on(learned):
    forecaster = Forecaster(LEG, learned(document()), (), [5, 0, 0, 0, 0])
    first, *others = forecaster.state.coefficient_estimates
    assert (first.prior.basis, first.sigma) == (BASIS, pytest.approx(0.3, rel=1e-3))
    assert {(each.prior.basis, round(each.sigma, 3)) for each in others} == {(BASIS_CONFIGURED, 0.7)}
    forecaster.state.growth = tuple(
        attrs.evolve(each, growth_m=np.zeros(1), moving_s=np.ones(1)) for each in forecaster.state.growth
    )
    forecast = forecaster.renewed(np.zeros(5), [6e-4] * 5, True, ModelError(*np.zeros((3, 5))))
    assert [each.prior.basis for each in forecast.joints] == [BASIS, *[BASIS_CONFIGURED] * 4]
    forecaster.replaced("A", 9)
    assert forecaster.state.coefficient_estimates[0].prior.basis == "19 parts of 1 other lot"


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        ([], "is not a mapping"),
        (document(schema_version=2), "schema_version: 2 is not 1"),
        (document(sigma=0.0), "joints.A.present.sigma: 0.0 is not at least"),
        (document(factor=-1.0), "wear_coefficient_per_pa: .* is not above 0"),
        (document(more=1), "more: unknown key"),
    ],
)
def test_a_wrong_file_is_refused_by_name(learned, content, fault):
    settings = learned(content)
    with pytest.raises(ConfigError, match=f"left-07.json: .*{fault}"):
        prior_source(LEG, settings)


def test_a_missing_or_broken_file_is_refused(tmp_path):
    path = tmp_path / "none.json"
    with pytest.raises(ConfigError, match="cannot be read"):
        prior_source(LEG, attrs.evolve(CONFIGURED, priors=str(path)))
    path.write_text("{")
    with pytest.raises(ConfigError, match="is not JSON"):
        prior_source(LEG, attrs.evolve(CONFIGURED, priors=str(path)))
