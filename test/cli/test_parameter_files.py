"""``check`` on files of the monitor's parameters: what is in order, and one line for what is not."""

import pytest

BEGIN = "/**:\n  ros__parameters:\n    "

BROKEN = [
    ("limits: {clearance_m: -1.0}", ["limits.clearance_m", "-1.0", "not above 0 m", "at most 0.1"]),
    ("limits: {clearance_m: 0.03}", ["limits.clearance_m: 0.03 m", "0.01 m, the radius of its bushing"]),
    ("limits: {joint_clearance_m: [6.0e-4, 6.0e-4, 0.06, 6.0e-4, 6.0e-4]}", ["joint G", "the radius"]),
    ("clearance_joints: [A, Q]", ["clearance_joints", "'Q'", "bionic_leg.yaml", "A, B, C"]),
    ("mechanism: bionic_log", ["bionic_log", "no mechanism of this name"]),
    ("tracker: {reorder_window_s: 0.4, gap_limit_s: 0.3}", ["tracker.reorder_window_s", "0.4 s", "0.3 s"]),
    ("mechanism: [", ["not YAML", "line 3"]),
]


@pytest.mark.plain
@pytest.mark.parametrize(("text", "said"), BROKEN, ids=[text for text, _ in BROKEN])
def test_a_broken_parameter_file_is_one_line(refused, tmp_path, text, said):
    (tmp_path / "monitor.yaml").write_text(BEGIN + text)
    line = refused("check", "monitor.yaml")
    for part in ["error: ", *said]:
        assert part in line
    assert line.startswith("error: monitor.yaml: ") or "bionic_log" in line


@pytest.mark.plain
def test_a_parameter_file_in_order_is_reported_in_one_line(run, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        BEGIN + "{hardware_id: leg-7, clearance_joints: [G], cadence.commanded_rpm: -30.0}"
    )
    result = run("check", "mine.yaml")
    assert (result.exit_code, result.stderr) == (0, "")
    (line,) = result.stdout.splitlines()
    assert line.startswith("mine.yaml")
    for part in ("bionic_leg, clearance joints G", "-30 rpm", "leg-7"):
        assert part in line


@pytest.mark.plain
def test_the_sections_of_all_monitors_of_a_file_are_checked(run, refused, tmp_path):
    both = """
/**: {ros__parameters: {cadence.commanded_rpm: 30.0}}
/left/leg_wear_monitor: {ros__parameters: {crank_joint: left_crank}}
/right/leg_wear_monitor: {ros__parameters: {cadence.commanded_rpm: -30.0}}
/controller_manager: {ros__parameters: {update_rate: 100}}
"""
    (tmp_path / "both.yaml").write_text(both)
    result = run("check", "both.yaml")
    assert (result.exit_code, result.stderr) == (0, "")
    left, right = result.stdout.splitlines()
    assert "/left/leg_wear_monitor: " in left and left.endswith("30 rpm, hardware left")
    assert "/right/leg_wear_monitor: " in right and right.endswith("-30 rpm, hardware right")
    (tmp_path / "both.yaml").write_text(both.replace("crank_joint", "crank_joynt"))
    assert "both.yaml: crank_joynt: unknown parameter" in refused("check", "both.yaml")


def test_lives_that_end_before_the_limit_are_reported_by_check_and_at_the_start_of_a_replay(run, tmp_path):
    (tmp_path / "mine.yaml").write_text(BEGIN + "limits: {clearance_m: 0.0008}")
    for line in (("check", "mine.yaml"), ("replay", "none.mcap", "--config", "mine.yaml")):
        warning = run(*line).stderr.splitlines()[0]
        assert warning.startswith("warning: mine.yaml: forecast.life: the lives of this leg that come with")
