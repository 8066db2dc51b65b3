"""Wear to be kept, without a leg that made it."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from ledger_contents import rows_of

from leg_wear_monitor import Mechanism, WearMonitor
from leg_wear_monitor import open_ledger as wear_ledger
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import Binding, Entry, JointWear, WalkedLoad
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.sample import Samples, gait_samples

SECOND = 10**9


@pytest.fixture(scope="session")
def binding() -> Binding:
    """What the test ledgers are of."""
    return Binding(hardware_id="leg-7", mechanism="bionic_leg", fingerprint="00ff", joints=("A", "B"))


@pytest.fixture(scope="session")
def entry_at() -> Callable[[int], Entry]:
    """An entry after so many seconds, other at every one."""

    def entry(second: int) -> Entry:
        depth = np.random.default_rng(second).random((2, 2, 720)) * 1.0e-6
        return Entry(
            stamp_ns=second * SECOND,
            joints=tuple(
                JointWear(name, depth[k], second, 0.9 * second, k) for k, name in enumerate(("A", "B"))
            ),
            totals={"cycles": float(second), "moving_s": 0.9 * second},
            alarms=(Alarm(kind="clearance", subject="A", level=Level.WARN, acknowledged=second % 2 == 1),),
            spans=((0, second * SECOND, 0),),
            loads=(WalkedLoad(300, second, 0.9 * second, 290.0, 8.0),),
        )

    return entry


@pytest.fixture
def open_ledger(tmp_path: Path, binding: Binding) -> Iterator[Callable[..., Ledger]]:
    """Open the ledger of this test; whatever is open at its end is closed."""
    opened = []

    def open_(binding: Binding = binding, path: Path = tmp_path / "wear.ledger") -> Ledger:
        ledger = Ledger(path, binding, interval_s=5.0)
        opened.append(ledger)
        return ledger

    yield open_
    for ledger in opened:
        ledger.close()


@pytest.fixture
def reopened(open_ledger: Callable[..., Ledger], entry_at: Callable[[int], Entry]) -> Callable[..., Ledger]:
    """The ledger of this test after a run that noted something, kept an entry and ended in order."""

    def again(*notes: Any) -> Ledger:
        ledger = open_ledger()
        for note in notes:
            ledger.note(note)
        ledger.keep(entry_at(1), closed=True)
        ledger.close()
        return open_ledger()

    return again


@pytest.fixture
def rows(tmp_path: Path) -> Callable[[str], list[Any]]:
    """What a query finds in the ledger of this test."""
    return partial(rows_of, tmp_path / "wear.ledger")


@pytest.fixture
def begin(leg: Mechanism, tmp_path: Path) -> Iterator[Callable[..., WearMonitor]]:
    """Begin a run of a monitor of joints A and G on the ledger of this test; all are closed at its end."""
    begun = []

    def run(
        values: Mapping[str, Any] = MappingProxyType({}),
        changed: Callable[[MonitorConfig], MonitorConfig] = lambda config: config,
    ) -> WearMonitor:
        own = {"ledger.path": str(tmp_path / "wear.ledger"), "clearance_joints": ["A", "G"]}
        config = changed(config_from(own | dict(values)))
        begun.append(wear_ledger(leg, config))
        return WearMonitor(leg, config, begun[-1])

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
) -> Samples:
    """Crank samples of a steady gait that began at `START_NS`, with encoder noise."""
    n = np.arange(round(begin_s * rate_hz), round((begin_s + duration_s) * rate_hz))
    random = np.random.default_rng(int(n[0]))
    angle = 2.0 * np.pi * rpm / 60.0 * n / rate_hz + noise_rad * random.standard_normal(len(n))
    return gait_samples(
        START_NS + np.round(1.0e9 * n / rate_hz).astype(np.int64), crank_angle_rad=angle % (2.0 * np.pi)
    )


@pytest.fixture(scope="session")
def gait() -> Callable[..., Samples]:
    """Makes crank samples: `_gait`."""
    return _gait


@pytest.fixture(scope="session")
def new_monitor(leg: Mechanism) -> Callable[..., WearMonitor]:
    """Makes a monitor of the default leg without a ledger."""

    def make(values: Mapping[str, Any] = MappingProxyType({})) -> WearMonitor:
        return WearMonitor(leg, config_from(values))

    return make


@pytest.fixture
def monitor(new_monitor: Callable[..., WearMonitor]) -> WearMonitor:
    """A monitor of the default leg as new."""
    return new_monitor()
