"""Samples: the values given come out, and impossible ones are refused."""

import numpy as np
import pytest

import leg_wear_monitor as lw

TORQUE = 1


def test_a_block_holds_what_was_given_and_nan_elsewhere() -> None:
    block = lw.gait_samples([1_700_000_000_000_000_001, 5], crank_angle_rad=[0.25, 3.0])
    assert block["stamp_ns"].tolist() == [1_700_000_000_000_000_001, 5]
    assert block["crank_angle_rad"].tolist() == [0.25, 3.0]
    assert np.isnan(block["torque_nm"]).all() and np.isnan(block["crank_velocity_radps"]).all()
    assert lw.gait_samples([1], TORQUE, torque_nm=2.0)["kind"][0] == TORQUE


def test_stamps_must_be_integers_for_a_float_cannot_hold_them() -> None:
    with pytest.raises(lw.LegWearError, match="float64 is not an integer type"):
        lw.gait_samples([1.7e18])


@pytest.mark.parametrize("name, code", [("kind", 3), ("fault", 9)])
def test_unknown_codes_are_refused(name: str, code: int) -> None:
    with pytest.raises(lw.LegWearError, match=f"{name}: {code} is none of"):
        lw.gait_samples([1], **{name: code})
