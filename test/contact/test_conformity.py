"""Contact beyond Hertz: how wide its arc is, and what is said of it."""

import math
import warnings

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.contact.conformity import (
    NARROW_RAD,
    WIDEST_RAD,
    conformity_doubts,
    contact_doubt,
    half_angle_of,
)
from leg_wear_monitor.mechanism.position import build_linkage, one_cycle

LEG = lw.load_mechanism("bionic_leg")
STEEL = LEG.clearances["A"]


def soft(clearance_m: float, **more: object) -> lw.Mechanism:
    """The default leg with bushings of plastic: 2.4 GPa."""
    own = {
        joint: attrs.evolve(
            each, youngs_modulus=(2.4e9, 2.07e11), poissons_ratio=(0.35, 0.29),
            radial_clearance=clearance_m, **more,
        )
        for joint, each in LEG.clearances.items()
    }  # fmt: skip
    return attrs.evolve(LEG, clearances=own)


def test_the_arc_widens_with_force_and_softness_and_as_the_clearance_falls():
    angles = [half_angle_of(STEEL, force) for force in (0.0, 1.0, 1e3, 1e9, 1e30)]
    assert angles == sorted(angles)
    assert angles[0] == pytest.approx(0.0, abs=1e-7)  # 2 psi = sin 2 psi to rounding
    assert angles[-1] <= 0.5 * math.pi
    tight = attrs.evolve(STEEL, radial_clearance=1e-5)
    assert half_angle_of(tight, 500.0) > half_angle_of(STEEL, 500.0)
    bushing = soft(3e-4).clearances["A"]
    assert half_angle_of(bushing, 500.0) > 5.0 * half_angle_of(STEEL, 500.0)


def test_what_is_said_of_a_wide_arc_has_its_numbers_and_the_law_that_holds():
    text = contact_doubt(math.radians(41.0), 800.0, 0.01, is_winkler=False) or ""
    assert text.startswith("contact half angle 41 deg at 800 N (13.1 mm wide in a radius of 10 mm), ")
    assert "up to about 30 deg; normal_law winkler is for a conformal one" in text
    assert contact_doubt(NARROW_RAD, 800.0, 0.01, is_winkler=False) is None
    assert contact_doubt(math.radians(41.0), 800.0, 0.01, is_winkler=True) is None
    wide = contact_doubt(WIDEST_RAD + 0.01, 800.0, 0.01, is_winkler=True) or ""
    assert wide.endswith("normal_law winkler holds up to 60 deg")


def test_shipped_mechanisms_have_narrow_contacts():
    for name in ("bionic_leg", "jansen_leg", "klann_leg", "four_bar"):
        assert list(conformity_doubts(build_linkage(lw.load_mechanism(name)))) == []


def test_tight_bushings_of_plastic_are_doubted_joint_by_joint():
    """2.4 GPa with 5 um of clearance: the joints that carry most, with the law that holds."""
    leg = soft(5e-6)
    linkage = build_linkage(leg)
    force = np.linalg.norm(one_cycle(linkage, 180, leg.drive.speed).joint_force, axis=2)
    p99 = dict(zip(leg.joints, np.quantile(force, 0.99, axis=0), strict=True))
    wide = [
        joint
        for joint in leg.clearance_joints
        if half_angle_of(leg.clearances[joint], p99[joint]) > NARROW_RAD
    ]
    found = [str(doubt) for doubt in conformity_doubts(linkage)]
    assert 0 < len(wide) < 5
    assert [text.split(")")[0] for text in found] == [f"clearances ({joint}" for joint in wide]
    assert all("normal_law winkler is for a conformal one" in text for text in found)
    assert list(conformity_doubts(build_linkage(soft(3e-4)))) == []
    (widest,) = conformity_doubts(build_linkage(soft(5e-6, normal_law="winkler")))
    assert str(widest).startswith("clearances (A): normal_law: contact half angle 68 deg at 749 N")
    assert str(widest).endswith("normal_law winkler holds up to 60 deg")


def test_no_clearance_joint_is_no_doubt():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert list(conformity_doubts(build_linkage(attrs.evolve(LEG, clearance_joints=())))) == []
