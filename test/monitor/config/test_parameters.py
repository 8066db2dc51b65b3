"""Parameters: what is wrong with a value is one line; flat, nested and typed forms say the same."""

from collections.abc import Callable
from pathlib import Path

import pytest
from config_of import config_of

import leg_wear_monitor as lw

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
    with pytest.raises(lw.ConfigError) as caught:
        config_of({name: value})
    line = str(caught.value)
    assert f"leg.yaml: {name}: " in line
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


@pytest.fixture
def read(tmp_path, monkeypatch) -> Callable[..., lw.MonitorConfig]:
    """Read a parameter file for a node."""
    monkeypatch.chdir(tmp_path)

    def of_node(text: str, node: str | None = "/leg_wear_monitor") -> lw.MonitorConfig:
        Path("leg.yaml").write_text(text)
        return lw.load_config("leg.yaml", node)

    return of_node


@pytest.mark.parametrize(("text", "said"), FILES)
def test_a_file_that_cannot_be_is_one_line(read, text, said):
    with pytest.raises(lw.ConfigError) as caught:
        read(text, None)
    line = str(caught.value)
    assert line.startswith("leg.yaml: ")
    assert "\n" not in line
    for part in said:
        assert part in line


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
def test_sections_are_for_the_nodes_that_ros_means(read, pattern, node, taken):
    base = "/**: {ros__parameters: {hardware_id: any}}\n" if pattern != "/**" else ""
    config = read(f"{base}{pattern}: {{ros__parameters: {{hardware_id: mine}}}}", node)
    assert config.hardware_id == ("mine" if taken else "any")


def test_sections_that_are_nested_are_read_as_ros_reads_them(read):
    nested = "/left: {leg_wear_monitor: {ros__parameters: {hardware_id: mine}}}"
    assert read(nested, None).hardware_id == "mine"  # the only node of the file
    both = f"/**: {{ros__parameters: {{hardware_id: any}}}}\n{nested}"
    assert read(both, "/left/leg_wear_monitor").hardware_id == "mine"
    assert read(both, "/right/leg_wear_monitor").hardware_id == "any"
    with pytest.raises(lw.ConfigError, match=r"leg\.yaml: /left/other: 5 is not a mapping with the one key"):
        read(f"{nested[:-1]}, other: 5}}", None)


def test_nested_and_dotted_names_are_the_same_and_what_every_node_has_is_left_alone(read):
    nested = read("/**: {ros__parameters: {limits: {clearance_m: 0.001}, use_sim_time: true}}")
    dotted = read("/**: {ros__parameters: {limits.clearance_m: 0.001, qos_overrides: {/a: {depth: 3}}}}")
    assert nested == dotted == config_of({"limits.clearance_m": 0.001})


UNFIT = [
    ({"clearance_joints": ["A", "Q"]}, ["clearance_joints", "'Q'", "A, B, C"]),
    ({"clearance_joints": ["A", "A"]}, ["clearance_joints", "twice"]),
    ({"clearances_m": [3.0e-4, 3.0e-4]}, ["clearances_m", "2 values", "one each for A, B, G, I, J"]),
    ({"clearances_m": [0.02]}, ["clearances_m", "joint A", "0.02", "bushing_radius"]),
    ({"limits.joint_clearance_m": [6.0e-4]}, ["limits.joint_clearance_m", "1 values", "one each"]),
    ({"wear_coefficients_per_pa": [1e-15, 1e-15]}, ["wear_coefficients_per_pa", "2 values"]),
    ({"encoders.names": ["hip"]}, ["encoders.joints: has 0 values for 1 encoders"]),
    ({"encoders.names": ["a", "a"], "encoders.joints": ["B", "G"]}, ["not different names"]),
    ({"encoders.names": list("abcde"), "encoders.joints": list("ABGIJ")}, ["at most 4"]),
    (
        {"encoders.names": ["a"], "encoders.joints": ["B"], "encoders.signs": [0.5]},
        ["not all 1.0 or -1.0"],
    ),
]


@pytest.mark.parametrize(("values", "said"), UNFIT)
def test_parameters_that_do_not_fit_the_leg_are_one_line(leg, values, said):
    with pytest.raises(lw.ConfigError) as caught:
        lw.WearMonitor(leg, config_of(values))
    for part in said:
        assert part in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("mechanism", "values", "said"),
    [
        ("andrews", {}, "driven by a torque"),
        ("four_bar", {"load.person_kg": 80.0}, r"four_bar.yaml: bodies: has no thigh.*load.person_kg"),
        *(
            (
                "slider_crank",
                {"load.model": model},
                f"'{model}' needs a point called toe in slider_crank.yaml",
            )
            for model in ("ground", "measured")
        ),
    ],
)
def test_a_leg_that_does_not_fit_the_parameters_is_refused(mechanism, values, said):
    with pytest.raises(lw.ConfigError, match=said):
        lw.WearMonitor(lw.load_mechanism(mechanism), config_of(values))


def test_parameters_make_the_leg_what_they_say(leg):
    values = {
        "clearance_joints": ["G", "A"],
        "clearances_m": [1.0e-4, 2.0e-4],
        "limits.joint_clearance_m": [5.0e-4, 7.0e-4],
    }
    monitor = lw.WearMonitor(leg, config_of(values))
    assert monitor.clearance_joints == ("G", "A")
    assert monitor.clearances_m == pytest.approx([1.0e-4, 2.0e-4])
    joints = monitor.state.clearances
    assert [joints[name].new_m for name in "GA"] == pytest.approx([1.0e-4, 2.0e-4])
    assert [joints[name].limit_m for name in "GA"] == pytest.approx([5.0e-4, 7.0e-4])


def test_a_file_of_one_node_is_read_for_that_node_and_one_of_two_needs_to_know_which(read):
    section = "/{0}/leg_wear_monitor: {{ros__parameters: {{hardware_id: {0}}}}}\n"
    both = section.format("left") + section.format("right")
    assert read(section.format("left"), None).hardware_id == "left"
    assert read(both, "/right/leg_wear_monitor").hardware_id == "right"
    for text in (both, "/camera: {ros__parameters: {}}"):
        with pytest.raises(lw.ConfigError, match=r"for: /|has no section for the node"):
            read(text, None)


@pytest.mark.parametrize("mark", ["ros_parameters", "ros__paramters", "ros__parameter"])
def test_a_misspelt_mark_of_the_parameters_is_named(read, mark):
    found = f"{{{mark}: {{limits: {{clearance_m: 5.0e-4}}}}}}"
    whole = "/**: {ros__parameters: {hardware_id: x}}\n"
    for text in (f"/**: {found}", f"{whole}/left: {{leg_wear_monitor: {found}}}"):
        with pytest.raises(
            lw.ConfigError, match=rf"/(\*\*|left/leg_wear_monitor): {mark}: is not a key of ROS"
        ):
            read(text)
