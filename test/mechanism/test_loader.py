"""A mechanism file becomes types, or one line that says why not."""

import copy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mechanism_of import MECHANISMS, NAMES, document_of, mechanism_of

import leg_wear_monitor as lw

SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
JUNK = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(SCALARS, inner, max_size=3),
    max_leaves=4,
)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all entries of a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path] * bool(path) + [deeper for key, item in items for deeper in places(item, (*path, key))]


def changed(document: Any, path: tuple[Any, ...], value: Any) -> Any:
    document = copy.deepcopy(document)
    entry = document
    for key in path[:-1]:
        entry = entry[key]
    entry[path[-1]] = value
    return document


ORIGINALS = {name: document_of(name) for name in ("slider_crank", "andrews", "bionic_leg")}


@given(data=st.data())
def test_whatever_stands_in_a_file_is_taken_or_told_in_one_line(data):
    original = ORIGINALS[data.draw(st.sampled_from(sorted(ORIGINALS)))]
    broken = changed(original, data.draw(st.sampled_from(places(original))), data.draw(JUNK))
    try:
        assert isinstance(mechanism_of(broken), lw.Mechanism)
    except lw.ConfigError as error:
        assert "leg.yaml: " in str(error)
        assert "\n" not in str(error)


@given(junk=JUNK)
def test_whatever_a_file_holds_instead_is_told_in_one_line(junk):
    with pytest.raises(lw.ConfigError, match=r"leg\.yaml: [^\n]+$"):
        mechanism_of(junk)


LOADED = changed(
    document_of("four_bar"), ("loads",), {"tip": {"body": "coupler", "point": "toe", "force": [0, 1]}}
)
LOADED["springs"] = {
    "back": {"bodies": ["ground", "rocker"], "points": ["A", "C"], "stiffness": 1.0, "free_length": 0}
}
LOADED["clearances"]["joints"] = {"B": {"restitution": 0.8}}
KEYS = ("", "ground", "bodies.rocker", "joints.A", "drive", "loads.tip", "springs.back", "clearances")
KEYS += ("clearances.defaults", "clearances.defaults.friction", "clearances.joints.B")


@pytest.mark.parametrize("path", KEYS)
def test_a_key_that_is_not_known_is_never_passed_over(path):
    """Whatever its value is."""
    assert isinstance(mechanism_of(LOADED), lw.Mechanism)
    place = (*filter(None, path.split(".")), "colour")
    for value in (None, 1.0, "red", [], {"red": 1}):
        with pytest.raises(lw.ConfigError) as caught:
            mechanism_of(changed(LOADED, place, value))
        assert caught.value.key == ".".join(place)
        assert caught.value.fault.startswith("unknown key")


def test_all_that_come_with_the_package_load():
    assert NAMES == ["andrews", "bionic_leg", "four_bar", "jansen_leg", "klann_leg", "slider_crank"]
    assert [lw.load_mechanism(name).name for name in NAMES] == NAMES


def test_the_default_leg_is_the_bionic_one():
    leg = lw.load_mechanism()
    assert leg.source == "bionic_leg.yaml"
    assert leg.clearance_joints == ("A", "B", "G", "I", "J")
    assert leg.sides("B") == ("thigh", "ground")
    assert leg.toe == ("foot", "toe")
    assert leg.clearances["A"].journal_radius == pytest.approx(0.0097, rel=1e-15)


def test_a_path_starts_at_the_current_directory_and_names_the_file_as_given(tmp_path, monkeypatch):
    (tmp_path / "legs").mkdir()
    (tmp_path / "legs" / "mine").write_text((MECHANISMS / "four_bar.yaml").read_text())
    monkeypatch.chdir(tmp_path)
    assert lw.load_mechanism("legs/mine").source == "legs/mine"
    assert lw.load_mechanism(Path("legs") / "mine").name == "four_bar"


def test_a_bare_name_is_not_looked_for_in_the_current_directory(tmp_path, monkeypatch):
    (tmp_path / "mine").write_text((MECHANISMS / "four_bar.yaml").read_text())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(lw.ConfigError, match=r"mine: no mechanism of this name. Expected .*bionic_leg"):
        lw.load_mechanism("mine")


def test_one_number_stands_for_bushing_and_journal():
    leg = mechanism_of(
        changed(document_of("bionic_leg"), ("clearances", "defaults", "youngs_modulus"), 7.0e10)
    )
    assert leg.clearances["A"].youngs_modulus == (7.0e10, 7.0e10)


def test_a_joint_s_own_settings_go_over_the_defaults_friction_key_by_key():
    own = {"G": {"restitution": 0.8, "friction": {"coefficient": 0.2}}, "H": None}
    leg = mechanism_of(changed(document_of("bionic_leg"), ("clearances", "joints"), own))
    assert leg.clearance_joints == ("G", "H")
    assert leg.clearances["G"].restitution == 0.8
    assert leg.clearances["G"].friction.coefficient == 0.2
    assert leg.clearances["H"] == leg.clearances["A"]


def test_complete_defaults_serve_all_revolute_joints_and_only_those():
    crank = lw.load_mechanism("slider_crank")
    assert crank.clearance_joints == ("B",)
    assert list(crank.clearances) == ["O", "A", "B"]
    assert (crank.clearances["A"].stiffness, crank.clearances["B"].stiffness) == (None, 6.6102e10)


def test_without_complete_defaults_only_the_named_joints_have_settings():
    file = document_of("four_bar")
    width = file["clearances"]["defaults"].pop("width")
    file["clearances"]["joints"] = {"B": {"width": width}}
    assert list(mechanism_of(file).clearances) == ["B"]


def test_a_fault_is_named_where_it_stands():
    file = document_of("four_bar")
    file["clearances"]["joints"] = {"B": {"restitution": 2.0}}
    with pytest.raises(lw.ConfigError) as own:
        mechanism_of(file)
    assert own.value.key == "clearances.joints.B.restitution"
    file["clearances"] = {
        "defaults": file["clearances"]["defaults"] | {"restitution": 2.0},
        "joints": {"B": {}},
    }
    with pytest.raises(lw.ConfigError) as shared:
        mechanism_of(file)
    assert shared.value.key == "clearances.defaults.restitution"


def test_a_load_is_constant_or_a_table_over_the_phase():
    file = document_of("bionic_leg")
    file["loads"] = {
        "weight": {"body": "foot", "point": "toe", "force": [0, 100]},
        "step": {"body": "foot", "point": "toe", "phase": [0.0, 0.5], "force": [[0, 0], [0, 300]]},
    }
    loads = mechanism_of(file).loads
    assert loads["weight"].force == ((0.0, 100.0),)
    assert (loads["step"].phase, loads["step"].force) == ((0.0, 0.5), ((0.0, 0.0), (0.0, 300.0)))


def test_a_drive_is_a_speed_or_a_torque():
    assert lw.load_mechanism("andrews").drive.torque == 0.033
    assert lw.load_mechanism("bionic_leg").drive.speed == pytest.approx(6.283185307179586)


def test_a_joint_is_called_by_its_name_and_its_label():
    leg = lw.load_mechanism("bionic_leg")
    assert [leg.joint_words(joint) for joint in "GDIJ"] == ["G (knee)", "D", "I (ankle)", "J (heel)"]
    other = mechanism_of(changed(document_of("bionic_leg"), ("joints", "D", "label"), "Knie-Gelenk 2"))
    assert other.joint_words("D") == "D (Knie-Gelenk 2)"


@pytest.mark.parametrize(
    ("label", "fault"),
    [
        (None, "is empty. Expected a name such as knee, or no label"),
        ("", "is empty. Expected a name such as knee, or no label"),
        (7, "7 is not a text on one line"),
        ("a\nb", r"'a\nb' is not a text on one line"),
        (31 * "x", "has 31 characters. Expected at most 30"),
        *(
            (label, f"{label!r} is not a plain name. Expected letters, digits, spaces between and ',-./+")
            for label in ("<b>knee</b>", "&amp;", "[red]knee", "{{ 7 }}", " knee", "`rm`", "=1")
        ),
    ],
)
def test_a_label_that_is_no_plain_name_is_refused_in_one_line(label, fault):
    with pytest.raises(lw.ConfigError) as caught:
        mechanism_of(changed(document_of("bionic_leg"), ("joints", "G", "label"), label))
    assert str(caught.value).endswith(f"leg.yaml: joints.G.label: {fault}")
