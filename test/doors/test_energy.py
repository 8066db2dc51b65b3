"""Work of the drive and the loads = change of stored energy + losses; torque and forces of an ideal leg."""

import attrs
import pytest

import leg_wear_monitor as lw

# Friction coefficient, force on the ground [N], clearance [m], bound of the residual over the losses in ten
# cycles: some three times what docs/appendix/validation_clearance.md lists, because the cycles of a run
# scatter. Mean and sigma: 1.1e-3, 2e-5; 6.7e-3, 2.1e-3; 0, 7e-5 (10 moved starts, 2026-11-23).
CASES = {
    "in the air": (0.05, 0.0, 3.0e-4, 3.0e-3),
    "a step": (0.05, 290.0, 3.0e-4, 3.0e-3),
    "no friction": (0.0, 0.0, 3.0e-4, 1.5e-2),
    "0.04 mm, friction 0.3": (0.3, 0.0, 4.0e-5, 5.0e-3),
}


def with_friction(leg: lw.Mechanism, coefficient: float) -> lw.Mechanism:
    clearances = {
        name: attrs.evolve(each, friction=attrs.evolve(each.friction, coefficient=coefficient))
        for name, each in leg.clearances.items()
    }
    return attrs.evolve(leg, clearances=clearances)


def closes(energy: lw.EnergyBalance, bound: float) -> bool:
    """Whether the parts of a balance add up, and its residual is small beside the losses."""
    losses = energy.friction_loss + energy.contact_loss + energy.wear_loss
    residual = energy.work_in - energy.stored - losses
    assert energy.residual == pytest.approx(residual, abs=1.0e-9 * abs(energy.work_in))
    return abs(residual) < bound * losses


@pytest.mark.chaotic
@pytest.mark.parametrize("case", CASES)
def test_energy_in_clearance_coordinates(leg, case: str) -> None:
    coefficient, push_n, clearance_m, bound = CASES[case]
    walking = with_friction(leg, coefficient)
    if push_n:
        walking = lw.with_ground_reaction(walking, push_n)
    energy = lw.simulate(walking, clearance_m=clearance_m, cycles=10).energy_j
    assert closes(energy, bound)
    assert (energy.friction_loss > 0.0) == (coefficient > 0.0)
    assert energy.contact_loss > 0.0


# Model, normal law, gait cycles, bound of the residual over the losses, least wear loss over the others. Mean
# and sigma of the residual: 7e-6, 3e-6; -1.5e-4, 3.1e-4; by Winkler's law, of far smaller penetrations,
# 2.8e-5, 2.6e-5; -0.0111, 0.0013 (10 starts moved by 1e-12, 2026-11-23).
WEARING = [
    ("full", None, 2, 1.0e-4, 4.0e-3),
    ("clearance", None, 8, 2.0e-3, 4.0e-3),
    ("full", "winkler", 1, 2.0e-4, 2.5e-3),
    ("clearance", "winkler", 2, 2.0e-2, 2.5e-3),
]


@pytest.mark.chaotic
@pytest.mark.parametrize(("model", "law", "cycles", "bound", "least"), WEARING)
def test_walls_that_wear_away_take_energy_along(leg, model, law, cycles, bound, least) -> None:
    """At 3e4 times the pace of real wear."""
    clearances = {
        name: attrs.evolve(each, wear_coefficient=tuple(3.0e4 * k for k in each.wear_coefficient))
        for name, each in leg.clearances.items()
    }
    fast = attrs.evolve(leg, clearances=clearances)
    energy = lw.simulate(fast, model=model, normal_law=law, wear=True, cycles=cycles).energy_j
    assert energy.wear_loss > least * (energy.friction_loss + energy.contact_loss)
    assert closes(energy, bound)


def test_a_torque_from_rest_does_work_on_springs_a_damper_and_a_load(tmp_path) -> None:
    """Every kind of work is in it."""
    text = (lw.share_directory() / "config" / "mechanisms" / "four_bar.yaml").read_text()
    drive = next(line for line in text.splitlines() if line.startswith("drive:"))
    text = text.replace(
        drive,
        "drive: {body: crank, torque: 2.0}\n"
        "springs:\n  back: {bodies: [ground, rocker], points: [A, C], stiffness: 200.0, free_length: 0.1,"
        " damping: 3.0}\n"
        "loads:\n  tip: {body: coupler, point: toe, phase: [0.0, 0.5], force: [[0, 4], [2, -6]]}",
    )
    (tmp_path / "four_bar.yaml").write_text(text)
    energy = lw.simulate(tmp_path / "four_bar.yaml", clearances=["B"], duration_s=0.5).energy_j
    turned = energy.work_in
    assert turned > 1.0
    assert abs(energy.residual) < 1.0e-4 * turned
    (tmp_path / "steady.yaml").write_text(text.replace("torque: 2.0", "speed: 6.0"))
    assert lw.simulate(tmp_path / "steady.yaml", cycles=0.25, skip_cycles=0).model == "full"
    with pytest.raises(lw.ConfigError, match=r"springs.back.damping: the clearance model has no dampers"):
        lw.simulate(tmp_path / "steady.yaml", model="clearance")


@pytest.mark.parametrize("name", ["bionic_leg", "jansen_leg", "klann_leg", "four_bar"])
def test_an_ideal_leg_gives_back_what_it_takes(name: str) -> None:
    """Over a gait cycle the drive does no work; in the other direction the same torque acts."""
    forth = lw.simulate(name, clearances=[], cycles=1).drive_torque_nm
    back = lw.simulate(name, clearances=[], cycles=1, speed_rpm=-60.0).drive_torque_nm
    assert abs(forth.mean) < 1.0e-6 * forth.rms
    if forth.rms and name == "bionic_leg":
        assert back.rms == pytest.approx(forth.rms, rel=1.0e-9)
