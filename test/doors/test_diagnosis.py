"""A leg in full coordinates opens a joint, and its torque names it: benchmarks/diagnosis.py in short."""

from pathlib import Path

import numpy as np
import pytest

import leg_wear_monitor as lw

RATE_HZ, PARTS = 200, 10  # samples a second, and of a gait cycle; instants of the simulation in one of them
NEW_M, OPENED_M = 3.0e-4, 1.0e-3
HEALTHY, OPENED = 4, 10  # gait cycles


def torque_nm(file: Path, knee_m: float, cycles: int) -> np.ndarray:
    """Drive torque at the instants of some gait cycles of the default leg with a clearance in joint G."""
    text = (lw.share_directory() / "config" / "mechanisms" / "bionic_leg.yaml").read_text()
    radial = {**dict.fromkeys("ABGIJ", NEW_M), "G": knee_m}
    own = "".join(f"    {joint}: {{radial_clearance: {each}}}\n" for joint, each in radial.items())
    text = text.replace("  joints: [A, B, G, I, J]\n", f"  joints:\n{own}")
    assert own in text
    file.write_text(text)
    return lw.simulate(file, model="full", cycles=cycles, trace=RATE_HZ * PARTS).trace.drive_torque_nm


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """A table of a walk at 60 rpm: torques are means since the sample before; sensors are noisy."""
    file, noise = tmp_path_factory.mktemp("leg") / "leg.yaml", np.random.default_rng(0)
    torque = np.concatenate([torque_nm(file, NEW_M, HEALTHY), torque_nm(file, OPENED_M, OPENED)])
    k = np.arange(1, len(torque) // PARTS)
    means = torque[1 : 1 + len(k) * PARTS].reshape(-1, PARTS).mean(axis=1)
    return {
        "time": 1.0 + k / RATE_HZ,
        "crank_angle": 2.0 * np.pi * k / RATE_HZ + noise.normal(0.0, 2.0e-4, len(k)),
        "drive_torque": means + noise.normal(0.0, 0.05, len(k)),
    }


@pytest.mark.chaotic
def test_the_joint_is_named_with_its_clearance_and_no_other_one_is(walk: dict[str, np.ndarray]) -> None:
    """Over 5 moved starts (2026-11-25): G 0.900 mm."""
    summary = lw.replay(walk).summary()
    assert (summary.verdict.state.value, summary.verdict.joints) == ("stop", ("G",))
    assert summary.verdict.fault_code == "CLEARANCE_SEEN_G"
    for joint, clearance in summary.clearances.items():
        if joint == "G":
            assert clearance.seen_by == ("torque",)
            assert clearance.believed_m == pytest.approx(OPENED_M, abs=2.0e-4)
        else:  # a change hides others
            assert (clearance.seen_by, clearance.believed_m) == ((), None)


@pytest.mark.chaotic
def test_before_it_opens_nothing_is_said(walk: dict[str, np.ndarray]) -> None:
    healthy = {name: column[: HEALTHY * RATE_HZ] for name, column in walk.items()}
    verdict = lw.replay(healthy).summary().verdict
    assert (
        verdict.joints,
        [evidence.name for evidence in verdict.evidence if "clearance" in evidence.name],
    ) == ((), [])
