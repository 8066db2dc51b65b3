"""What masses within tolerance make of growth: bounds that hold for any leg, and a case with one body."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.mechanism.person import PERSON_TOLERANCE, with_ground_reaction, with_person
from leg_wear_monitor.monitor.forecast.growth import ModelError, model_error
from leg_wear_monitor.twin.reference import MASS_TOLERANCE


def scaled(mechanism, factors):
    """Mechanism with other masses and inertias."""
    bodies = {
        name: attrs.evolve(body, mass=factors[name] * body.mass, inertia=factors[name] * body.inertia)
        for name, body in mechanism.bodies.items()
    }
    return attrs.evolve(mechanism, bodies=bodies)


@pytest.mark.parametrize("name", ["bionic_leg", "jansen_leg", "klann_leg", "four_bar", "slider_crank"])
def test_all_masses_together_make_all_of_the_force(name):
    """Sensitivities to n masses add up to one: their root sum of squares is at least 1 over root n."""
    mechanism = load_mechanism(name)
    found = model_error(mechanism, mechanism.drive.speed)
    assert (found.sensitivity >= 0.99 / np.sqrt(len(mechanism.bodies))).all()


def test_where_one_body_makes_all_of_the_force_growth_is_as_uncertain_as_its_mass():
    light = scaled(load_mechanism("four_bar"), {"crank": 1e-9, "coupler": 1.0, "rocker": 1e-9})
    found = model_error(light, 20.0)
    for k, growth_m in enumerate(found.ideal_m):
        assert found.relative(k, growth_m) == pytest.approx(MASS_TOLERANCE, rel=1e-6)


def test_lighter_bodies_wear_less_and_are_as_uncertain():
    leg = load_mechanism("bionic_leg")
    whole, lighter = model_error(leg, 6.0), model_error(scaled(leg, dict.fromkeys(leg.bodies, 0.4)), 6.0)
    assert lighter.ideal_m == pytest.approx(0.4 * whole.ideal_m, rel=1e-6)
    assert lighter.sensitivity == pytest.approx(whole.sensitivity, rel=1e-6)


def test_where_a_person_makes_all_of_the_force_growth_is_as_uncertain_as_the_person() -> None:
    leg = load_mechanism("bionic_leg")
    light = with_person(scaled(leg, dict.fromkeys(leg.bodies, 1.0e-6)), 80.0)
    found = model_error(light, 6.0)
    for k, growth_m in enumerate(found.ideal_m):
        # and by the three segments, each of which is known as bodies are
        assert PERSON_TOLERANCE < found.relative(k, growth_m) < 1.1 * PERSON_TOLERANCE


def test_what_impacts_make_is_less_sure():
    model = ModelError(np.array([1.0e-11]), np.array([0.6]), np.zeros(1))
    even, more, all_of_it = (model.relative(0, growth_m) for growth_m in (1.0e-11, 2.0e-11, 1.0e-6))
    assert even == pytest.approx(0.6 * MASS_TOLERANCE)
    assert even < more < all_of_it < 3.0 * even


def test_no_growth_has_no_error_by_impacts():
    model = ModelError(np.array([1.0e-11]), np.array([0.6]), np.zeros(1))
    assert model.relative(0, 0.0) == 0.6 * MASS_TOLERANCE


@pytest.mark.parametrize(("peak_n", "simulated"), [(300.0, (2.6, 6.0, 4.2)), (600.0, (4.6, 7.9, 6.1))])
def test_a_load_whose_size_is_not_sure_widens_growth_by_its_sensitivity(peak_n, simulated) -> None:
    """Of A, B and G, ideal motion makes most: 10 % of load are so many % of simulated growth (appendix)."""
    leg = with_ground_reaction(load_mechanism("bionic_leg"), peak_n)
    known, unsure = (model_error(leg, leg.drive.speed, load_sigma=sigma) for sigma in (0.0, 0.1))
    assert not known.load.any()
    for k, percent in enumerate(simulated):
        growth_m = known.ideal_m[k]
        assert unsure.by_load(k, growth_m) == pytest.approx(0.01 * percent, rel=0.4)
        alone, both = (one.relative(k, growth_m) for one in (known, unsure))
        assert both**2 == pytest.approx(alone**2 + unsure.by_load(k, growth_m) ** 2)
        assert unsure.by_load(k, 3.0 * growth_m) < unsure.by_load(k, growth_m)  # what impacts make


def test_of_a_leg_in_the_air_no_load_is_unsure() -> None:
    found = model_error(load_mechanism("bionic_leg"), 6.0)
    assert not found.load.any()


def test_what_a_heavy_joint_grows_by_is_that_of_its_ideal_motion():
    """A of the leg hardly knocks: the simulated growth is that of Archard's law along the ideal motion."""
    leg = load_mechanism("bionic_leg")
    assert model_error(leg, leg.drive.speed).ideal_m[0] == pytest.approx(1.511e-11, rel=0.08)
