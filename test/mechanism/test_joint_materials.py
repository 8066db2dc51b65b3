"""A joint names its material pair in the mechanism file."""

import copy
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import attrs
import command_line
import pytest
from mechanism_of import document_of, mechanism_of, write_mechanism

import leg_wear_monitor as lw

DOCUMENT = document_of("bionic_leg")


def changed(defaults: dict[str, Any] | None = None, **joints: dict[str, Any]) -> Any:
    """Document of the default leg with other settings of its clearances."""
    document = copy.deepcopy(DOCUMENT)
    document["clearances"]["defaults"] |= defaults or {}
    if joints:
        document["clearances"]["joints"] = joints
    return document


def leg(defaults: dict[str, Any] | None = None, **joints: dict[str, Any]) -> lw.Mechanism:
    return mechanism_of(changed(defaults, **joints))


def checked(**joints: dict[str, Any]) -> command_line.Done:
    """What `check` says of a leg."""
    with TemporaryDirectory() as home:
        path = Path(home) / "leg.yaml"
        write_mechanism(changed(**joints), path)
        return command_line.run("check", path)


def doubts(**joints: dict[str, Any]) -> list[str]:
    return checked(**joints).lines


def test_the_default_leg_names_a_regime_that_gives_the_bare_numbers() -> None:
    named = lw.load_mechanism()
    assert "wear_coefficient" not in DOCUMENT["clearances"]["defaults"]
    bare = copy.deepcopy(DOCUMENT)
    del bare["clearances"]["defaults"]["material"]
    bare["clearances"]["defaults"]["wear_coefficient"] = 1.0e-15
    other = attrs.evolve(mechanism_of(bare), source=named.source)
    for joint, settings in named.clearances.items():
        assert settings.material == "steel-on-steel-greased-mild"
        assert attrs.evolve(settings, material="") == other.clearances[joint]
    assert repr(named) == repr(other)


def test_the_pair_of_a_joint_gives_what_it_knows() -> None:
    pair = lw.load_material("pom-on-pa66")
    settings = leg(A={}, G={"material": "pom-on-pa66"}).clearances
    assert settings["G"].wear_coefficient == pair.wear_coefficients
    assert settings["G"].friction.coefficient == 0.24
    assert settings["G"].friction.ramp == settings["A"].friction.ramp
    assert settings["A"].wear_coefficient == (1.0e-15, 1.0e-15)


def test_both_moduli_of_a_pair_take_the_place_of_the_defaults() -> None:
    defaults = {"youngs_modulus": 1.0e9, "poissons_ratio": 0.4}
    own = leg(defaults, A={}, G={"material": "steel-on-steel-greased-mild"}).clearances
    assert own["A"].youngs_modulus == (1.0e9, 1.0e9)
    assert own["G"].youngs_modulus == (2.07e11, 2.07e11)
    assert own["G"].poissons_ratio == (0.29, 0.29)


def test_a_value_beside_the_pair_comes_first() -> None:
    own = {"material": "pom-on-pa66", "wear_coefficient": 5.0e-15, "friction": {"coefficient": 0.3}}
    settings = leg(G=own).clearances["G"]
    assert settings.wear_coefficient == (5.0e-15, 5.0e-15)
    assert settings.friction.coefficient == 0.3


def test_a_pair_with_limits_only_needs_a_coefficient_and_takes_none_of_another() -> None:
    with pytest.raises(lw.ConfigError) as caught:
        leg(A={}, G={"material": "du-on-steel-dry"})
    line = str(caught.value)
    assert "\n" not in line
    assert "clearances.joints.G.wear_coefficient: is missing: du-on-steel-dry" in line
    defaults = {"material": "du-on-steel-dry", "wear_coefficient": 0}
    given = leg(defaults, A={}, G={"wear_coefficient": 1.0e-16})
    assert [given.clearances[joint].wear_coefficient[0] for joint in "AG"] == [0.0, 1.0e-16]


def test_a_pair_without_modulus_does_not_take_that_of_another() -> None:
    """The pair of the defaults is of other joints: what its own does not give stands beside it."""
    document = copy.deepcopy(DOCUMENT)
    for key in ("youngs_modulus", "poissons_ratio"):
        del document["clearances"]["defaults"][key]
    document["clearances"]["joints"] = {
        "A": {},
        "G": {"material": "dp4b-on-steel-dry", "wear_coefficient": 0},
    }
    with pytest.raises(lw.ConfigError, match=r"leg\.yaml: clearances\.joints\.G\.youngs_modulus: is missing"):
        mechanism_of(document)
    document["clearances"]["joints"]["G"] |= {
        "youngs_modulus": [3.0e9, 2.07e11],
        "poissons_ratio": [0.4, 0.29],
    }
    found = mechanism_of(document).clearances
    assert found["G"].youngs_modulus == (3.0e9, 2.07e11)
    assert found["A"].youngs_modulus == (2.07e11, 2.07e11)


def test_the_joints_by_what_their_wear_holds_for() -> None:
    beside = {"material": "du-on-steel-dry", "wear_coefficient": [1.0e-16, 0.0]}
    text = checked(A={}, B={}, I=beside).out
    for words in (
        "material of A, B: steel-on-steel-greased-mild (greased, mild), wear coefficient 1e-15 1/Pa",
        "material of I: a value beside du-on-steel-dry (dry), wear coefficient 1e-16 and 0 1/Pa",
    ):
        assert words in text
    bare = command_line.run("check", "four_bar").out
    assert "no material is named, so the regime is not known, wear coefficient 1e-15 1/Pa" in bare


def test_a_coefficient_beside_limits_is_enough() -> None:
    own = {"material": "du-on-steel-dry", "wear_coefficient": [1.0e-16, 0.0]}
    assert doubts(G=own) == []


@pytest.mark.parametrize(
    ("defaults", "joints", "words"),
    [
        ({"material": "steal"}, {}, "clearances.defaults.material: steal: no material of this name"),
        ({}, {"G": {"material": "du-on-stel"}}, "clearances.joints.G.material: du-on-stel: no material"),
        ({}, {"G": {"material": 7}}, "clearances.joints.G.material: 7 is not a text"),
        ({}, {"G": {"material": "./none.yaml"}}, "clearances.joints.G.material: none.yaml: cannot be read"),
    ],
)
def test_an_unknown_pair_is_one_line(defaults: Any, joints: Any, words: str) -> None:
    with pytest.raises(lw.ConfigError) as caught:
        leg(defaults, **joints)
    assert f"leg.yaml: {words}" in str(caught.value)
    assert "\n" not in str(caught.value)
