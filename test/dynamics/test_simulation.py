"""simulate: what is counted, and that its figures are those of the parts below it."""

import numpy as np
import pytest

from leg_wear_monitor import ConfigError, load_mechanism, simulate
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle

FULL = {"model": "full"}


@pytest.fixture(scope="module")
def worn_leg(leg):
    """Half a cycle counted after a quarter skipped, wear opening the clearances, with a trace."""
    return simulate(leg, cycles=0.5, skip_cycles=0.25, wear=True, trace=40, **FULL)


def test_without_clearances_it_is_the_ideal_cycle(leg, linkage_of):
    result = simulate(leg, clearances=(), cycles=2, trace=36)
    motion = one_cycle(linkage_of("bionic_leg"), 36, TURN)
    assert result.model == "ideal"
    np.testing.assert_allclose(result.trace["drive_torque_nm"], np.tile(motion.drive_torque, 2), atol=1.0e-9)
    for i, name in enumerate(leg.joints):
        force = np.linalg.norm(motion.joint_force[:, i], axis=1)
        np.testing.assert_allclose(result.trace["force_n"][name][:36], force, atol=1.0e-9)
        assert result.joints[name]["mean_force_n"] == pytest.approx(force.mean(), rel=0.01)
    assert result.trace["crank_angle_rad"] == pytest.approx(np.arange(72) * TURN / 36)


def test_backwards_the_ideal_trace_runs_backwards(leg):
    forth, back = (simulate(leg, clearances=(), cycles=1, trace=8, speed_rpm=rpm) for rpm in (60.0, -60.0))
    assert back.speed_rpm == pytest.approx(-60.0)
    assert back.trace["crank_angle_rad"] == pytest.approx(
        [-angle for angle in forth.trace["crank_angle_rad"]]
    )
    assert back.trace["toe_x_m"][1:] == pytest.approx(forth.trace["toe_x_m"][:0:-1])


def test_backwards_with_clearances(leg):
    result = simulate(leg, clearances="G", cycles=0.25, skip_cycles=0.0, speed_rpm=-60.0, trace=16, **FULL)
    assert result.speed_rpm == pytest.approx(-60.0)
    assert result.trace["crank_angle_rad"] == pytest.approx(np.arange(4) * -TURN / 16, abs=1.0e-6)
    assert result.joints["G"]["mean_force_n"] > 10.0


def test_what_is_counted(worn_leg):
    assert worn_leg.cycles == pytest.approx(0.5)
    assert worn_leg.simulated_s == pytest.approx(0.75)
    assert worn_leg.speed_rpm == pytest.approx(60.0)
    assert len(worn_leg.trace["crank_angle_rad"]) == 20
    assert worn_leg.trace["crank_angle_rad"] == pytest.approx(TURN * np.arange(10, 30) / 40, abs=1.0e-6)


def test_impacts_follow_one_another(worn_leg):
    for name in worn_leg.loose:
        impacts = worn_leg.impacts[name]
        assert impacts
        ends = [impact["end_s"] for impact in impacts[:-1]]
        assert all(0.0 < impact["speed_mps"] < 10.0 for impact in impacts)
        assert all(impact["begin_s"] < impact["end_s"] for impact in impacts[:-1])
        assert all(end <= after["begin_s"] for end, after in zip(ends, impacts[1:], strict=True))
        assert worn_leg.joints[name]["max_force_n"] >= max(impact["peak_n"] for impact in impacts) > 0.0


def test_wear_is_archards_and_opens_the_clearance(leg, worn_leg):
    for name in worn_leg.loose:
        figures, settings = worn_leg.joints[name], leg.clearances[name]
        area = TURN * settings.bushing_radius * settings.width
        for side, k in zip(("bushing", "journal"), settings.wear_coefficient, strict=True):
            mean = figures["wear_depth_m_per_cycle"][f"{side}_mean"]
            assert mean * area == pytest.approx(k * figures["archard_integral_j_per_cycle"], rel=1.0e-9)
        opened = np.array(list(figures["clearance_m"].values())) - settings.radial_clearance
        assert 0.0 < opened[0] < opened[1] < 1.0e-9


def test_statistics_hang_together(worn_leg):
    for figures in worn_leg.joints.values():
        mean, rms, p99, peak = (figures[f"{key}_force_n"] for key in ("mean", "rms", "p99", "max"))
        assert 0.0 < mean <= rms <= peak
        assert mean < p99 <= peak * 1.01
    torque = worn_leg.drive_torque_nm
    assert torque["min"] < torque["mean"] < torque["p99"] <= torque["max"] * 1.01


def test_an_impact_of_the_first_cycle_can_be_counted():
    """With a duration nothing is skipped: the slider-crank's first impact is there."""
    result = simulate(load_mechanism("slider_crank"), duration_s=3.0e-4, **FULL)
    assert len(result.impacts["B"]) == 1
    assert result.impacts["B"][0]["begin_s"] == pytest.approx(2.2729e-4, abs=1.0e-8)


def test_a_torque_drive_has_no_cycles():
    with pytest.raises(ConfigError, match=r"andrews.yaml: drive\.torque: .*expected --duration"):
        simulate(load_mechanism("andrews"), cycles=1)


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"model": "guess"}, "'guess' is not one of"),
        ({"cycles": 0.0}, "cycles: 0 is not .* above 0"),
        ({"duration_s": float("nan")}, "duration: nan s is not"),
        ({"skip_cycles": -1.0}, "skip-cycles: -1"),
        ({"speed_rpm": 0.0}, "does not turn the crank"),
        ({"clearances": ("A", "A")}, "names a joint twice"),
        ({"clearances": ("X",)}, "X"),
        ({"clearance_m": -1.0}, "is not above 0 m"),
        ({"clearance_m": 0.02}, "bushing_radius|bushing"),
        ({"normal_law": "soft"}, "'soft' is not one of"),
        ({"trace": -1}, "trace: -1"),
    ],
)
def test_what_cannot_be_is_refused(leg, options, fault):
    with pytest.raises(ConfigError, match=fault):
        simulate(leg, **options)
