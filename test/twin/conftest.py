"""Gaits as samples, and twins made ready."""

from collections.abc import Callable

import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import Samples, gait_samples

START_NS = 1_700_000_000_123_456_789


def _gait(
    duration_s: float, rate_hz: float = 200.0, angle: Callable[[np.ndarray], np.ndarray] | None = None,
    noise_rad: float = 1.0e-3, seed: int = 0, start_ns: int = START_NS,
) -> Samples:  # fmt: skip
    """Crank samples of a motion angle(t) [rad], 60 rpm if not given, with noise and wrapped to a turn."""
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    angles = TURN * t + 0.5 if angle is None else angle(t)
    angles = angles + noise_rad * np.random.default_rng(seed).standard_normal(len(t))
    return gait_samples(start_ns + np.round(1.0e9 * t).astype(np.int64), crank_angle_rad=angles % TURN)


@pytest.fixture(scope="session")
def gait() -> Callable[..., Samples]:
    """Makes crank samples: `_gait`."""
    return _gait


@pytest.fixture
def twin(leg: Mechanism) -> DigitalTwin:
    """A twin of the default leg as new."""
    return DigitalTwin(leg)
