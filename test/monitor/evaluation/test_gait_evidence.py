"""Which gait cycles can be this leg's, and what is said where none can."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.gait_evidence import GaitEvidence, doubts
from leg_wear_monitor.twin.sample import EMPTY, NO_FAULT, gait_samples

pytestmark = pytest.mark.plain


def cycle(**other: float) -> Any:
    """A gait cycle of a healthy leg, with other figures."""
    healthy = {
        "cadence_rpm": 60.0,
        "torque_samples": 200,
        "measured_torque_rms_nm": 8.4,
        "predicted_torque_rms_nm": 8.4,
        "residual_torque_rms_nm": 1.2,
        "torque_mismatch": 0.03,
    }
    moving_s = 60.0 / abs(other.get("cadence_rpm", 60.0))
    times = {"begin_ns": 0, "stamp_ns": round(1e9 * moving_s), "moving_s": moving_s}
    return SimpleNamespace(**healthy | times | other)


@pytest.mark.parametrize(
    "other",
    [
        {},
        {"cadence_rpm": 45.0},
        {"cadence_rpm": 26.0, "stamp_ns": 4_300_000_000},  # it stopped, stood for two seconds, and started
        {"torque_mismatch": 0.34},  # a healthy leg's with a sensor that samples at instants
        {"torque_mismatch": 0.6},
        {"torque_mismatch": np.nan},  # not compared yet
        {"torque_samples": 0, "measured_torque_rms_nm": np.nan, "torque_mismatch": np.nan},
    ],
)
def test_a_leg_is_believed_worn_slow_or_without_torque(other: dict[str, float]) -> None:
    assert doubts(cycle(**other), MonitorConfig()) == []


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ({"cadence_rpm": 3.0}, "the crank turns at 3 rpm, the commanded cadence is 60 rpm"),
        ({"cadence_rpm": -60.0}, "the crank turns at -60 rpm, the commanded cadence is 60 rpm"),
        ({"cadence_rpm": 300.0}, "the crank turns at 300 rpm, the commanded cadence is 60 rpm"),
        ({"torque_mismatch": 1.2}, "the drive torque does not resemble the predicted one"),
        (
            {"torque_mismatch": np.nan, "residual_torque_rms_nm": 9.0},
            "the drive torque does not resemble the predicted one",
        ),
        ({"measured_torque_rms_nm": 0.01}, "the drive torque is only 0.01 N m RMS"),
        ({"measured_torque_rms_nm": 8e3, "torque_mismatch": 1e3}, "the drive torque is 8e+03 N m RMS"),
    ],
)
def test_another_machine_is_not(other: dict[str, float], why: str) -> None:
    (found,) = doubts(cycle(**other), MonitorConfig())
    assert found.startswith(why)
    evidence = GaitEvidence(MonitorConfig())
    evidence.add(cycle(**other))
    assert evidence.missing() == found
    evidence.add(cycle())
    assert (evidence.believable, evidence.doubtful, evidence.missing()) == (1, 1, "")


def seen(rate_hz: float = 200.0, rpm: float = 60.0, seconds: float = 4.0, fault: int = NO_FAULT) -> str:
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    samples = gait_samples(
        (1e18 + 1e9 * times).astype(np.int64), crank_angle_rad=times * rpm * np.pi / 30.0, fault=fault
    )
    evidence = GaitEvidence(MonitorConfig())
    for block in np.array_split(samples, 3):
        evidence.add_samples(block)
    return evidence.missing()


def test_what_is_missing_is_named() -> None:
    assert seen(seconds=0.0) == "there is no crank sample"
    assert seen(fault=EMPTY) == "no crank sample can be used (800 empty)"
    assert seen(rate_hz=1.0) == "no two of 4 crank samples follow each other within 0.5 s"
    assert seen(rate_hz=5.0) == "crank samples come at 5.26 Hz, too few: 60 rpm need 12 Hz"
    assert seen(seconds=1.0) == "the crank turns 0.99 times in 0.995 s: less than a whole gait cycle"
    almost = "1.95 times in 1.96 s: less than two turns, in which there is a whole gait cycle"
    assert seen(seconds=1.96) == f"the crank turns {almost}"
    assert seen(rpm=3.0, seconds=60.0) == "the crank turns at 3 rpm, the commanded cadence is 60 rpm"
    assert seen().startswith("the crank turns 3.99 times, but its motion cannot be followed")


def test_angles_without_end_are_no_error() -> None:
    samples = gait_samples(np.arange(4) * 10**7 + 10**18, crank_angle_rad=[1e308, -1e308, 1e308, 0.0])
    evidence = GaitEvidence(MonitorConfig())
    evidence.add_samples(samples)
    assert evidence.missing()
