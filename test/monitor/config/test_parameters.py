"""Parameters: what is wrong with a value is one line; flat, nested and typed forms say the same."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameters import (
    PARAMETERS,
    changed,
    config_from,
    parse_config,
    sections_for_others,
    values_of,
)
from leg_wear_monitor.monitor.config.settings import MonitorConfig

WRONG = [
    ("limits.clearance_m", -1.0, ["-1.0", "above 0 m", "at most 0.1"]),
    ("limits.clearance_m", 1, ["1 is an integer", "Expected 1.0 [m]"]),
    ("limits.clearance_m", "wide", ["'wide'", "not a number [m]", "at most 0.1"]),
    ("limits.clearance_m", None, ["nothing", "not a number [m]"]),
    ("limits.clearance_m", True, ["True", "not a number [m]"]),
    ("limits.clearance_m", float("nan"), ["nan", "not a finite number [m]"]),
    ("limits.clearanc_m", 1.0e-3, ["unknown parameter", "did you mean limits.clearance_m?"]),
    ("limits", 1.0e-3, ["unknown parameter"]),
    ("clearances_m", [3.0e-4, 5.0], ["5.0", "at most 0.1 m"]),
    ("clearances_m", 3.0e-4, ["0.0003", "not a list of numbers [m]"]),
    ("clearance_joints", ["A", 3], ["3", "not a text"]),
    ("cadence.commanded_rpm", 0.0, ["0.0 rpm", "does not turn the crank"]),
    ("crank.sign", 2, ["2", "not one of 1, -1"]),
    ("crank.sign", 1.0, ["1.0", "not a whole number"]),
    ("alarms.on_delay_cycles", 0, ["0", "at least 1", "at most 1000"]),
    ("drive_torque.axis", "w", ["'w'", "not one of x, y, z"]),
    ("drive_torque.source", "odometry", ["'odometry'", "wrench, float64, effort, interface"]),
    ("cadence.commanded_rpm", 5e-324, ["Expected a speed of at least 0.1 rpm either way"]),
    ("limits.impact_force_n", 5e-324, ["too close to 0. Expected more than 1e-30 N"]),
    ("wear_acceleration", 1e-12, ["not at least 1e-09"]),
    ("limits.growth_m_per_hour", 1e300, ["too large. Expected at most"]),
    ("publish_markers", "on", ["'on'", "not true or false"]),
    ("hardware_id", "a\nb", ["text on one line"]),
]


@pytest.mark.parametrize(("name", "value", "said"), WRONG)
def test_a_value_that_cannot_be_is_one_line(name, value, said):
    with pytest.raises(ConfigError) as caught:
        config_from({name: value}, "leg.yaml")
    line = str(caught.value)
    assert line.startswith(f"leg.yaml: {name}: ")
    assert "\n" not in line
    for part in said:
        assert part in line


FILES = [
    ("limits: {clearance_m: 0.001}", ["is not a ROS parameter file"]),
    ("/**: {ros__parameters: 7}", ["/**.ros__parameters", "7", "mapping"]),
    ("/**: {ros__parameters: {}, limits: {}}", ["/**", "one key ros__parameters"]),
    ("/gait_publisher: {ros__parameters: {}}", ["no section for the node", "/gait_publisher"]),
    ("/**: {ros__parameters: {limits: {9: 1}}}", ["limits", "the key 9", "not a text"]),
    (
        f"/**: {{ros__parameters: {{limits.clearance_m: 1{400 * '0'}}}}}",
        ["limits.clearance_m", "is an integer for ROS. Expected 1000", "000.0 [m]"],
    ),
    (
        "/**: {ros__parameters: {limits: {clearance_m: 0.7}, limits.clearance_m: 0.6}}",
        ["clearance_m", "twice"],
    ),
    (
        "/**: {ros__parameters: {limits: {clearance: 0.7}}}",
        ["limits.clearance", "unknown parameter, did you mean limits.clearance_m?"],
    ),
]


@pytest.mark.parametrize(("text", "said"), FILES)
def test_a_file_that_cannot_be_is_one_line(text, said):
    with pytest.raises(ConfigError) as caught:
        parse_config(YAML(typ="safe", pure=True).load(text), "leg.yaml")
    line = str(caught.value)
    assert line.startswith("leg.yaml: ")
    assert "\n" not in line
    for part in said:
        assert part in line


def read(text, node="/leg_wear_monitor"):
    return parse_config(YAML(typ="safe", pure=True).load(text), "leg.yaml", node)


@pytest.mark.parametrize(
    ("pattern", "node", "taken"),
    [
        ("/**", "/left/leg_wear_monitor", True),
        ("leg_wear_monitor", "/leg_wear_monitor", True),
        ("/leg_wear_monitor", "/leg_wear_monitor", True),
        ("/leg_wear_monitor", "/left/leg_wear_monitor", False),
        ("/**/leg_wear_monitor", "/robot/left/leg_wear_monitor", True),
        ("/*/leg_wear_monitor", "/left/leg_wear_monitor", True),
        ("/*/leg_wear_monitor", "/robot/left/leg_wear_monitor", False),
        ("/left/leg_wear_monitor", "/left/leg_wear_monitor", True),
    ],
)
def test_sections_are_for_the_nodes_that_ros_means(pattern, node, taken):
    base = "/**: {ros__parameters: {hardware_id: any}}\n" if pattern != "/**" else ""
    config = read(f"{base}{pattern}: {{ros__parameters: {{hardware_id: mine}}}}", node)
    assert config.hardware_id == ("mine" if taken else "any")


def test_sections_that_are_nested_are_read_as_ros_reads_them():
    nested = "/left: {leg_wear_monitor: {ros__parameters: {hardware_id: mine}}}"
    assert read(nested, None).hardware_id == "mine"  # the only node of the file
    both = f"/**: {{ros__parameters: {{hardware_id: any}}}}\n{nested}"
    assert read(both, "/left/leg_wear_monitor").hardware_id == "mine"
    assert read(both, "/right/leg_wear_monitor").hardware_id == "any"
    with pytest.raises(ConfigError, match=r"leg\.yaml: /left/other: 5 is not a mapping with the one key"):
        read(f"{nested[:-1]}, other: 5}}", None)


@pytest.mark.parametrize(
    ("text", "others"),
    [
        ("/**: {ros__parameters: {}}", ()),
        ("monitor: {ros__parameters: {}}\n/left/leg_wear_monitor: {ros__parameters: {}}", ()),
        ("/left: {leg_wear_monitor: {ros__parameters: {}}}", ()),
        ("monitor: {ros__parameters: {ledger.path: wear.db}}", ("/monitor",)),
        ("/right: {leg_wear_monitor: {ros__parameters: {}}}\n/*: {ros__parameters: {}}",
         ("/right/leg_wear_monitor", "/*")),
    ],
)  # fmt: skip
def test_a_file_with_nothing_for_a_node_is_known_by_its_sections(tmp_path, text, others):
    (tmp_path / "monitor.yaml").write_text(text)
    assert sections_for_others(tmp_path / "monitor.yaml", "/left/leg_wear_monitor") == others


def test_nested_and_dotted_names_are_the_same_and_what_every_node_has_is_left_alone():
    nested = read("/**: {ros__parameters: {limits: {clearance_m: 0.001}, use_sim_time: true}}")
    dotted = read("/**: {ros__parameters: {limits.clearance_m: 0.001, qos_overrides: {/a: {depth: 3}}}}")
    assert nested == dotted == config_from({"limits.clearance_m": 0.001})


def test_defaults_are_within_their_own_bounds():
    assert config_from(values_of(MonitorConfig())) == MonitorConfig()


@given(st.sampled_from([p for p in PARAMETERS.values() if p.type == "double"]), st.data())
def test_what_is_within_the_bounds_is_taken_and_kept(parameter, data):
    least = parameter.above if parameter.at_least is None else parameter.at_least
    value = data.draw(
        st.floats(least, parameter.at_most, exclude_min=parameter.above is not None).filter(
            # a crank that stands, and what is as good as 0 where that cannot be, are refused
            lambda value: (
                abs(value)
                >= {"cadence.commanded_rpm": 0.1}.get(
                    parameter.name, 1.0e-30 if parameter.above == 0.0 else 0.0
                )
            )
        )
    )
    assert values_of(config_from({parameter.name: value}))[parameter.name] == value


def test_every_parameter_says_what_it_is():
    for parameter in PARAMETERS.values():
        assert parameter.description
        assert parameter.type not in ("double", "double_array") or parameter.bounds


def test_only_some_parameters_may_change_while_it_runs():
    config = changed(MonitorConfig(), {"limits.clearance_m": 0.002, "hardware_id": ""})
    assert config.limits.clearance_m == 0.002
    with pytest.raises(ConfigError, match="hardware_id: 'other' cannot change now"):
        changed(config, {"hardware_id": "other"})
    with pytest.raises(ConfigError, match="clearance_m"):
        changed(config, {"limits.clearance_m": 7.0})


UNFIT = [
    ({"clearance_joints": ["A", "Q"]}, ["clearance_joints", "'Q'", "A, B, C"]),
    ({"clearance_joints": ["A", "A"]}, ["clearance_joints", "twice"]),
    ({"clearances_m": [3.0e-4, 3.0e-4]}, ["clearances_m", "2 values", "one each for A, B, G, I, J"]),
    ({"clearances_m": [0.02]}, ["clearances_m", "joint A", "0.02", "bushing_radius"]),
    ({"limits.joint_clearance_m": [6.0e-4]}, ["limits.joint_clearance_m", "1 values", "one each"]),
    ({"wear_coefficients_per_pa": [1e-15, 1e-15]}, ["wear_coefficients_per_pa", "2 values"]),
]


@pytest.mark.parametrize(("values", "said"), UNFIT)
def test_parameters_that_do_not_fit_the_leg_are_one_line(leg, values, said):
    with pytest.raises(ConfigError) as caught:
        fitted(leg, config_from(values), "leg.yaml")
    for part in ["leg.yaml: ", *said]:
        assert part in str(caught.value)


def test_a_leg_driven_by_a_torque_is_refused():
    with pytest.raises(ConfigError, match="driven by a torque"):
        fitted(load_mechanism("andrews"), MonitorConfig())


def test_a_person_hangs_on_the_leg_once(leg):
    carrying = fitted(leg, config_from({"load.person_kg": 80.0}))
    assert sum(body.mass for body in carrying.bodies.values()) == pytest.approx(
        sum(body.mass for body in leg.bodies.values()) + 0.161 * 80.0
    )


def test_a_person_needs_bodies_to_hang_on():
    with pytest.raises(ConfigError, match=r"four_bar.yaml: bodies: has no thigh.*load.person_kg"):
        fitted(load_mechanism("four_bar"), config_from({"load.person_kg": 80.0}))


def test_parameters_make_the_leg_what_they_say(leg):
    same = fitted(leg, MonitorConfig())
    assert (same.clearance_joints, same.clearances) == (leg.clearance_joints, leg.clearances)
    assert same.drive.speed == pytest.approx(leg.drive.speed, rel=1e-15)
    values = {
        "clearance_joints": ["G", "A"],
        "clearances_m": [1.0e-4, 2.0e-4],
        "wear_coefficients_per_pa": [4.0e-15],
        "cadence.commanded_rpm": -30.0,
    }
    other = fitted(leg, config_from(values))
    assert other.clearance_joints == ("G", "A")
    assert other.clearances["A"].radial_clearance == 2.0e-4
    assert other.clearances["G"].wear_coefficient == (4.0e-15, 4.0e-15)
    assert other.clearances["B"] == leg.clearances["B"]
    assert other.drive.speed == pytest.approx(-leg.drive.speed / 2.0)


def test_a_file_of_one_node_is_read_for_that_node_and_one_of_two_needs_to_know_which():
    left, right = ("/left/leg_wear_monitor", "/right/leg_wear_monitor")
    dump = {left: {"ros__parameters": {"hardware_id": "L"}}}
    assert parse_config(dump, "dump.yaml").hardware == "L"
    both = dump | {right: {"ros__parameters": {"hardware_id": "R"}}}
    assert parse_config(both, "both.yaml", right).hardware == "R"
    with pytest.raises(ConfigError, match="has no section for the node /leg_wear_monitor"):
        parse_config(both, "both.yaml")
    with pytest.raises(ConfigError, match="has no section for the node /leg_wear_monitor"):
        parse_config({"/camera": {"ros__parameters": {}}}, "camera.yaml")


@pytest.mark.parametrize("mark", ["ros_parameters", "ros__paramters", "ros__parameter"])
def test_a_misspelt_mark_of_the_parameters_is_named(mark):
    found = {"/**": {mark: {"limits": {"clearance_m": 5.0e-4}}}}
    whole = {"/**": {"ros__parameters": {"hardware_id": "x"}}}
    for document in (found, {"/left": {"leg_wear_monitor": found["/**"]}} | whole):
        with pytest.raises(ConfigError, match=rf"/(\*\*|left/leg_wear_monitor): {mark}: is not a key of ROS"):
            parse_config(document, "leg.yaml")


@pytest.mark.parametrize("model", ["ground", "measured"])
def test_a_load_needs_a_toe_to_push(model):
    with pytest.raises(
        ConfigError, match=rf"load.model: '{model}' needs a point called toe in slider_crank.yaml"
    ):
        fitted(load_mechanism("slider_crank"), config_from({"load.model": model}))
