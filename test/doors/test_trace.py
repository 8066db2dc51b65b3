"""Samples of a motion: what both formulations agree on, and laws between the columns."""

import numpy as np
import pytest

import leg_wear_monitor as lw

MODELS = ("clearance", "full")
N = 2048
FRICTION_LAWS = ("ambrosio", "threlfall", "none")


@pytest.fixture(scope="module")
def traces() -> dict[str, lw.Trace]:
    """A part of the first cycle, in which the two formulations have not yet parted."""
    part = {"cycles": 40 / N, "skip_cycles": 0.0, "trace": N}
    return {model: lw.simulate("bionic_leg", model=model, **part).trace for model in MODELS}


def test_the_toe_moves_alike_in_both_formulations(traces) -> None:
    one, other = (traces[model] for model in MODELS)
    for name in ("toe_error_m", "toe_error_mps", "toe_velocity_mps"):
        wanted, found = getattr(other, name), getattr(one, name)
        # an impact changes the velocity at once, and a sample may lie between its times in the two models
        assert np.quantile(np.abs(found - wanted), 0.9) < 0.05 * np.abs(wanted).max(), name
    for name, joint in other.joints.items():
        found = one.joints[name]
        assert np.abs(found.eccentricity_m - joint.eccentricity_m).max() < 0.05 * 3.0e-4
        assert np.abs(found.penetration_m - joint.penetration_m).max() < 0.05 * 3.0e-4


@pytest.mark.parametrize("model", MODELS)
def test_columns_of_a_trace_fit_together(traces, model: str) -> None:
    trace, step = traces[model], 1.0 / N
    position = np.stack([trace.toe_x_m, trace.toe_y_m], axis=1)
    slope = (position[2:] - position[:-2]) / (2.0 * step)
    # an impact between two samples changes the velocity at once, so the median is compared
    assert np.median(np.abs(slope - trace.toe_velocity_mps[1:-1])) < 1.0e-3 * np.abs(slope).max()
    for name, joint in trace.joints.items():
        magnitude = np.hypot(joint.normal_force_n, joint.tangential_force_n)
        assert magnitude == pytest.approx(trace.force_n[name], rel=1.0e-9, abs=1.0e-9)
        assert (joint.normal_force_n[~joint.in_contact] == 0.0).all()
        assert (joint.penetration_m[joint.normal_force_n > 0.0] > 0.0).all()
        assert (np.diff(joint.worn_depth_m) >= 0.0).all()
        distance = np.linalg.norm(joint.eccentricity_m, axis=1)
        assert distance - 3.0e-4 == pytest.approx(joint.penetration_m, abs=1.0e-9)


def test_an_ideal_leg_has_no_errors() -> None:
    trace = lw.simulate("bionic_leg", clearances=[], cycles=1, trace=16).trace
    assert trace.joints == {} and not trace.toe_error_m.any() and not trace.toe_error_mps2.any()


@pytest.mark.parametrize("model", MODELS)
def test_every_friction_law_differs_from_every_other(model: str) -> None:
    work = {
        law: lw.simulate("four_bar", model=model, friction=law, cycles=0.25, skip_cycles=0.0).joints
        for law in FRICTION_LAWS
    }
    found = {law: tuple(joint.archard_integral_j_per_cycle for joint in work[law].values()) for law in work}
    assert len(set(found.values())) == len(FRICTION_LAWS)
    assert all(joint.friction_work_j_per_cycle in (0.0, None) for joint in work["none"].values())
