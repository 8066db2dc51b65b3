"""The synthetic leg: it moves as the full-coordinate simulation does, and knows its own wear."""

import numpy as np
import pytest

from leg_wear_monitor import ConfigError, load_mechanism, simulate
from leg_wear_monitor.gait.config import GaitConfig, KnockConfig, LoadConfig, PaceConfig
from leg_wear_monitor.gait.leg import SyntheticLeg

STOP = PaceConfig(times_s=(0.0, 0.3), speeds_rpm=(60.0, 0.0), ramp_s=0.3)


@pytest.mark.chaotic
@pytest.mark.parametrize("faster, bound", [(1.0, 1.0e-3), (1.0e4, 0.02)])
def test_one_loose_joint_wears_as_in_the_simulation(faster: float, bound: float) -> None:
    """Through its first impacts, in a twentieth of a cycle: until then a last bit does not part the motions.

    Off by -9.4e-5, sigma 2e-8, and by -0.0076, sigma 6e-6, where ten thousand times the wear has opened the
    joint meanwhile; after two cycles the sigma is 0.03. From 30 starts moved by 1e-12, 2026-11-23.
    """
    leg = SyntheticLeg(GaitConfig(clearance_joints=("A",), wear_acceleration=faster))
    leg.advance(0.05)
    span = {"skip_cycles": 0, "cycles": 0.05}
    figures = simulate(load_mechanism("bionic_leg"), clearances=["A"], model="full", **span)
    assert figures.impacts["A"]
    depth = figures.joints["A"].wear_depth_m_per_cycle
    expected = 0.05 * faster * (depth.bushing_mean + depth.journal_mean)
    assert leg.clearance_m()[0] - 3.0e-4 == pytest.approx(expected, rel=bound)


def test_a_cycle_of_the_drive_pays_for_friction_and_impacts_only() -> None:
    """Once around, gravity and inertia give back what they took."""
    leg = SyntheticLeg(GaitConfig())
    first, last = leg.advance(1.0).torque_impulse, leg.advance(2.0).torque_impulse
    assert 0.0 < last - first < 2.0


def test_friction_of_the_drive_adds_to_its_torque() -> None:
    plain, braked = (
        SyntheticLeg(GaitConfig(load=LoadConfig(friction_nm=friction))).advance(0.5).torque_impulse
        for friction in (0.0, 3.0)
    )
    assert braked - plain == pytest.approx(1.5, rel=1e-9)


def test_a_push_of_the_ground_changes_the_torque() -> None:
    """By its work over the way of the toe: a tenth of a turn moves it some centimetres up or down."""
    plain, pushed = (SyntheticLeg(GaitConfig(load=LoadConfig(ground_n=force))) for force in (0.0, 100.0))
    changes = [
        pushed.advance(t).torque_impulse - plain.advance(t).torque_impulse for t in (0.1, 0.2, 0.3, 0.4, 0.5)
    ]
    assert np.ptp(changes) > 0.1


def test_the_truth_has_an_entry_a_cycle() -> None:
    leg = SyntheticLeg(GaitConfig(wear_acceleration=1.0e4))
    leg.advance(2.5)
    truth = leg.truth()
    assert truth["cycle_end_s"] == pytest.approx([0.0, 1.0, 2.0], abs=0.01)
    for name in leg.clearance_joints:
        column = truth["clearance_m"][name]
        assert len(column) == 4
        assert (np.diff(column) > 0.0).all()


def test_a_leg_that_stands_hardly_wears() -> None:
    """Friction with a ramp lets journals creep where they hang; that is all that is left."""
    leg = SyntheticLeg(GaitConfig(pace=STOP, wear_acceleration=1.0e4))
    start = leg.clearance_m()
    leg.advance(1.0)
    walked = leg.clearance_m() - start
    leg.advance(2.0)
    assert (leg.clearance_m() - start - walked < 0.05 * walked).all()


def test_a_leg_can_start_from_standing() -> None:
    pace = PaceConfig(times_s=(0.0, 0.4), speeds_rpm=(0.0, -60.0), ramp_s=0.3)
    leg = SyntheticLeg(GaitConfig(pace=pace))
    assert leg.advance(1.0).crank.speed == pytest.approx(-2.0 * np.pi)


def test_a_knock_opens_one_joint_at_its_time() -> None:
    leg = SyntheticLeg(GaitConfig(knock=KnockConfig(joint="G", at_s=0.25, clearance_m=1.0e-3)))
    leg.advance(0.24)
    assert leg.clearance_m() == pytest.approx(3.0e-4, rel=1e-3)
    leg.advance(0.26)
    assert leg.clearance_m()[leg.clearance_joints.index("G")] == pytest.approx(1.0e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"clearances_m": (1e-4,)},
            "gait: clearances_m: has 1 values. Expected one each for A, B, G, I, J",
        ),
        ({"knock": KnockConfig(joint="C")}, "gait: knock.joint: 'C' is none of A, B, G, I, J"),
        ({"mechanism": "no_leg"}, "no_leg: no mechanism of this name"),
        (
            {"mechanism": "four_bar", "load": LoadConfig(person_kg=80.0)},
            "four_bar.yaml: bodies: has no thigh",
        ),
        (
            {"mechanism": "slider_crank", "load": LoadConfig(ground_n=1.0)},
            "slider_crank.yaml: bodies: has no p",
        ),
    ],
)
def test_what_the_leg_cannot_be_is_refused_in_a_line(changes: dict[str, object], line: str) -> None:
    with pytest.raises(ConfigError) as refused:
        SyntheticLeg(GaitConfig(**changes))
    assert str(refused.value).startswith(line)
