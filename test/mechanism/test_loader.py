"""A mechanism file becomes types, or one line that says why not."""

import copy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import ConfigError, Mechanism, load_mechanism
from leg_wear_monitor.mechanism.loader import parse_mechanism, shipped_mechanisms
from leg_wear_monitor.mechanism.spec import (
    ConstantLoad,
    Friction,
    PhaseLoad,
    PrismaticJoint,
    TorqueDrive,
)

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


@pytest.fixture(scope="module")
def originals(document):
    """Documents that are read once, to be copied before a change."""
    return {name: document(name) for name in ("slider_crank", "andrews", "bionic_leg")}


@given(data=st.data())
def test_whatever_stands_in_a_file_is_taken_or_told_in_one_line(data, originals):
    original = originals[data.draw(st.sampled_from(sorted(originals)))]
    broken = changed(original, data.draw(st.sampled_from(places(original))), data.draw(JUNK))
    try:
        assert isinstance(parse_mechanism(broken, "leg.yaml"), Mechanism)
    except ConfigError as error:
        assert str(error).startswith("leg.yaml: ")
        assert "\n" not in str(error)


@given(junk=JUNK)
def test_whatever_a_file_holds_instead_is_told_in_one_line(junk):
    with pytest.raises(ConfigError, match=r"^leg\.yaml: [^\n]+$"):
        parse_mechanism(junk, "leg.yaml")


@given(data=st.data())
def test_a_key_that_is_not_known_is_never_passed_over(data, originals):
    original = originals["bionic_leg"]
    mappings = [("bodies", "foot"), ("joints", "A"), ("drive",), ("clearances",), ("clearances", "defaults")]
    path = data.draw(st.sampled_from([*mappings, ("clearances", "defaults", "friction")]))
    with pytest.raises(ConfigError) as caught:
        parse_mechanism(changed(original, (*path, "colour"), data.draw(JUNK)), "leg.yaml")
    assert caught.value.key == ".".join((*path, "colour"))
    assert caught.value.fault.startswith("unknown key")


def test_all_that_come_with_the_package_load():
    names = list(shipped_mechanisms())
    assert names == ["andrews", "bionic_leg", "four_bar", "jansen_leg", "klann_leg", "slider_crank"]
    assert [load_mechanism(name).name for name in names] == names


def test_the_default_leg_is_the_bionic_one():
    leg = load_mechanism()
    assert leg.source == "bionic_leg.yaml"
    assert leg.clearance_joints == ("A", "B", "G", "I", "J")
    assert leg.sides("B") == ("thigh", "ground")
    assert leg.toe == ("foot", "toe")
    assert leg.clearances["A"].journal_radius == pytest.approx(0.0097, rel=1e-15)


def test_a_path_starts_at_the_current_directory_and_names_the_file_as_given(tmp_path, monkeypatch):
    (tmp_path / "legs").mkdir()
    (tmp_path / "legs" / "mine").write_text(shipped_mechanisms()["four_bar"].read_text())
    monkeypatch.chdir(tmp_path)
    assert load_mechanism("legs/mine").source == "legs/mine"
    assert load_mechanism(Path("legs") / "mine").name == "four_bar"


def test_a_bare_name_is_not_looked_for_in_the_current_directory(tmp_path, monkeypatch):
    (tmp_path / "mine").write_text(shipped_mechanisms()["four_bar"].read_text())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=r"mine: no mechanism of this name. Expected .*bionic_leg"):
        load_mechanism("mine")


def test_one_number_stands_for_bushing_and_journal(document):
    leg = parse_mechanism(
        changed(document("bionic_leg"), ("clearances", "defaults", "youngs_modulus"), 7.0e10), "leg.yaml"
    )
    assert leg.clearances["A"].youngs_modulus == (7.0e10, 7.0e10)


def test_a_joint_s_own_settings_go_over_the_defaults_friction_key_by_key(document):
    own = {"G": {"restitution": 0.8, "friction": {"coefficient": 0.2}}, "H": None}
    leg = parse_mechanism(changed(document("bionic_leg"), ("clearances", "joints"), own), "leg.yaml")
    assert leg.clearance_joints == ("G", "H")
    assert leg.clearances["G"].restitution == 0.8
    assert leg.clearances["G"].friction == Friction(law="ambrosio", coefficient=0.2, ramp=(0.001, 0.01))
    assert leg.clearances["H"] == leg.clearances["A"]


def test_complete_defaults_serve_all_revolute_joints_and_only_those():
    crank = load_mechanism("slider_crank")
    assert crank.clearance_joints == ("B",)
    assert list(crank.clearances) == ["O", "A", "B"]
    assert (crank.clearances["A"].stiffness, crank.clearances["B"].stiffness) == (None, 6.6102e10)
    assert isinstance(crank.joints["S"], PrismaticJoint)


def test_without_complete_defaults_only_the_named_joints_have_settings(document):
    file = document("four_bar")
    width = file["clearances"]["defaults"].pop("width")
    file["clearances"]["joints"] = {"B": {"width": width}}
    assert list(parse_mechanism(file, "leg.yaml").clearances) == ["B"]


def test_a_fault_is_named_where_it_stands(document):
    file = document("four_bar")
    file["clearances"]["joints"] = {"B": {"restitution": 2.0}}
    with pytest.raises(ConfigError) as own:
        parse_mechanism(file, "leg.yaml")
    assert own.value.key == "clearances.joints.B.restitution"
    file["clearances"] = {
        "defaults": file["clearances"]["defaults"] | {"restitution": 2.0},
        "joints": {"B": {}},
    }
    with pytest.raises(ConfigError) as shared:
        parse_mechanism(file, "leg.yaml")
    assert shared.value.key == "clearances.defaults.restitution"


def test_a_load_is_constant_or_a_table_over_the_phase(document):
    file = document("bionic_leg")
    file["loads"] = {
        "weight": {"body": "foot", "point": "toe", "force": [0, 100]},
        "step": {"body": "foot", "point": "toe", "phase": [0.0, 0.5], "force": [[0, 0], [0, 300]]},
    }
    loads = parse_mechanism(file, "leg.yaml").loads
    assert loads["weight"] == ConstantLoad(body="foot", point="toe", force=(0.0, 100.0))
    assert loads["step"] == PhaseLoad(
        body="foot", point="toe", phase=(0.0, 0.5), force=((0.0, 0.0), (0.0, 300.0))
    )


def test_a_drive_is_a_speed_or_a_torque():
    assert load_mechanism("andrews").drive == TorqueDrive(body="k1", torque=0.033, initial_speed=0.0)


def test_a_joint_is_called_by_its_name_and_its_label(document):
    leg = load_mechanism("bionic_leg")
    assert [leg.joint_words(joint) for joint in "GDIJ"] == ["G (knee)", "D", "I (ankle)", "J (heel)"]
    other = parse_mechanism(changed(document("bionic_leg"), ("joints", "D", "label"), "Knie-Gelenk 2"), "x")
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
def test_a_label_that_is_no_plain_name_is_refused_in_one_line(document, label, fault):
    with pytest.raises(ConfigError) as caught:
        parse_mechanism(changed(document("bionic_leg"), ("joints", "G", "label"), label), "leg.yaml")
    assert str(caught.value) == f"leg.yaml: joints.G.label: {fault}"
