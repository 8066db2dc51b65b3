"""Wear over a life: clearances open as the wear of a cycle says, by the steps that were asked for."""

import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.studies.life import live
from leg_wear_monitor.wear.surfaces import BUSHING

SETTINGS = {
    "loose": ["I", "J"], "clearance_m": 3.0e-4, "speed_rpm": 60.0, "perturb_share": 0.3, "seed": 1,
    "opens_m": 1.0e-5, "jumps": 2, "cycles": 1, "runs": 2,
}  # fmt: skip


@pytest.fixture(scope="module")
def lives():
    return live(load_mechanism(), SETTINGS)


def test_the_fastest_joint_opens_by_the_steps_that_were_asked_for(lives):
    opened = lives["clearance_mean_m"].max(axis=2) - 3.0e-4
    assert np.diff(opened, axis=1) == pytest.approx(np.full((2, 2), 5.0e-6), rel=1.0e-3)
    assert (lives["clearance_max_m"] >= lives["clearance_mean_m"]).all()
    assert (np.diff(lives["cycles"], axis=1) > 0.0).all()
    assert (lives["cycles"][:, 0] == 0.0).all()


def test_a_jump_repeats_the_wear_of_a_cycle(lives):
    """Halfway the surfaces are the first rate times the cycles of the first jump."""
    halfway = lives["depth_m"][:, 0]
    first = lives["rate_m_per_cycle"][:, 0] * np.diff(lives["cycles"], axis=1)[:, 0, None, None, None]
    assert halfway == pytest.approx(first, rel=1.0e-4, abs=1.0e-12)
    assert (lives["depth_m"][:, 1] >= halfway).all()
    assert lives["depth_m"][..., BUSHING, :].max() > 5.0e-6


def test_surfaces_that_have_worn_still_move(lives):
    assert np.isfinite(lives["peak_force_n"]).all()
    assert (lives["toe_position_m"] > 1.0e-4).all()
