"""p, v and p v of a joint against the limits of its material."""

import attrs
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.materials.of_joints import outside_limits

pytestmark = pytest.mark.plain

SETTINGS = attrs.evolve(lw.load_mechanism().clearances["G"], material="du-on-steel-dry")


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
    assert outside_limits(SETTINGS, *load) == wanted


def test_without_limits_nothing_is_outside() -> None:
    for material in ("", "steel-on-steel-greased-mild"):
        assert outside_limits(attrs.evolve(SETTINGS, material=material), 1e12, 1e6, 1e15) is None


def test_one_that_gives_a_static_limit_only_is_held_to_it() -> None:
    settings = attrs.evolve(SETTINGS, material="iglidur-b-on-steel")
    assert "p 4.1e+07 Pa above 4e+07" in (outside_limits(settings, 41.0e6, 0.0, 0.0) or "")
