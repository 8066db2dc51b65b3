"""Samples: the values given come out, and impossible ones are refused."""

import numpy as np
import pytest

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.sample import (
    FAULTS,
    GAIT_SAMPLE,
    gait_samples,
)


def test_a_block_holds_what_was_given_and_nan_elsewhere() -> None:
    block = gait_samples([1_700_000_000_000_000_001, 5], crank_angle_rad=[0.25, 3.0])
    assert block.dtype == GAIT_SAMPLE
    assert block["stamp_ns"].tolist() == [1_700_000_000_000_000_001, 5]
    assert block["crank_angle_rad"].tolist() == [0.25, 3.0]
    assert np.isnan(block["torque_nm"]).all() and np.isnan(block["crank_velocity_radps"]).all()
    assert gait_samples([1], TORQUE, torque_nm=2.0)["kind"][0] == TORQUE


def test_stamps_must_be_integers_for_a_float_cannot_hold_them() -> None:
    with pytest.raises(LegWearError, match="float64 is not an integer type"):
        gait_samples([1.7e18])


@pytest.mark.parametrize("name, code", [("kind", 3), ("fault", max(FAULTS) + 1)])
def test_unknown_codes_are_refused(name: str, code: int) -> None:
    with pytest.raises(LegWearError, match=f"{name}: {code} is none of"):
        gait_samples([1], **{name: code})
