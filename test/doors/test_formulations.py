"""Full coordinates and clearance coordinates, which share no equations of motion, give the same leg."""

import pytest

import leg_wear_monitor as lw

# Relative bounds of mean forces and wear over five cycles: see test_sample_bags.
FORCE, WEAR = {"A": 0.03, "B": 0.03, "G": 0.03}, {"A": 0.04, "B": 0.21, "G": 0.21}


@pytest.fixture(scope="module")
def both(leg) -> dict[str, lw.SimulationResult]:
    return {model: lw.simulate(leg, model=model, cycles=6) for model in ("full", "clearance")}


@pytest.mark.chaotic
def test_mean_forces_and_wear_agree_within_their_scatter(both) -> None:
    full, clearance = both["full"], both["clearance"]
    for joint, bound in FORCE.items():
        of_full, other = full.joints[joint], clearance.joints[joint]
        assert other.mean_force_n == pytest.approx(of_full.mean_force_n, rel=bound)
        wear = of_full.archard_integral_j_per_cycle
        assert other.archard_integral_j_per_cycle == pytest.approx(wear, rel=WEAR[joint])
    assert clearance.drive_torque_nm.rms == pytest.approx(full.drive_torque_nm.rms, rel=0.05)


def test_from_one_start_both_come_to_the_same_first_impacts(leg) -> None:
    """Later ones differ, because the motion is chaotic."""
    full, clearance = (
        lw.simulate(leg, model=model, cycles=0.05, skip_cycles=0).impacts for model in ("full", "clearance")
    )
    for joint in "ABG":
        of_full, other = full[joint][0], clearance[joint][0]
        assert other.begin_s == pytest.approx(of_full.begin_s, rel=1.0e-3)
        assert other.speed_mps == pytest.approx(of_full.speed_mps, rel=1.0e-2)
        assert other.peak_n == pytest.approx(of_full.peak_n, rel=2.0e-2)


def test_a_narrow_clearance_carries_the_forces_of_the_ideal_leg(leg) -> None:
    ideal = lw.simulate(leg, clearances=[], cycles=1)
    narrow = lw.simulate(leg, clearances=["A"], clearance_m=1.0e-5, cycles=1)
    for joint in "ABGIJ":
        force_n = ideal.joints[joint].mean_force_n
        assert narrow.joints[joint].mean_force_n == pytest.approx(force_n, rel=0.05)
