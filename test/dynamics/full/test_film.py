"""Films of oil or grease in full coordinates: energy, and bad settings.

Both limits of the viscosity, and that both formulations find the same, are in clearance/test_film.py.
"""

import attrs
import numpy as np
import pytest
from counted_run import counted

from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism
from leg_wear_monitor.mechanism.spec import Film

CYCLE = 60.0 / 5000.0  # s


@pytest.fixture(scope="module")
def slider_crank():
    return load_mechanism("slider_crank")


def oiled(mechanism, viscosity):
    film = Film(viscosity_pa_s=viscosity, roughness_m=1.6e-6)
    clearances = {name: attrs.evolve(c, film=film) for name, c in mechanism.clearances.items()}
    return attrs.evolve(mechanism, clearances=clearances)


def energy_of(mechanism, **options):
    """Energy balance of a cycle from the start."""
    return counted(FullRun(prepare(mechanism, **options)), 0.0, CYCLE)[1]


@pytest.mark.parametrize("viscosity", [0.001, 0.1, 4.0])
def test_energy_adds_up(slider_crank, viscosity):
    energy = energy_of(oiled(slider_crank, viscosity))
    assert energy.contact_loss > 0.0
    assert abs(energy.residual) < 1.0e-4 * energy.contact_loss


def test_energy_adds_up_on_walls_that_wear(slider_crank):
    """At 1e4 times the pace of real wear."""
    own = {n: attrs.evolve(c, wear_coefficient=(1e-11, 1e-11)) for n, c in slider_crank.clearances.items()}
    energy = energy_of(oiled(attrs.evolve(slider_crank, clearances=own), 0.01), wear=True)
    assert energy.wear_loss > 0.0
    assert abs(energy.residual) < 1.0e-3 * energy.contact_loss


@pytest.mark.plain
@pytest.mark.parametrize(
    "change, said",
    [
        ({"film": {"viscosity_pa_s": 0.1, "roughness_m": 5e-4}}, "radial_clearance: 0.0005 is not above the"),
        ({"film": {"viscosity_pa_s": 0.1, "roughness_m": 1e-6}, "width": 0.03}, "width: 0.03 m with a film"),
        ({"film": {"viscosity_pa_s": 0.0, "roughness_m": 1e-6}}, r"film\.viscosity_pa_s: 0.0 is not above 0"),
        ({"film": {"viscosity_pa_s": 0.1}}, "film"),
    ],
)
def test_a_file_s_film_is_checked(document, change, said):
    plain = document("slider_crank")
    plain["clearances"]["joints"]["B"].update(change)
    with pytest.raises(ConfigError, match=said):
        parse_mechanism(plain, "mine.yaml")


@pytest.mark.plain
def test_a_file_s_film_is_read(document):
    plain = document("slider_crank")
    plain["clearances"]["joints"]["B"]["film"] = {"viscosity_pa_s": 0.1, "roughness_m": 1e-6}
    assert np.array_equal(prepare(parse_mechanism(plain, "mine.yaml")).films, [[0.1, 1.0e-6]])
    assert not prepare(load_mechanism("slider_crank")).films.any()
