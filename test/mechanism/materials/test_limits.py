"""p, v and p v of a joint against the limits of its material."""

import attrs
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.materials import Bushing, BushingLoad

SETTINGS = attrs.evolve(lw.load_mechanism().clearances["G"], material="du-on-steel-dry")


def loaded(pressure: float, speed: float, product: float, material: str = "du-on-steel-dry") -> BushingLoad:
    bushing = Bushing.of(attrs.evolve(SETTINGS, material=material))
    return bushing.loaded(0.1 * pressure, pressure, speed, product)


@pytest.mark.parametrize(
    ("load", "beyond"),
    [
        ((139.0e6, 2.4, 1.7e6), None),
        ((141.0e6, 2.4, 1.7e6), "p 1.41e+08 Pa above 1.4e+08"),
        ((139.0e6, 2.6, 1.7e6), "v 2.6 m/s above 2.5"),
        ((139.0e6, 2.4, 1.9e6), "p v 1.9e+06 Pa m/s above 1.8e+06"),
        ((141.0e6, 2.6, 1.7e6), "p 1.41e+08 Pa above 1.4e+08, v 2.6 m/s above 2.5"),
    ],
)
def test_what_is_beyond_the_limits_is_one_line(load: tuple[float, float, float], beyond: str | None) -> None:
    wanted = beyond and f"outside the limits of du-on-steel-dry: {beyond}"
    assert loaded(*load).outside_limits == wanted


def test_the_fraction_is_that_of_the_value_nearest_its_limit() -> None:
    assert loaded(70.0e6, 2.0, 1.5 * 1.8e6).fraction == pytest.approx(1.5)
    assert loaded(70.0e6, 2.0, 0.1e6).fraction == pytest.approx(0.8)


def test_without_limits_nothing_is_outside_and_there_is_no_fraction() -> None:
    for material in ("", "steel-on-steel-greased-mild"):
        load = loaded(1e12, 1e6, 1e15, material)
        assert (load.outside_limits, load.fraction, load.compared) == (None, None, {})


def test_one_that_gives_a_static_limit_only_is_held_to_it() -> None:
    load = loaded(41.0e6, 0.0, 0.0, "iglidur-b-on-steel")
    assert "p 4.1e+07 Pa above 4e+07" in (load.outside_limits or "")


def test_the_load_follows_from_forces_and_rubbing() -> None:
    """A diameter of 20 mm, 20 mm wide: 4e-4 m^2. 800 N in the mean that rub with 240 W slide by 0.3 m/s."""
    load = Bushing.of(SETTINGS).load(800.0, 2000.0, 240.0)
    assert load.mean_pressure_pa == pytest.approx(2.0e6)
    assert load.p99_pressure_pa == pytest.approx(5.0e6)
    assert load.mean_sliding_speed_mps == pytest.approx(0.3)
    assert load.mean_pressure_speed_pa_mps == pytest.approx(0.6e6)
    assert Bushing.of(SETTINGS).load(0.0, 0.0, 0.0).mean_sliding_speed_mps == 0.0
