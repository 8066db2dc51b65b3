"""A leg in full coordinates: its drive torque names an opened joint, and nothing in a healthy leg."""

from collections.abc import Callable

import numpy as np
import pytest

import leg_wear_monitor as lw

RATE_HZ = 200
OPENED_M = 1.0e-3
HEALTHY, OPENED = 4, 10  # gait cycles
TAKEN = 21  # gait cycles before and after a change within a baseline; the table loses the first

pytestmark = pytest.mark.chaotic


@pytest.fixture(scope="module")
def healthy(torque_of, table) -> dict[str, np.ndarray]:
    return table(torque_of(HEALTHY), torque_of(OPENED))


@pytest.fixture(scope="module")
def opened(torque_of, table) -> Callable[[str], lw.ReplaySummary]:
    """Summary of a walk in which a joint opens."""

    def replayed(joint: str) -> lw.ReplaySummary:
        walk = table(torque_of(HEALTHY), torque_of(OPENED, **{joint: OPENED_M}))
        return lw.replay(walk).summary()

    return replayed


@pytest.mark.parametrize("joint", ["A", "G"])
def test_the_opened_joint_is_named_with_its_clearance_and_no_other_one_is(opened, joint: str) -> None:
    """Over 5 moved starts (2026-11-25): G 0.900 mm."""
    summary = opened(joint)
    assert (summary.verdict.state.value, summary.verdict.joints) == ("stop", (joint,))
    assert summary.verdict.fault_code == f"CLEARANCE_DETECTED_{joint}"
    for name, clearance in summary.clearances.items():
        if name == joint:
            assert clearance.estimated_by == ("torque",)
            assert clearance.best_estimate_m == pytest.approx(OPENED_M, abs=2.0e-4)
        else:  # the change of one joint hides the others
            assert (clearance.estimated_by, clearance.best_estimate_m) == ((), None)


@pytest.mark.parametrize(
    ("change", "coulomb_nm"),
    [
        (lambda torque: torque, 0.0),
        (lambda torque: torque + 3.0, 3.0),
        (lambda torque: torque + np.random.default_rng(1).normal(0.0, 1.0, len(torque)), 0.0),
    ],
    ids=["as it is", "friction of the drive", "noise"],
)
def test_a_healthy_leg_is_healthy(healthy, change, coulomb_nm: float) -> None:
    summary = lw.replay({**healthy, "drive_torque": change(healthy["drive_torque"])}).summary()
    assert (summary.verdict.state.value, summary.verdict.joints) == ("healthy", ())
    assert summary.diagnosis.cycles_used >= 4
    assert summary.drive.coulomb_nm.value == pytest.approx(coulomb_nm, abs=0.3)
    for clearance in summary.clearances.values():
        assert clearance.status.value == "healthy"
        assert clearance.best_estimate_m == pytest.approx(3.0e-4, abs=2.0e-5)
        assert clearance.best_estimate_sigma_m >= 3.0e-5  # of a leg whose clearances nobody has measured


@pytest.mark.parametrize(
    ("joint", "opened_m"), [pytest.param("A", 3.6e-4, marks=pytest.mark.slow), ("B", 3.8e-4)]
)
def test_a_joint_that_opens_while_the_baseline_is_taken_is_reported(
    torque_of, table, joint: str, opened_m: float
) -> None:
    """The change lies within the fifty gait cycles of a baseline, which would hide it."""
    walk = table(torque_of(TAKEN), torque_of(TAKEN, **{joint: opened_m}))
    summary = lw.replay(walk).summary()
    assert (summary.verdict.state.value, summary.verdict.joints) == ("inspect", (joint,))
    clearance = summary.clearances[joint]
    assert clearance.estimated_by == ("torque",)
    assert clearance.change_m == pytest.approx(opened_m - 3.0e-4, abs=3.0 * clearance.change_sigma_m)
    assert (
        clearance.estimated_sigma_m > clearance.change_sigma_m
    )  # the clearance in the baseline is not exact


def test_two_joints_that_open_at_once_are_named_together(torque_of, table) -> None:
    walk = table(torque_of(TAKEN), torque_of(TAKEN, A=4.0e-4, G=4.2e-4))
    summary = lw.replay(walk).summary()
    assert (summary.verdict.state.value, summary.verdict.fault_code) == ("inspect", "CLEARANCE_CHANGED_A_G")
    assert summary.diagnosis.cause == "several"
    for joint in ("A", "G"):
        assert summary.clearances[joint].change_m > 5.0e-5


def test_two_joints_that_cannot_be_told_apart_are_not_one_joint(torque_of, table) -> None:
    """G at 0.461 mm was named alone, before pairs were compared with their interaction (2026-11-29)."""
    walk = table(torque_of(TAKEN), torque_of(TAKEN, G=4.5e-4, J=4.5e-4))
    summary = lw.replay(walk).summary()
    assert (summary.verdict.state.value, summary.diagnosis.cause) == ("inspect", "several")
    assert len(summary.verdict.joints) > 1
    assert all(clearance.estimated_by == () for clearance in summary.clearances.values())


def late(walk: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """A walk whose torque comes 10 ms late."""
    return {**walk, "drive_torque": np.interp(walk["time"] - 0.01, walk["time"], walk["drive_torque"])}


@pytest.mark.slow  # a shorter walk below holds it for 20 ms
def test_a_late_torque_accuses_no_joint(torque_of, table) -> None:
    verdict = lw.replay(late(table(torque_of(TAKEN), torque_of(TAKEN)))).summary().verdict
    assert (verdict.fault_code, verdict.joints) == ("TORQUE_TIMING", ())


def test_a_late_torque_hides_no_joint_that_opens(torque_of, table) -> None:
    """The delay is not declared, and the joint opens before there is a baseline."""
    opened_m = 4.5e-4
    summary = lw.replay(late(table(torque_of(TAKEN), torque_of(TAKEN, G=opened_m)))).summary()
    assert (summary.verdict.fault_code, summary.diagnosis.cause_subject) == ("CLEARANCE_CHANGED_G", "G")
    assert "the timing of the drive torque does not fit" in summary.verdict.why
    assert summary.clearances["G"].estimated_m == pytest.approx(opened_m, abs=8.0e-5)


def test_before_a_joint_opens_nothing_is_reported(healthy) -> None:
    first = {name: column[: HEALTHY * RATE_HZ] for name, column in healthy.items()}
    verdict = lw.replay(first).summary().verdict
    assert (
        verdict.joints,
        [evidence.name for evidence in verdict.evidence if "clearance" in evidence.name],
    ) == ((), [])


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda torque: 1.5 * torque, "TORQUE_SCALE"),
        (lambda torque: np.roll(torque, 4), "TORQUE_TIMING"),
        (lambda torque: -torque, "TORQUE"),
    ],
    ids=["scale", "lag", "sign"],
)
def test_a_wrong_torque_is_named_and_accuses_no_joint(healthy, change, code: str) -> None:
    summary = lw.replay({**healthy, "drive_torque": change(healthy["drive_torque"])}).summary()
    assert (summary.verdict.state.value, summary.verdict.joints) == ("inspect", ())
    assert summary.verdict.fault_code.startswith(code)
    assert all(clearance.estimated_by == () for clearance in summary.clearances.values())
    if code == "TORQUE_SCALE":
        assert summary.drive.scale.value == pytest.approx(1.5, abs=0.1)
