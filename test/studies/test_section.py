"""Poincaré sections: one point a cycle, at the crank angle that was asked for; periods are found."""

import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.studies.tasks import PORTRAIT_SAMPLES, poincare_section

SETTINGS = {
    "clearances": ["G"], "clearance_m": 3.0e-4, "perturb_fraction": 0.3, "seed": 1, "skip_cycles": 4,
    "runs": 1, "cycles": 6, "portrait_cycles": 1, "crank_angle_deg": 90.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def calm():
    """At 20 rpm the knee stays in contact, so that each cycle is like the last."""
    return poincare_section(load_mechanism(), SETTINGS | {"speed_rpm": 20.0})


def test_a_motion_that_repeats_itself_has_one_point(calm):
    section = calm["section_eccentricity_m"] / 3.0e-4
    assert section.shape == (6, 1, 2)
    assert np.abs(np.diff(section[:, 0], axis=0)).max() <= 1.0e-3
    portrait = calm["portrait_eccentricity_m"][:, 0] / 3.0e-4
    assert portrait.shape == (PORTRAIT_SAMPLES, 2)
    # the portrait begins at the section's angle
    assert portrait[0] == pytest.approx(section[0, 0], abs=1.0e-3)
    assert np.ptp(portrait, axis=0).max() > 0.1


def test_a_section_at_another_angle_is_another_one(calm):
    place = SETTINGS | {"speed_rpm": 20.0, "crank_angle_deg": 0.0}
    other = poincare_section(load_mechanism(), place)["section_eccentricity_m"]
    assert np.abs(calm["section_eccentricity_m"][-1] - other[-1]).max() > 1.0e-6


def test_a_bouncing_joint_has_no_period():
    arrays = poincare_section(
        load_mechanism(), SETTINGS | {"clearances": ["A", "B"], "speed_rpm": 60.0, "cycles": 12}
    )
    for k in range(2):
        for period in range(1, 5):
            rates = arrays["section_rate_mps"][:, k]
            assert np.abs(rates[period:] - rates[:-period]).max() > 1.0e-6
