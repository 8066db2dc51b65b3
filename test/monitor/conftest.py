"""Monitors with and without a ledger, and a steady gait."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from config_of import config_of
from ledger_contents import rows_of

import leg_wear_monitor as lw


@pytest.fixture
def rows(tmp_path: Path) -> Callable[[str], list[Any]]:
    """What a query finds in the ledger of this test."""
    return partial(rows_of, tmp_path / "wear.ledger")


@pytest.fixture
def begin(leg: lw.Mechanism, tmp_path: Path) -> Iterator[Callable[..., lw.WearMonitor]]:
    """Begin a run of a monitor of joints A and G on the ledger of this test; all are closed at its end."""
    begun = []

    def run(
        values: Mapping[str, Any] = MappingProxyType({}),
        changed: Callable[[lw.MonitorConfig], lw.MonitorConfig] = lambda config: config,
    ) -> lw.WearMonitor:
        own = {"ledger.path": str(tmp_path / "wear.ledger"), "clearance_joints": ["A", "G"]}
        config = changed(config_of(own | dict(values)))
        begun.append(lw.open_ledger(leg, config))
        return lw.WearMonitor(leg, config, begun[-1])

    yield run
    for ledger in begun:
        ledger.close()


# --- a monitor on a steady gait ---

START_NS = 1_700_000_000_123_456_789


def _gait(
    duration_s: float,
    rate_hz: float = 200.0,
    rpm: float = 60.0,
    noise_rad: float = 1.0e-3,
    begin_s: float = 0.0,
) -> np.ndarray:
    """Crank samples of a steady gait that began at `START_NS`, with encoder noise."""
    n = np.arange(round(begin_s * rate_hz), round((begin_s + duration_s) * rate_hz))
    random = np.random.default_rng(int(n[0]))
    angle = 2.0 * np.pi * rpm / 60.0 * n / rate_hz + noise_rad * random.standard_normal(len(n))
    return lw.gait_samples(
        START_NS + np.round(1.0e9 * n / rate_hz).astype(np.int64), crank_angle_rad=angle % (2.0 * np.pi)
    )


@pytest.fixture(scope="session")
def gait() -> Callable[..., np.ndarray]:
    """Makes crank samples: `_gait`."""
    return _gait


@pytest.fixture(scope="session")
def new_monitor(leg: lw.Mechanism) -> Callable[..., lw.WearMonitor]:
    """Makes a monitor of the default leg without a ledger."""

    def make(values: Mapping[str, Any] = MappingProxyType({})) -> lw.WearMonitor:
        return lw.WearMonitor(leg, config_of(values))

    return make


@pytest.fixture
def monitor(new_monitor: Callable[..., lw.WearMonitor]) -> lw.WearMonitor:
    """A monitor of the default leg as new."""
    return new_monitor()
