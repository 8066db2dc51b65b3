"""Options of `simulate` that replace values of the mechanism file."""

import pytest

import leg_wear_monitor as lw

SHORT = {"cycles": 0.25, "skip_cycles": 0.0}


@pytest.mark.parametrize("model", ["clearance", "full"])
def test_laws_and_toe_of_the_options_are_those_of_a_file(tmp_path, model: str) -> None:
    text = (lw.share_directory() / "config" / "mechanisms" / "four_bar.yaml").read_text()
    assert "restitution: 0.9" in text and "law: ambrosio" in text
    changed = text.replace("restitution: 0.9", "restitution: 0.7").replace("law: ambrosio", "law: threlfall")
    (tmp_path / "own.yaml").write_text(changed)
    of_file = lw.simulate(tmp_path / "own.yaml", model=model, **SHORT)
    given = lw.simulate("four_bar", model=model, restitution=0.7, friction="threlfall", **SHORT)
    assert given.joints == of_file.joints


def test_any_point_is_a_toe() -> None:
    """The toe of the leg is a point of its foot; a joint of the ground does not move."""
    short = {"clearances": [], "cycles": 1.0, "trace": 8}
    own, ankle = (lw.simulate("bionic_leg", toe=toe, **short).trace for toe in ("foot.toe", "foot.I"))
    same = lw.simulate("bionic_leg", **short).trace
    assert own is not None and ankle is not None and same is not None
    assert (own.toe_x_m == same.toe_x_m).all()
    assert (own.toe_x_m != ankle.toe_x_m).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"friction": "sticky"}, "friction: 'sticky' is not one of ambrosio"),
        ({"friction_coefficient": -1.0}, "friction-coefficient: -1.0 is not at least 0"),
        ({"friction_coefficient": "high"}, "friction-coefficient: 'high' is not a number"),
        ({"restitution": 2.0}, "restitution: 2.0 is not at most 1"),
        ({"toe": "foot.heel"}, "toe: 'foot.heel' is not a point of a body. Expected one of"),
        ({"clearances": [], "friction": "none"}, "friction: is for clearance joints"),
    ],
)
def test_a_wrong_option_is_refused_by_its_name(options, said: str) -> None:
    with pytest.raises(lw.ConfigError) as refused:
        lw.simulate("bionic_leg", **options)
    assert said in str(refused.value)


def test_a_percentile_is_not_above_the_largest_force() -> None:
    """Without contact the force of a joint is smooth, and its percentile is within a bin of its maximum."""
    for cycles in (0.01, 0.02, 0.05):
        result = lw.simulate("four_bar", cycles=cycles, skip_cycles=0.0)
        assert all(joint.p99_force_n <= joint.max_force_n for joint in result.joints.values())
        assert result.drive_torque_nm.p99 <= result.drive_torque_nm.max


def test_a_wear_zone_is_within_a_turn() -> None:
    zones = [joint.wear_zone_deg for joint in lw.simulate("bionic_leg", cycles=2).joints.values()]
    assert all(0.0 <= angle <= 360.0 for zone in zones if zone for angle in zone)


def test_the_text_of_a_result_is_one_line() -> None:
    result = lw.simulate("four_bar", clearances=[], cycles=1, trace=4)
    assert "\n" not in repr(result) and len(repr(result)) < 120
    assert repr(result.trace).startswith("<Trace: 4 samples")
